//! Compares the cycle table with the manuals, and checks that every change of a row by one cycle is detected.

use cycles::sequences::sequences;
use cycles::timing::{Column, Profile, Row, Timing};

/// Rows without a sequence: typical, upper. Interrupts occur outside of sequences, and a trap ends a sequence.
const ALONE: [(Row, u32, u32); 5] = [
    // The minimum of any instruction.
    (Row::Trap, 1, 1),
    // TRM 3.9: 12 cycles to the handler with zero-wait memory, 6 from one handler to the next.
    (Row::ExceptionEntry, 12, 12),
    (Row::TailChaining, 6, 6),
    // Restoring the registers takes 10 cycles; up to 12 with the refill.
    (Row::ExceptionExit, 10, 12),
    // 17 words: S0 to S15 and FPSCR.
    (Row::LazyStacking, 0, 17),
];

/// Differences between the model and the manuals.
fn differences(timing: Timing, column: Column) -> Vec<String> {
    let sequences = sequences().filter_map(|sequence| {
        let expected = if column == Column::Likely { sequence.typical } else { sequence.upper };
        let cycles = sequence.count(timing).map(|count| count.cycles);
        (cycles != Ok(u64::from(expected)))
            .then(|| format!("{}: {cycles:?}, not {expected}: {}", sequence.row, sequence.text))
    });
    let alone = ALONE.iter().filter_map(|(row, typical, upper)| {
        let expected = if column == Column::Likely { *typical } else { *upper };
        let cycles = timing.row(*row);
        (cycles != expected).then(|| format!("{row:?}: {cycles}, not {expected}"))
    });
    sequences.chain(alone).collect()
}

#[test]
fn the_model_matches_the_manuals() {
    for column in [Column::Likely, Column::Upper] {
        let differences = differences(Timing::new(Profile::ZeroWait, column), column);
        assert!(differences.is_empty(), "{column:?}:\n{}", differences.join("\n"));
    }
}

#[test]
fn an_off_by_one_row_is_detected() {
    for column in [Column::Likely, Column::Upper] {
        for row in Row::ALL {
            let right = row.cost().of(column);
            for wrong in [right.checked_add(1), right.checked_sub(1)].into_iter().flatten() {
                let timing = Timing::new(Profile::ZeroWait, column).with_row(*row, wrong);
                assert!(
                    !differences(timing, column).is_empty(),
                    "{row:?} = {wrong} is not detected in {column:?}"
                );
            }
        }
    }
}

#[test]
fn every_row_has_its_sequence() {
    for row in Row::ALL {
        let name = format!("{row:?}");
        let is_alone = ALONE.iter().any(|(alone, ..)| alone == row);
        assert!(is_alone || sequences().any(|sequence| sequence.row == name), "{name} has no sequence");
    }
    let named = |name| Row::ALL.iter().any(|row| format!("{row:?}") == name);
    assert!(sequences().all(|sequence| named(sequence.row)));
}

#[test]
fn the_sequences_match_their_text() {
    for sequence in sequences() {
        let instructions = sequence.instructions().unwrap();
        let text: Vec<String> = instructions.iter().map(ToString::to_string).collect();
        assert_eq!(text.join("; "), sequence.text);
    }
}
