//! Modules that generate, delay and record signals: exact to the tick, and reproducible.
#![expect(clippy::unwrap_used, reason = "in helpers of tests as in tests")]
#![expect(clippy::cast_possible_truncation, clippy::float_cmp, reason = "rounded and compared on purpose")]

use crate::common::{Alone, Bench, H, assert_close};
use dimsart_core::{ProvidedMemory, scheme, types};
use dimsart_modules::ALL;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

#[test]
fn a_delay_gives_an_impulse_back_after_exactly_its_ticks() {
    for ticks in [0, 1, 2, 7, 600] {
        let rows = format!("TIMEDELAY_MOD TD_PARAM {ticks}\nMOD_ENG MOD_ON TIMEDELAY_MOD");
        let mut delay = Alone::new(3, &[types::CH1_WAVES], "CH1_TD_WAVES", &rows);
        for tick in 0..3 * (ticks + 1) {
            let sent = if tick == 0 { [1.0, -2.0, 3.0] } else { [0.0; 3] };
            let expected = if tick == ticks { [1.0, -2.0, 3.0] } else { [0.0; 3] };
            assert_eq!(delay.axes(&sent), expected, "{ticks} ticks, at {tick}");
        }
    }
}

#[test]
fn a_delay_plugged_in_again_is_empty() {
    let rows = "TIMEDELAY_MOD TD_PARAM 5\nMOD_ENG MOD_ON TIMEDELAY_MOD";
    let mut delay = Alone::new(1, &[types::CH1_WAVES], "CH1_TD_WAVES", rows);
    for _ in 0..8 {
        delay.step(&[1.0]);
    }
    delay.bench.rows("MOD_ENG MOD_OFF TIMEDELAY_MOD\nMOD_ENG MOD_ON TIMEDELAY_MOD");
    for tick in 0..20 {
        assert_eq!(delay.step(&[2.0]), if tick < 5 { 0.0 } else { 2.0 }, "{tick}");
    }
}

#[test]
fn a_delay_is_not_disturbed_when_a_module_before_it_in_the_data_base_goes() {
    let mut bench = Bench::of(2, &[types::CH1_WAVES], &[]);
    bench.run(
        "TIMEDELAY_MOD.2 TD_PARAM 33\nTIMEDELAY_MOD.2 PORT_SIGNAL_OUT CH2_WAVES\nMOD_ENG MOD_ON TIMEDELAY_MOD.2
         TIMEDELAY_MOD TD_PARAM 10\nMOD_ENG MOD_ON TIMEDELAY_MOD",
    );
    for tick in 0..100_u8 {
        match tick {
            42 => bench.rows("MOD_ENG MOD_OFF TIMEDELAY_MOD.2"),
            57 => bench.rows("MOD_ENG MOD_ON TIMEDELAY_MOD.2"),
            _ => {}
        }
        bench.tick(&[f32::from(tick), -1.0]);
        assert_eq!(bench.signal("CH1_TD_WAVES")[0], f32::from(tick.saturating_sub(10)), "{tick}");
    }
}

/// The waveforms in double precision; `p` in periods.
fn ideal(form: &str, p: f64) -> f64 {
    let phase = p.fract();
    match form {
        "CONSTANT" => 1.0,
        "STEP" => f64::from(u8::from(p >= 1.0)),
        "SINE" => (std::f64::consts::TAU * p).sin(),
        "SQUARE" => 1.0_f64.copysign(0.5 - phase),
        _ => 1.0 - (4.0 * (phase + 0.25).fract() - 2.0).abs(),
    }
}

#[test]
fn generated_signals_have_their_form_amplitude_offset_and_frequency() {
    for form in ["CONSTANT", "STEP", "SINE", "SQUARE", "TRIANGLE"] {
        for frequency in [0.01, 0.37, 10.0, 170.0] {
            let rows = format!(
                "SIGGEN_MOD FORM {form}\nSIGGEN_MOD AMPLITUDE 2\nSIGGEN_MOD OFFSET 0.5\n\
                 SIGGEN_MOD FREQUENCY {frequency}\nSIGGEN_MOD STEP_TIME {}\nMOD_ENG MOD_ON SIGGEN_MOD",
                1.0 / frequency
            );
            let mut generator = Alone::new(1, &[], "SIGNAL_OUT", &rows);
            let per_tick = f64::from(frequency as f32 * H);
            for tick in 0..100_000 {
                let found = f64::from(generator.step(&[]));
                let p = per_tick * f64::from(tick);
                // A jump may occur in the tick before or after.
                let is_at_edge = (p * 2.0 - (p * 2.0).round()).abs() < 1e-4;
                if !is_at_edge || matches!(form, "SINE" | "TRIANGLE") {
                    assert_close(found, 0.5 + 2.0 * ideal(form, p), 0.004);
                }
            }
        }
    }
}

#[test]
fn a_slow_signal_keeps_its_frequency() {
    let rows = "SIGGEN_MOD FORM TRIANGLE\nSIGGEN_MOD AMPLITUDE 1\nSIGGEN_MOD FREQUENCY 0.0001
        MOD_ENG MOD_ON SIGGEN_MOD";
    let mut generator = Alone::new(1, &[], "SIGNAL_OUT", rows);
    // A tenth of a period per million ticks; at 7 500 s it rises from its minimum.
    let mut found = 0.0;
    for tick in 0..9_000_000 {
        generator.bench.dimsart.tick(&[], &mut []);
        if tick % 1_000_000 == 0 {
            found = generator.bench.signal("SIGNAL_OUT")[0];
            assert_close(found, ideal("TRIANGLE", f64::from(tick) * 1e-7), 1e-4);
        }
    }
    assert_close(found, -0.8, 1e-4);
}

#[test]
fn a_generator_never_waits_however_long_the_sample_period() {
    use dimsart_core::{AxisKind, DeviceDescriptor, Dimsart};
    let device = DeviceDescriptor::new("slow", &[AxisKind::Linear], 1e9, &[], &[]).unwrap();
    let mut bench: Bench =
        Bench { dimsart: Dimsart::new(ProvidedMemory::leak_default(), device, ALL).unwrap() };
    bench.run(
        "SIGGEN_MOD FORM STEP\nSIGGEN_MOD AMPLITUDE 1\nSIGGEN_MOD FREQUENCY 10000\nMOD_ENG MOD_ON SIGGEN_MOD",
    );
    for _ in 0..5 {
        bench.tick(&[]);
        assert_eq!(bench.signal("SIGNAL_OUT"), [1.0], "its step is closer to the first tick");
    }
}

#[test]
fn a_step_comes_in_the_tick_nearest_to_its_time_and_again_after_a_reset() {
    for (time_s, step_tick) in [(0.0, 0), (0.001, 1), (0.25, 250), (0.2504, 250), (0.2506, 251)] {
        let rows = format!(
            "SIGGEN_MOD FORM STEP\nSIGGEN_MOD AMPLITUDE 2\nSIGGEN_MOD OFFSET 0.5\nSIGGEN_MOD STEP_TIME {time_s}\n\
             MOD_ENG MOD_ON SIGGEN_MOD"
        );
        let mut generator = Alone::new(1, &[], "SIGNAL_OUT", &rows);
        for _ in 0..2 {
            for tick in 0..300 {
                let expected = if tick < step_tick { 0.5 } else { 2.5 };
                assert_close(f64::from(generator.step(&[])), expected, 1e-9);
            }
            generator.bench.rows("MOD_ENG RESET");
        }
    }
}

#[test]
fn a_recorder_keeps_the_last_rows_of_every_few_ticks() {
    let mut bench = Bench::of(2, &[types::FORCE], &[]);
    bench.run(
        "RECORDER_MOD LENGTH 4\nRECORDER_MOD EVERY 3\nRECORDER_MOD PORT_SIGNAL_IN FORCE\n\
         MOD_ENG MOD_ON RECORDER_MOD",
    );
    let recorder = ALL.module("RECORDER_MOD").unwrap();
    let mut kept = vec![0.0; 8];
    let mut rows = 0;
    for tick in 0..60_u8 {
        match tick {
            30 => bench.rows("RECORDER_MOD RECORD OFF"),
            45 => bench.rows("RECORDER_MOD RECORD ON"),
            _ => {}
        }
        let row = [f32::from(tick), -f32::from(tick)];
        bench.tick(&row);
        if tick % 3 == 0 && !(30..45).contains(&tick) {
            let place = 2 * (rows % 4);
            kept[place..place + 2].copy_from_slice(&row);
            rows += 1;
        }
        let found: Vec<f32> = bench
            .dimsart
            .engine()
            .memory(recorder)
            .unwrap()
            .iter()
            .map(|word| f32::from_bits(*word))
            .collect();
        assert_eq!(found, kept, "{tick}");
        assert_eq!(bench.bits("RECORDED_ROWS"), [u32::try_from(rows).unwrap()]);
    }
}

/// Compared with a plain list of rows: the edge of the second word, in any tick.
#[test]
fn a_recorder_keeps_the_rows_around_an_edge() {
    let recorder = ALL.module("RECORDER_MOD").unwrap();
    for (trigger, sign) in [("RISING", 1.0), ("FALLING", -1.0)] {
        for (every, after, edge) in [(1, 0, 6_u8), (1, 3, 25), (1, 5, 7), (3, 2, 40), (4, 5, 41)] {
            let mut bench = Bench::of(2, &[types::FORCE], &[]);
            bench.run(&format!(
                "RECORDER_MOD LENGTH 6\nRECORDER_MOD EVERY {every}\nRECORDER_MOD TRIGGER {trigger}\n\
                 RECORDER_MOD LEVEL {}\nRECORDER_MOD WORD 1\nRECORDER_MOD AFTER {after}\n\
                 RECORDER_MOD PORT_SIGNAL_IN FORCE\nMOD_ENG MOD_ON RECORDER_MOD",
                0.5 * sign
            ));
            // Already above the level at first: not an edge.
            let level = |tick: u8| if (5..edge).contains(&tick) { 0.5 * sign } else { sign };
            let row = |tick: u8| [f32::from(tick), level(tick)];
            for _ in 0..2 {
                let (mut taken, mut caught, mut left) = (Vec::new(), 0, None);
                for tick in 0..100_u8 {
                    bench.tick(&row(tick));
                    if tick == edge {
                        (caught, left) = (taken.len() + 1, Some(after + 1));
                    }
                    if tick % every == 0 && left != Some(0) {
                        taken.push(row(tick));
                        left = left.map(|left: usize| left - 1);
                    }
                    let expected = u32::try_from(taken.len()).unwrap();
                    assert_eq!(
                        bench.bits("RECORDED_ROWS"),
                        [expected],
                        "{trigger} {every} {after} {edge} {tick}"
                    );
                }
                assert_eq!(taken.len(), caught + after);
                let memory = bench.dimsart.engine().memory(recorder).unwrap();
                for (number, row) in taken.iter().enumerate().rev().take(6) {
                    let place = 2 * (number % 6);
                    assert_eq!(memory[place..place + 2], row.map(f32::to_bits));
                }
                assert!(taken[caught - 1][0] >= f32::from(edge) && taken[caught - 1][1] == sign);
                // A reset arms it again.
                bench.rows("MOD_ENG MOD_RESET RECORDER_MOD");
            }
        }
    }
}

/// Every bit of every signal of the bilateral scheme, with occasional packets.
fn bits_of_a_run(form: &str) -> Vec<u32> {
    let mut bench = Bench::of(3, &[types::POSITION], &[types::DES_FORCE]);
    let text = include_str!("../../../schemes/bilateral.scheme");
    bench.rows(&format!("{form}\nCOMM_RXMOD STALE LIMITED"));
    let text = text.replace("CRX_CHANNEL     2", "CRX_CHANNEL     1");
    assert_eq!(scheme::load(&text, "master", &["master", "slave"], &mut bench.dimsart, |_| {}), 0);
    let mut random = Pcg32::seed_from_u64(5);
    let mut bits = Vec::new();
    let mut line = std::collections::VecDeque::new();
    for _ in 0..10_000 {
        let measured: Vec<f32> = (0..3).map(|_| (random.next_u32() >> 8) as f32 * 1e-9).collect();
        bench.tick(&measured);
        bits.extend(
            bench
                .dimsart
                .engine()
                .data_base()
                .signals()
                .flat_map(|(slot, _)| bench.dimsart.engine().data_base().words(slot).to_vec()),
        );
        line.push_back(bench.dimsart.take_outgoing(0).unwrap().to_bytes());
        if line.len() > 8 {
            let packet = line.pop_front().unwrap();
            if random.next_u32() % 4 != 0 {
                bench.dimsart.receive(0, &packet).unwrap();
            }
        }
    }
    bits
}

#[test]
fn the_same_commands_and_inputs_give_the_same_bits() {
    for form in ["WTRANSF_MOD FORM SPLIT", "WTRANSF_MOD FORM IMPLICIT\nPDCTRL_MOD LAW_OUTPUT ON"] {
        let first = bits_of_a_run(form);
        assert!(first.len() > 10_000 * 20);
        assert!(first == bits_of_a_run(form), "{form}");
    }
}
