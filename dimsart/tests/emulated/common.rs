//! Image and emulator, or the reason to skip.

use std::env;
use std::io::Write;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::sync::Once;

use hil_sim::emulated::{BOARD, BUILD, FOLDER_VARIABLE, Image};

/// `full` where `cargo xtask long` runs the test, `short` elsewhere.
pub(crate) fn length(short: usize, full: usize) -> usize {
    if env::var_os("DIMSART_LONG").is_some() { full } else { short }
}

/// The image whose tick comes from a timer, beside the other one; none, after a line that says so, without it.
pub(crate) fn timer_image() -> Option<PathBuf> {
    variant("timer-tick", "the timer's tick")
}

/// The image whose tick comes from a timer, with authentication.
pub(crate) fn timer_key_image() -> Option<PathBuf> {
    variant("auth,timer-tick", "authentication")
}

/// As [`timer_image`], the one that measures itself.
pub(crate) fn measuring_image() -> Option<PathBuf> {
    variant("timer-tick,measure", "measuring")
}

fn variant(features: &str, what: &str) -> Option<PathBuf> {
    let Some(folder) = env::var_os(FOLDER_VARIABLE).map(PathBuf::from) else {
        say_once(what, &format!("{FOLDER_VARIABLE} names no folder of images"));
        return None;
    };
    let path = folder.join(format!("{BOARD}-{}", features.replace(',', "-")));
    assert!(path.is_file(), "no image {}: `{BUILD} --features {features}` builds it", path.display());
    Some(path)
}

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
            say_once("the firmware", &reason);
            None
        }
    }
}

/// The image with authentication, beside the other one; none, after a line that says so, without it.
pub(crate) fn key_image() -> Option<Image> {
    image()?;
    let path = variant("auth", "authentication")?;
    Some(Image::find(Some(&path)).unwrap())
}

/// Past the capture of what passing tests print; one line, however many tests it is true of.
fn say_once(what: &str, reason: &str) {
    static SAID: Once = Once::new();
    SAID.call_once(|| {
        let line = format!("{what} was not run on the emulated board: {reason}; run `cargo xtask test`\n");
        std::io::stderr().write_all(line.as_bytes()).unwrap();
    });
}
