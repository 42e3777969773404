//! Register writes of a board until it ticks: a file for review against the reference manual.

use std::fs;
use std::path::Path;

use chips::BOARDS;

use crate::common::Shared;

/// Start of the watchdog, and of the converters of a board with a drive: the end of a board's start.
const STARTED: [&str; 2] = ["IWDG_KR          0x0000cccc", "ADC1_CR          0x10000009"];
/// Start of every period of a current loop, followed by switching the bridge off: their position between the lines of the
/// start depends on timing.
const PERIOD: &str = "ADC1_ISR ";
/// RAM addresses are chosen by the linker.
const DMA_ADDRESSES: &str = "_CMAR";

#[test]
fn a_board_writes_what_was_reviewed() {
    for board in BOARDS {
        let Some(shared) = Shared::start(board.name) else { return };
        shared.run_for(0.05);
        let mut bench = shared.bench();
        let lines = bench.chip().journal.lines();
        let ends = STARTED.map(|started| lines.iter().position(|line| line == started));
        let end = ends.into_iter().flatten().max().unwrap();
        let mut written = String::new();
        let mut of_period = 0;
        for line in &lines[..=end] {
            of_period = if line.starts_with(PERIOD) { 2 } else { of_period };
            if of_period > 0 {
                of_period -= 1;
                continue;
            }
            let register = line.split(' ').next().unwrap();
            let line = if register.contains(DMA_ADDRESSES) { register } else { line };
            // The number of equal writes until a peripheral is ready depends on the timing of the code.
            if written.lines().next_back() == Some(line) {
                continue;
            }
            written.push_str(line);
            written.push('\n');
        }
        let name = format!("{}.txt", board.name);
        let reviewed = Path::new("../boards/boot").join(&name);
        let new = Path::new(env!("CARGO_TARGET_TMPDIR")).join(&name);
        fs::write(&new, &written).unwrap();
        let wanted = fs::read_to_string(&reviewed).unwrap_or_default();
        let first = written.lines().zip(wanted.lines()).position(|(new, old)| new != old);
        assert!(
            written == wanted,
            "{}: writes differ from the reviewed ones from line {} on: review `diff {} {}`, then copy the new file there",
            board.name,
            first.unwrap_or(wanted.lines().count()) + 1,
            reviewed.display(),
            new.display(),
        );
    }
}
