//! A board boots and ticks by the chip's rules.

use chips::BOARDS;

use crate::common::{bench, violations};

#[test]
fn boards_tick_without_a_violation() {
    for board in BOARDS {
        let Some(mut bench) = bench(board.name) else { return };
        bench.run_for(10.2).unwrap();
        assert_eq!(violations(&bench), [] as [&str; 0], "{}", board.name);
        assert_eq!(bench.processor.faults(), []);
        assert_eq!(bench.chip().resets(), []);
    }
}
