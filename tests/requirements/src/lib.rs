//! Requirements of tests other than Rust: board images, an emulator, reference runs.
//!
//! A test without its requirement prints a line to the terminal and passes, so that `cargo test` passes with only Rust
//! installed. `cargo xtask long` treats such a line as a failure.
#![expect(clippy::panic, reason = "fails a test")]

use std::env;
use std::io::Write;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

/// Environment variable: folder of the board images.
const FIRMWARE: &str = "DIMSART_FIRMWARE";
/// Environment variable: folder of the reference runs.
const ORACLE: &str = "DIMSART_ORACLE";
/// Environment variable: set to run tests at full length.
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

/// Returns `full` in `cargo xtask long`, otherwise `short`.
pub fn length<T>(short: T, full: T) -> T {
    if env::var_os(LONG).is_some() { full } else { short }
}

/// Returns the file of a board's image `BOARD[-VARIANT]`. `cargo xtask test` builds the images that most tests need,
/// `cargo xtask long` all.
#[must_use]
pub fn image(name: &str) -> Option<PathBuf> {
    let file = PathBuf::from(env::var_os(FIRMWARE).unwrap_or_default()).join(name);
    if file.is_file() {
        return Some(file);
    }
    skip(&format!("missing image {name}: run `cargo xtask test` or `cargo xtask long`"));
    None
}

/// Returns the file of a board's stamped image.
#[must_use]
pub fn stamped_image(name: &str) -> Option<PathBuf> {
    // `dimsart stamp` writes the costs to a text file next to the image.
    image(&format!("{name}.costs")).map(|costs| costs.with_extension(""))
}

/// Returns whether QEMU can be started.
///
/// # Panics
/// If QEMU is missing although the folder of images is set.
#[must_use]
pub fn emulator() -> bool {
    let version = Command::new("qemu-system-arm").arg("--version").stdout(Stdio::null()).status();
    version.map_err(|error| missing(&format!("qemu-system-arm: {error}"))).is_ok()
}

/// Returns the folder of reference runs of other implementations, such as `scipy`.
#[must_use]
pub fn reference_runs(oracle: &str) -> Option<PathBuf> {
    let folder = env::var_os(ORACLE);
    if folder.is_none() {
        skip(&format!("missing reference runs of {oracle}: run `cargo xtask test`"));
    }
    folder.map(PathBuf::from)
}

/// Returns the Python interpreter with the packages of `tests/oracle/requirements.txt`.
#[must_use]
pub fn python() -> Option<PathBuf> {
    let _ = reference_runs("Python")?;
    Some(PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../.venv/bin/python")))
}

/// Reports that a test of images is skipped.
///
/// # Panics
/// If the folder of images is set: the test must then run.
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
