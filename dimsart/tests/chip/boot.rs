//! A board boots and ticks according to the chip's rules.

use chips::{BOARDS, Bench, Board};
use test_requirements::length;

use crate::common::{Shared, image};

/// Maximum time with disabled interrupts, `us`.
const LONGEST_MASKED_US: f64 = 25.0;

#[test]
fn boards_tick_by_the_rules() {
    let ticks = length(2_000_u32, 10_000);
    for board in BOARDS {
        let Some(shared) = Shared::start(board.name) else { return };
        // Time of the start.
        shared.run_for(0.2);
        let (at_start, place) = shared.bench().processor.take_max_masked_cycles();
        println!("{}: at the start interrupts are masked for {at_start} cycles, until {place}", board.name);
        shared.run_for(1e-3 * f64::from(ticks));
        shared.assert_sound();
        let mut bench = shared.bench();
        assert_eq!(bench.chip().resets(), []);
        let (masked, place) = bench.processor.take_max_masked_cycles();
        let hz = bench.chip().clock().hz();
        let masked_us = masked as f64 / hz * 1e6;
        println!("{}: then for {masked_us:.1} us, until {place}", board.name);
        assert!(masked_us < LONGEST_MASKED_US, "{masked_us} us until {place}");
        drop(bench);
        let overview = shared.identify().overview().unwrap();
        let timing = overview.status.timing.unwrap();
        assert!(timing.ticks >= ticks, "{timing:?}");
        assert_eq!((timing.late, timing.overruns), (0, 0), "{timing:?}");
    }
}

#[test]
fn variants_tick_by_the_rules() {
    let board = Board::find("nucleo-g474re").unwrap();
    for variant in ["classic-can", "uart-link", "auth", "moteus"] {
        let name = format!("{}-{variant}", board.name);
        let Some(image) = image(&name) else { return };
        let mut bench = Bench::new(board, image).unwrap();
        bench.run_for(0.5).unwrap();
        assert_eq!(bench.violations(), [] as [&str; 0], "{name}");
        assert_eq!(bench.processor.faults(), [], "{name}");
        assert_eq!(bench.chip().resets(), [], "{name}");
        assert!(!bench.take_received().is_empty(), "{name}: no output");
    }
}
