//! The tick's code in CCM SRAM, on boards that have it.

use std::sync::Arc;

use cycles::image::Segment;
use cycles::machine::Machine;
use cycles::timing::{Column, Profile, Timing};

use crate::common::firmware;

const CCM: u32 = 0x1000_0000;

#[test]
fn the_start_copies_the_tick_to_where_it_runs() {
    let Some(firmware) = firmware() else { return };
    let mut image = (*firmware.image).clone();
    let tick = image.function("dimsart_tick").unwrap().address;
    let Some(code) = image.segments.iter_mut().find(|segment| segment.address == CCM) else {
        assert!(tick < CCM, "{tick:#010x} is not in the copied range");
        return;
    };
    let (load_address, bytes) = (code.load_address, code.bytes.clone());
    // Empty before the start.
    code.bytes.fill(0);
    (code.load_address, code.is_writable) = (CCM, true);
    image.segments.push(Segment {
        address: load_address,
        load_address,
        bytes: bytes.clone(),
        is_writable: false,
    });
    let start = image.function("__pre_init").unwrap().address;
    let timing = Timing::new(Profile::ZeroWait, Column::Likely);
    let mut machine = Machine::new(Arc::new(image), timing).unwrap();
    machine.call(start, [0; 4]).unwrap();
    let mut copied = vec![0; bytes.len()];
    machine.read(CCM, &mut copied).unwrap();
    assert!((CCM..CCM + u32::try_from(bytes.len()).unwrap()).contains(&tick));
    assert_eq!(copied, bytes);
}
