//! The emulated controller's frames have the bit lengths of the simulator's bus.

use chips::stm32g4::fdcan::Message;
use hil_sim::bus::can::{CanFrame, Format, Identifier};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

const LENGTHS: [usize; 16] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64];

#[test]
fn both_models_count_the_same_bits() {
    let mut random = Pcg64Mcg::seed_from_u64(7);
    for round in 0..4_000u32 {
        let is_fd = round % 2 == 0;
        let is_extended = round % 4 < 2;
        let code = (random.next_u32() % if is_fd { 16 } else { 9 }).to_le_bytes()[0];
        let mut data = vec![0; LENGTHS[usize::from(code)]];
        random.fill_bytes(&mut data);
        if round % 3 == 0 {
            // Long runs of equal bits cause bit stuffing.
            data.iter_mut().for_each(|byte| *byte = if *byte < 128 { 0 } else { 0xFF });
        }
        let identifier = random.next_u32() & if is_extended { 0x1FFF_FFFF } else { 0x7FF };
        let message = Message {
            identifier,
            is_extended,
            is_remote: false,
            is_fd,
            switches_rate: is_fd,
            is_sender_error_passive: false,
            code,
            data: data.clone(),
        };
        let identifier = if is_extended {
            Identifier::Extended(identifier)
        } else {
            Identifier::Standard(u16::try_from(identifier).unwrap())
        };
        let format = if is_fd { Format::Fd } else { Format::Classic };
        let known = CanFrame::new(identifier, format, &data).unwrap().wire_bits();
        let bits = message.wire_bits();
        let both = [(bits.head, known.head), (bits.fast, known.fast), (bits.tail, known.tail)];
        assert!(both.iter().all(|(one, other)| one == other), "{message:?}: {both:?}");
    }
}
