//! The image, or the reason to skip.

use std::env;
use std::io::Write;
use std::sync::Once;

use hil_sim::cycles::Firmware;
use hil_sim::emulated::FOLDER_VARIABLE;

/// The board whose image is looked at where there are several.
pub(crate) const BOARD: &str = "nucleo-g474re";

/// `full` where `cargo xtask long` runs the test, `short` elsewhere.
pub(crate) fn length(short: u64, full: u64) -> u64 {
    if env::var_os("DIMSART_LONG").is_some() { full } else { short }
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
