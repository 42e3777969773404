//! Handles of modules whose words move.

use dimsart_core::{AxisKind, DeviceDescriptor, Dimsart, ProvidedMemory, TickResult, Word, scheme, types};
use dimsart_modules::ALL;

const SCHEME: &str = "
    all NORMALIZER_MOD   PORT_SIGNAL_IN POSITION
    all MOD_ENG          MOD_ON NORMALIZER_MOD
    all TIMEDELAY_MOD    TD_PARAM 2
    all MOD_ENG          MOD_ON TIMEDELAY_MOD
    all NORMALIZER_MOD.2 PORT_SIGNAL_IN CH1_TD_WAVES
    all NORMALIZER_MOD.2 PORT_SIGNAL_OUT SIGNAL_OUT.2
    all NORMALIZER_MOD.2 SCALE 2
    all MOD_ENG          MOD_ON NORMALIZER_MOD.2
    all MOD_ENG          MATCHING_CHECK";

fn load(dimsart: &mut Dimsart, rows: &str) {
    let faults = scheme::load(rows, "all", &[], dimsart, |error| eprintln!("{error:?}"));
    assert_eq!(faults, 0);
}

#[test]
fn handles_and_memories_follow_their_words_when_a_module_before_them_goes() {
    let axes = [AxisKind::Linear; 2];
    let outputs = &[types::POSITION, types::CH1_WAVES];
    let device = DeviceDescriptor::new("arm", &axes, 1e-3, outputs, &[]);
    let mut dimsart = Dimsart::new(ProvidedMemory::leak_default(), device.unwrap(), ALL).unwrap();
    load(&mut dimsart, SCHEME);
    for tick in 0..8_u8 {
        if tick == 3 {
            load(&mut dimsart, "all MOD_ENG MOD_OFF NORMALIZER_MOD");
        }
        let waves = [f32::from(tick), 100.0 + f32::from(tick)];
        let measured = [0.0, 0.0, waves[0], waves[1]].map(Word::from);
        assert_eq!(dimsart.tick(&measured, &mut []), TickResult::Ran);

        let data_base = dimsart.engine().data_base();
        let signal = dimsart.engine().device().signal("SIGNAL_OUT.2").unwrap();
        let found = data_base.words(data_base.slot(signal).unwrap());
        let expected = if tick < 2 { [0.0; 2] } else { waves.map(|wave| 2.0 * (wave - 2.0)) };
        assert_eq!(found, expected.map(f32::to_bits), "tick {tick}");
    }
}
