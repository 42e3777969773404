//! The image, or the reason to skip.

use std::env;
use std::io::Write;
use std::path::PathBuf;
use std::sync::Once;

use boards::BOARDS;
use dimsart::cycles::Firmware;
use dimsart_core::ModuleList;
use dimsart_core::modules::Standard;
use hil_sim::emulated::FOLDER_VARIABLE;

/// The board whose image is looked at where there are several.
pub(crate) const BOARD: &str = "nucleo-g474re";

const SMALL_BOARD: &str = "b-g431b-esc1";

/// `full` where `cargo xtask long` runs the test, `short` elsewhere.
pub(crate) fn length(short: u64, full: u64) -> u64 {
    if env::var_os("DIMSART_LONG").is_some() { full } else { short }
}

/// The kinds that the board's image has.
pub(crate) fn kinds() -> usize {
    let board = BOARDS.iter().find(|board| board.name == BOARD).unwrap();
    Standard::KINDS.iter().filter(|kind| board.has_group(kind.group.text())).count()
}

/// The image to be looked at; none, after a line that says so, where there is none.
pub(crate) fn firmware() -> Option<Firmware> {
    let is_complete = env::var_os(FOLDER_VARIABLE).is_some();
    match Firmware::find(None, is_complete.then_some(BOARD)) {
        Ok(firmware) => Some(firmware),
        Err(reason) if is_complete => panic!("{reason}"),
        Err(reason) => {
            static SAID: Once = Once::new();
            SAID.call_once(|| {
                let line = format!("no cycles were counted: {reason}; run `cargo xtask test`\n");
                std::io::stderr().write_all(line.as_bytes()).unwrap();
            });
            None
        }
    }
}

/// A variant of the board's image; none, after a line that says so, where no images are.
pub(crate) fn variant(name: &str) -> Option<Firmware> {
    let folder = env::var_os(FOLDER_VARIABLE);
    let is_required = folder.is_some();
    let folder = folder.map_or_else(|| PathBuf::from("../target/images"), PathBuf::from);
    let file = folder.join(format!("{BOARD}-{name}"));
    if !file.exists() && !is_required {
        let line = format!("no cycles were counted: no image {}; run `cargo xtask test`\n", file.display());
        std::io::stderr().write_all(line.as_bytes()).unwrap();
        return None;
    }
    Some(Firmware::find(Some(&file), None).unwrap())
}

/// The same, unless it is of a board that has no memory for a scheme with every module.
pub(crate) fn firmware_for_every_module() -> Option<Firmware> {
    let firmware = firmware()?;
    if firmware.name.contains(SMALL_BOARD) {
        let line = format!(
            "not every module was run: {SMALL_BOARD} has no memory for that; run `cargo board {BOARD}`\n"
        );
        std::io::stderr().write_all(line.as_bytes()).unwrap();
        return None;
    }
    Some(firmware)
}
