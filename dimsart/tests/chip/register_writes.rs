//! What a board writes to its registers until it ticks: a file to review, line by line, against the reference manual.

use std::fs;
use std::path::Path;

use chips::BOARDS;

use crate::common::Shared;

/// What the watchdog is started by, and the converters of a board with a drive: the last of a board's start.
const STARTED: [&str; 2] = ["IWDG_KR          0x0000cccc", "ADC1_CR          0x10000009"];
/// What every period of a current loop begins with, and behind it its switching the bridge off: where they come between the
/// lines of the start hangs on the time that this takes.
const PERIOD: &str = "ADC1_ISR ";
/// Addresses of RAM are the linker's.
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
            // How often the same is written until a peripheral is ready hangs on the time of the code.
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
            "{}: other writes than reviewed, from line {} on: look at `diff {} {}`, then copy the new one there",
            board.name,
            first.unwrap_or(wanted.lines().count()) + 1,
            reviewed.display(),
            new.display(),
        );
    }
}
