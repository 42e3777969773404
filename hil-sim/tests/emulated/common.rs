//! Image and emulator, or the reason to skip.

use std::env;
use std::process::{Command, Stdio};

use hil_sim::emulated::{BUILD, FOLDER_VARIABLE, Image};

/// The image to be run; none, after a line that says so, where there is no image or no emulator.
pub(crate) fn image() -> Option<Image> {
    let emulator = Command::new("qemu-system-arm").arg("--version").stdout(Stdio::null()).status();
    let found = match emulator {
        Ok(_) => Image::find(None).map_err(|error| error.to_string()),
        Err(error) => Err(format!("qemu-system-arm: {error}")),
    };
    match found {
        Ok(image) => Some(image),
        Err(reason) if env::var_os(FOLDER_VARIABLE).is_some() => panic!("{reason}"),
        Err(reason) => {
            eprintln!(
                "not run: firmware on the emulated board; install qemu-system-arm, `{BUILD}` ({reason})"
            );
            None
        }
    }
}
