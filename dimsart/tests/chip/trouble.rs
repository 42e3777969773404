//! Faults in the surroundings of a board.

use chips::BOARDS;
use cycles::processor::{Reset, State};

use crate::common::Shared;

/// Mode of a buffer that blocks until it is read, in the control block of RTT.
const RTT_BLOCKS: u32 = 2;
/// Offsets in the first buffer: size, write and read position, mode.
const RTT_SIZE: u32 = 32;
const RTT_WRITE: u32 = 36;
const RTT_READ: u32 = 40;
const RTT_MODE: u32 = 44;

#[test]
fn a_probe_that_left_in_blocking_mode_holds_nothing_up() {
    for board in BOARDS {
        let Some(shared) = Shared::start(board.name) else { return };
        shared.run_for(0.1);
        let mut bench = shared.bench();
        let block = bench.processor.image().symbols.get("_SEGGER_RTT").copied().unwrap();
        let [size, written] = [RTT_SIZE, RTT_WRITE].map(|at| bench.processor.read_word(block + at).unwrap());
        // Full and not read.
        bench.write_word(block + RTT_READ, (written + 1) % size).unwrap();
        bench.write_word(block + RTT_MODE, RTT_BLOCKS).unwrap();
        drop(bench);
        // One log line per second.
        shared.run_for(2.5);
        shared.assert_sound();
        assert_eq!(shared.bench().chip().resets(), [], "{}", board.name);
        let timing = shared.identify().overview().unwrap().status.timing.unwrap();
        assert_eq!((timing.late, timing.overruns), (0, 0), "{timing:?}");
    }
}

#[test]
fn a_board_whose_crystal_does_not_swing_starts_over_with_its_outputs_off() {
    for board in BOARDS {
        let Some(shared) = Shared::start(board.name) else { return };
        shared.bench().chip().set_crystal(None);
        for _ in 0..200 {
            shared.run_for(0.01);
            assert_eq!(shared.bench().chip().pulses(), None);
        }
        let mut bench = shared.bench();
        let resets = bench.chip().resets();
        assert!(resets.len() > 1 && resets.iter().all(|reset| *reset == Reset::Program), "{resets:?}");
        // The connection is restored.
        let hz = board.crystal_hz;
        bench.chip().set_crystal(Some(hz));
        drop(bench);
        shared.run_for(1.0);
        shared.identify();
    }
}

#[test]
fn a_stack_that_overflows_starts_the_board_over_which_then_says_so() {
    for board in BOARDS {
        let Some(shared) = Shared::start(board.name) else { return };
        shared.run_for(0.1);
        // While it sleeps, no call returns to the new address.
        while shared.bench().processor.state() != State::Sleeping {
            shared.run_for(1e-6);
        }
        {
            let mut bench = shared.bench();
            assert_eq!(bench.processor.faults(), []);
            let end = bench.processor.image().symbols.get("_stack_end").copied().unwrap();
            // The next interrupt needs more stack than is left.
            bench.processor.registers.core[13] = end + 16;
        }
        shared.run_for(0.3);
        let why = shared.bench().processor.faults().first().map(|fault| format!("{:?}", fault.cause));
        assert_eq!(shared.bench().chip().resets(), [Reset::Program], "{}: {why:?}", board.name);
        let events = shared.identify().events().unwrap().to_string();
        println!("{}: {why:?}\n{events}", board.name);
        assert!(events.contains("exception"), "{events}");
    }
}
