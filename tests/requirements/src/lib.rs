//! What a test needs beyond Rust: images of boards, an emulator, reference runs.
//!
//! A test without its requirement writes a line to the terminal and passes, so that `cargo test` passes on a bare
//! Rust machine. `cargo xtask long` takes such a line for a failure.
#![expect(clippy::panic, reason = "a test fails by it")]

use std::env;
use std::io::Write;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

/// Names the folder of the boards' images.
const FIRMWARE: &str = "DIMSART_FIRMWARE";
/// Names the folder of the reference runs.
const ORACLE: &str = "DIMSART_ORACLE";
/// Set where tests run at full length.
const LONG: &str = "DIMSART_LONG";

/// A longer wait is a failure, at any load of the machine.
pub const TEST_TIMEOUT: Duration = Duration::from_secs(600);

/// Waits until `is_so` returns true.
///
/// # Panics
/// After [`TEST_TIMEOUT`], with the message of `or_else`.
pub fn wait_until(or_else: impl Fn() -> String, mut is_so: impl FnMut() -> bool) {
    let deadline = Instant::now() + TEST_TIMEOUT;
    while !is_so() {
        assert!(Instant::now() < deadline, "{}", or_else());
        thread::sleep(Duration::from_millis(1));
    }
}

/// `full` in `cargo xtask long`, otherwise `short`.
pub fn length<T>(short: T, full: T) -> T {
    if env::var_os(LONG).is_some() { full } else { short }
}

/// The file of a board's image, by its name `BOARD[-VARIANT]`. `cargo xtask test` builds those that most tests need,
/// `cargo xtask long` all.
#[must_use]
pub fn image(name: &str) -> Option<PathBuf> {
    let file = PathBuf::from(env::var_os(FIRMWARE).unwrap_or_default()).join(name);
    if file.is_file() {
        return Some(file);
    }
    skip(&format!("no image {name}; `cargo xtask test` or `cargo xtask long` builds it"));
    None
}

/// The file of a board's image that is stamped with what its modules cost.
#[must_use]
pub fn stamped_image(name: &str) -> Option<PathBuf> {
    // `dimsart stamp` leaves the costs as text beside the image.
    image(&format!("{name}.costs")).map(|costs| costs.with_extension(""))
}

/// Whether QEMU can be started.
///
/// # Panics
/// If it cannot although the folder of images is known.
#[must_use]
pub fn emulator() -> bool {
    let version = Command::new("qemu-system-arm").arg("--version").stdout(Stdio::null()).status();
    version.map_err(|error| missing(&format!("qemu-system-arm: {error}"))).is_ok()
}

/// The folder of the reference runs by outside implementations, such as `scipy`.
#[must_use]
pub fn reference_runs(oracle: &str) -> Option<PathBuf> {
    let folder = env::var_os(ORACLE);
    if folder.is_none() {
        skip(&format!("no reference runs of {oracle}; `cargo xtask test` makes them"));
    }
    folder.map(PathBuf::from)
}

/// The Python with the packages of `tests/oracle/requirements.txt`.
#[must_use]
pub fn python() -> Option<PathBuf> {
    let _ = reference_runs("Python")?;
    Some(PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../.venv/bin/python")))
}

/// Reports that a test of images is skipped.
///
/// # Panics
/// If the folder of images is known: there the test must run.
pub fn missing(reason: &str) {
    if env::var_os(FIRMWARE).is_some() {
        panic!("{reason}");
    }
    skip(&format!("{reason}; run `cargo xtask test`"));
}

fn skip(reason: &str) {
    let thread = thread::current();
    let test = thread.name().unwrap_or("a test");
    // Unlike `eprintln!`, this is not captured. A closed terminal is not an error of the test.
    let _ = std::io::stderr().write_all(format!("skipped: {test}: {reason}\n").as_bytes());
}
