//! Selection, logic, sequences and tables: properties without an external reference.
#![expect(clippy::float_cmp, reason = "what is passed on is the same")]

use dimsart_core::types;

use crate::common::{Alone, Bench};

#[test]
fn a_demultiplexer_keeps_what_it_passed_on_where_it_is_to() {
    let rows = "DEMUX_MOD SELECT_BY CONDITION\nDEMUX_MOD HOLD ON\nMOD_ENG MOD_ON DEMUX_MOD";
    let mut module = Alone::new(1, &[types::SIGNAL, types::CONDITION], "SIGNAL_OUT", rows);
    module.step(&[3.0, 0.0]);
    assert_eq!(module.step(&[4.0, 1.0]), 3.0);
    assert_eq!(module.bench.signal("SIGNAL_OUT.2"), [4.0]);
}

#[test]
fn a_selection_beyond_the_last_signal_is_the_last_one() {
    let rows =
        "MUX_MOD PORT_IN1 FORCE\nMUX_MOD PORT_IN2 FEED_FORCE\nMUX_MOD SELECT 3\nMOD_ENG MOD_ON MUX_MOD";
    let mut module = Alone::new(1, &[types::FORCE, types::FEED_FORCE], "SIGNAL_OUT", rows);
    assert_eq!(module.step(&[1.0, 2.0]), 2.0);
    module.bench.rows("MUX_MOD SELECT 0");
    assert_eq!(module.step(&[1.0, 2.0]), 1.0);
}

#[test]
fn a_comparator_can_look_below_and_leave_the_sign_out() {
    let rows =
        "COMPARE_MOD LEVEL 1\nCOMPARE_MOD SIDE BELOW\nCOMPARE_MOD MAGNITUDE ON\nMOD_ENG MOD_ON COMPARE_MOD";
    let mut module = Alone::new(1, &[types::SIGNAL], "CONDITION", rows);
    assert_eq!([-2.0, -0.5, 0.5, 2.0].map(|x| module.step(&[x])), [0.0, 1.0, 1.0, 0.0]);
}

#[test]
fn the_reset_of_a_latch_wins() {
    let rows = "LOGIC_MOD FUNCTION LATCH\nLOGIC_MOD PORT_B DRIVE_FAULT\nMOD_ENG MOD_ON LOGIC_MOD";
    let mut module = Alone::new(1, &[types::CONDITION, types::DRIVE_FAULT], "CONDITION.3", rows);
    let inputs = [[0.0, 0.0], [1.0, 0.0], [0.0, 0.0], [1.0, 1.0], [0.0, 0.0]];
    assert_eq!(inputs.map(|both| module.step(&both)), [0.0, 1.0, 1.0, 0.0, 0.0]);
}

#[test]
fn a_table_jumps_where_two_points_have_the_same_place() {
    let rows = "TABLE_MOD COUNT 3\nTABLE_MOD X[0][1] 1\nTABLE_MOD X[0][2] 1\nTABLE_MOD Y[0][1] 2\nTABLE_MOD Y[0][2] 5
        MOD_ENG MOD_ON TABLE_MOD";
    let mut module = Alone::new(1, &[types::SIGNAL], "SIGNAL_OUT", rows);
    assert_eq!([0.5, 1.0, 9.0].map(|x| module.step(&[x])), [1.0, 5.0, 5.0]);
}

/// Outputs 2 for 3 ticks after the condition.
#[test]
fn a_sequence_begins_anew_after_a_reset() {
    let rows = "SEQUENCE_MOD IF_A[0][0] 1\nSEQUENCE_MOD OUTPUT[0][1] 2\nSEQUENCE_MOD AFTER[0][1] 0.003
        SEQUENCE_MOD THEN[0][1] 0\nSEQUENCE_MOD PORT_B DRIVE_FAULT\nMOD_ENG MOD_ON SEQUENCE_MOD";
    let mut module = Alone::new(1, &[types::CONDITION, types::DRIVE_FAULT], "SIGNAL_OUT", rows);
    let outputs = [0.0, 1.0, 0.0, 0.0, 0.0].map(|a| module.step(&[a, 0.0]));
    assert_eq!(outputs, [0.0, 2.0, 2.0, 2.0, 0.0]);
    module.step(&[1.0, 0.0]);
    module.bench.rows("MOD_ENG RESET");
    assert_eq!(module.step(&[0.0, 0.0]), 0.0);
    assert_eq!(module.bench.signal("STATE"), [0.0]);
}

#[test]
fn a_recorder_keeps_the_rows_around_a_condition() {
    let rows = "RECORDER_MOD PORT_SIGNAL_IN POSITION\nRECORDER_MOD LENGTH 6\nRECORDER_MOD AFTER 2
        RECORDER_MOD TRIGGER CONDITION\nMOD_ENG MOD_ON RECORDER_MOD";
    // From tick 10 on, and from the start on: the latter is not an edge, and matters only if requested.
    for (more, from, taken) in [("", 10, 13), ("", 0, 100), ("\nRECORDER_MOD AT_ONCE ON", 0, 3)] {
        let mut bench = Bench::of(1, &[types::POSITION, types::CONDITION], &[]);
        bench.run(&format!("{rows}{more}"));
        for tick in 0..100_u8 {
            bench.tick(&[f32::from(tick), f32::from(u8::from(tick >= from))]);
        }
        assert_eq!(bench.bits("RECORDED_ROWS"), [taken], "{more} {from}");
    }
}
