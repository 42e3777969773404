//! The image, or the reason to skip.

use std::env;

use boards::BOARDS;
use dimsart::cycles::Firmware;
use dimsart_modules::{ALL, group_of};
use hil_sim::emulated::IMAGE_FOLDER_VARIABLE;
use test_requirements::{image, missing};

/// Default board.
pub(crate) const BOARD: &str = "nucleo-g474re";

const SMALL_BOARD: &str = "b-g431b-esc1";

/// Module kinds of the board's image.
pub(crate) fn kinds() -> usize {
    let board = BOARDS.iter().find(|board| board.name == BOARD).unwrap();
    ALL.list().iter().filter(|kind| group_of(kind.id).is_some_and(|group| board.has_group(group))).count()
}

/// The board's image, or the last built one without a folder of images.
pub(crate) fn firmware() -> Option<Firmware> {
    let is_complete = env::var_os(IMAGE_FOLDER_VARIABLE).is_some();
    let found = Firmware::find(None, is_complete.then_some(BOARD));
    found.map_err(|reason| missing(&reason.to_string())).ok()
}

/// A variant of the board's image.
pub(crate) fn variant(name: &str) -> Option<Firmware> {
    Some(Firmware::find(Some(&image(&format!("{BOARD}-{name}"))?), None).unwrap())
}

/// The same, unless the board lacks memory for a scheme with all modules.
pub(crate) fn firmware_for_every_module() -> Option<Firmware> {
    let firmware = firmware()?;
    if firmware.name.contains(SMALL_BOARD) {
        missing(&format!("skipped: {SMALL_BOARD} has not enough memory for all modules; use {BOARD}"));
        return None;
    }
    Some(firmware)
}
