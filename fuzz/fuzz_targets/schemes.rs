//! Fuzzes scheme rows and saved schemes: errors are reported; running schemes command finite forces.
#![no_main]

use std::cell::RefCell;

use dimsart_core::{Dimsart, TickResult, Word, scheme};
use dimsart_fuzz::{SIDES, arm, controller};
use dimsart_link::saved_scheme::{self, Writer, fingerprint};
use dimsart_modules::ALL;
use libfuzzer_sys::fuzz_target;

thread_local! {
    static CONTROLLER: RefCell<(Dimsart, u32)> = RefCell::new({
        let mut dimsart = controller();
        let fingerprint = fingerprint(dimsart.engine_mut());
        (dimsart, fingerprint)
    });
}

/// Runs two ticks; forces must be finite, and 0 unless the scheme runs.
fn run(dimsart: &mut Dimsart) {
    for position in [0.5, -1e30] {
        let mut forces = [Word(0xDEAD); 3];
        let tick = dimsart.tick(&[Word::from(position); 3], &mut forces);
        assert!(forces.iter().all(|force| f32::from_bits(force.0).is_finite()));
        assert!(tick == TickResult::Ran || forces == [Word(0); 3]);
    }
}

fuzz_target!(|bytes: &[u8]| {
    CONTROLLER.with_borrow_mut(|(dimsart, fingerprint)| {
        dimsart.connect(arm(), ALL).unwrap();
        if let Ok(text) = core::str::from_utf8(bytes) {
            let mut named = 0;
            let failed = scheme::load(text, "slave", SIDES, dimsart, |error| {
                assert!(error.place.line <= 1 + text.lines().count());
                named += 1;
            });
            assert_eq!(failed, named);
            run(dimsart);
        }
        // As they are, and with a valid checksum, which a fuzzer does not find by chance.
        assert!(saved_scheme::load(bytes, *fingerprint, dimsart).is_err());
        let mut sealed = saved_scheme::SchemeBytes::new();
        Writer::new(&mut sealed, *fingerprint).finish().unwrap();
        let header = 5;
        let mut kept = sealed[..header].to_vec();
        kept.extend_from_slice(&bytes[..bytes.len().min(500)]);
        let crc = crc::Crc::<u32>::new(&crc::CRC_32_AUTOSAR).checksum(&kept);
        kept.extend_from_slice(&crc.to_le_bytes());
        let is_loaded = saved_scheme::load(&kept, *fingerprint, dimsart).is_ok();
        if !is_loaded {
            assert!(!dimsart.engine().is_running(), "what was refused leaves no module");
            assert_eq!(dimsart.engine().steps().count(), 0);
        }
        run(dimsart);
    });
});
