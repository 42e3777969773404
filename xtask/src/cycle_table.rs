//! `cargo xtask step cycle-table BOARD`: checks the cycle table on a board's chip; on the emulated board, the
//! sequences.

use boards::BOARDS;

use crate::boards::build_program;
use crate::emulator::emulate;
use crate::flash::run_on_chip;
use crate::shell::Outcome;
use crate::toolchain::Toolchain;

/// Builds the image, runs it and prints its table; fails if the chip or emulator differs.
pub(crate) fn cycle_table(name: &str) -> Outcome {
    let board = BOARDS.iter().find(|board| board.name == name).ok_or_else(|| {
        let names: Vec<&str> = BOARDS.iter().map(|board| board.name).collect();
        format!("unknown board {name}; boards: {}", names.join(", "))
    })?;
    let image = build_program(Toolchain::set_up()?, board, "cycle-table")?;
    match board.tooling.chip {
        Some(chip) => run_on_chip(chip, &image),
        None => {
            emulate(&image).map_err(|error| format!("{error}: a sequence differs from the crate `cycles`"))
        }
    }
}
