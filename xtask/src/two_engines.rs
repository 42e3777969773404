//! `cargo xtask step two-engines`: two engines on the emulated board, one of which interrupts the other.

use boards::BOARDS;

use crate::boards::build_program;
use crate::emulator::emulate;
use crate::shell::Outcome;
use crate::toolchain::Toolchain;

/// Builds the program and runs it; fails where something that crosses is not what it should be.
pub(crate) fn run() -> Outcome {
    let board = BOARDS.iter().find(|board| board.tooling.chip.is_none()).ok_or("no board is emulated")?;
    emulate(&build_program(Toolchain::set_up()?, board, "two-engines")?)
}
