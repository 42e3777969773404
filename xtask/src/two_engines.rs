//! `cargo xtask step two-engines`: runs two engines on the emulated board, one interrupting the other.

use boards::BOARDS;

use crate::boards::build_program;
use crate::emulator::emulate;
use crate::shell::Outcome;
use crate::toolchain::Toolchain;

/// Builds and runs the program; fails if a transferred word is wrong.
pub(crate) fn run() -> Outcome {
    let board = BOARDS.iter().find(|board| board.tooling.chip.is_none()).ok_or("no emulated board")?;
    emulate(&build_program(Toolchain::set_up()?, board, "two-engines")?)
}
