//! `cargo xtask step cycle-table BOARD`: checks the cycle table on a board's chip; on the emulated board, its sequences.

use boards::BOARDS;

use crate::boards::build_program;
use crate::emulator::emulate;
use crate::flash::run_on_chip;
use crate::shell::Outcome;
use crate::toolchain::Toolchain;

/// Builds the image, runs it on the board and shows its table; fails where the chip or the emulator differs.
pub(crate) fn cycle_table(name: &str) -> Outcome {
    let board = BOARDS.iter().find(|board| board.name == name).ok_or_else(|| {
        let names: Vec<&str> = BOARDS.iter().map(|board| board.name).collect();
        format!("{name} is no board; boards: {}", names.join(", "))
    })?;
    let image = build_program(Toolchain::set_up()?, board, "cycle-table")?;
    match board.tooling.chip {
        Some(chip) => run_on_chip(chip, &image),
        None => {
            emulate(&image).map_err(|error| format!("{error}: a sequence is not what the crate cycles says"))
        }
    }
}
