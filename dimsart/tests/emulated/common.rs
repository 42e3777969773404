//! Image and emulator, or the reason to skip.

use std::path::PathBuf;

use hil_sim::emulated::{BOARD, Image};
use test_requirements::{emulator, missing};

/// The image with the tick from a timer.
pub(crate) fn timer_image() -> Option<PathBuf> {
    variant("timer-tick")
}

/// The image with the tick from a timer and authentication.
pub(crate) fn timer_key_image() -> Option<PathBuf> {
    variant("auth-timer-tick")
}

/// The image with the tick from a timer that measures its cycles.
pub(crate) fn measuring_image() -> Option<PathBuf> {
    variant("timer-tick-measure")
}

fn variant(name: &str) -> Option<PathBuf> {
    test_requirements::image(&format!("{BOARD}-{name}"))
}

/// The image that ticks with its host; `None` without an emulator.
pub(crate) fn image() -> Option<Image> {
    if !emulator() {
        return None;
    }
    Image::find(None).map_err(|reason| missing(&reason.to_string())).ok()
}

/// The same with authentication.
pub(crate) fn key_image() -> Option<Image> {
    image()?;
    Some(Image::find(Some(&variant("auth")?)).unwrap())
}
