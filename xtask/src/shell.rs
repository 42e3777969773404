//! Runs other programs and prints their command lines.

use std::ffi::OsStr;
use std::num::NonZero;
use std::path::PathBuf;
use std::process::Command;
use std::sync::{Mutex, PoisonError};
use std::thread::available_parallelism;

/// Error with the cause and remedy.
pub(crate) type Outcome = Result<(), String>;

/// Creates a command that runs in the repository's top folder.
pub(crate) fn command<I: AsRef<OsStr>>(
    program: impl AsRef<OsStr>,
    arguments: impl IntoIterator<Item = I>,
) -> Command {
    let mut command = Command::new(program);
    command.args(arguments).current_dir(top());
    command
}

/// Returns the repository's top folder.
pub(crate) fn top() -> PathBuf {
    let here = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    here.parent().map(PathBuf::from).unwrap_or(here)
}

/// Returns cargo's target folder.
pub(crate) fn target() -> PathBuf {
    top().join(std::env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| "target".into()))
}

/// Returns the folder of images.
pub(crate) fn image_folder() -> PathBuf {
    target().join("images")
}

/// Creates a command of the running cargo.
pub(crate) fn cargo(arguments: &[&str]) -> Command {
    command(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()), arguments)
}

/// Manifest of the emulator's separate workspace.
pub(crate) const EMULATOR: &str = "emulator/Cargo.toml";

/// Creates a cargo command for the emulator's workspace, with a common target folder.
pub(crate) fn cargo_emulator(verb: &str) -> Command {
    let mut cargo = cargo(&[verb, "--workspace", "--manifest-path", EMULATOR]);
    cargo.env("CARGO_TARGET_DIR", target());
    cargo
}

/// Runs a command to its end.
pub(crate) fn run(command: &mut Command) -> Outcome {
    let shown = shown(command);
    println!("$ {shown}");
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("`{shown}` ended with {status}")),
        Err(error) => Err(format!("cannot start `{shown}`: {error}")),
    }
}

/// Runs a function for each item, on all cores; an error lists all failures.
pub(crate) fn on_every_core<T: Send>(todo: Vec<T>, work: impl Fn(T) -> Outcome + Sync) -> Outcome {
    at_once(cores(), todo, work)
}

/// Returns the number of cores.
pub(crate) fn cores() -> usize {
    available_parallelism().map_or(1, NonZero::get)
}

/// The same with a given number at a time.
pub(crate) fn at_once<T: Send>(count: usize, todo: Vec<T>, work: impl Fn(T) -> Outcome + Sync) -> Outcome {
    let todo = Mutex::new(todo.into_iter());
    let next = || todo.lock().unwrap_or_else(PoisonError::into_inner).next();
    let on_core = || std::iter::from_fn(next).filter_map(|one| work(one).err()).collect();
    let failed: Vec<String> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..count).map(|_| scope.spawn(on_core)).collect();
        let lost = |_| vec!["a thread panicked".to_owned()];
        workers.into_iter().flat_map(|worker| worker.join().unwrap_or_else(lost)).collect()
    });
    if failed.is_empty() { Ok(()) } else { Err(failed.join("; ")) }
}

/// Returns whether a command runs and succeeds; discards its output.
pub(crate) fn succeeds(command: &mut Command) -> bool {
    command.output().is_ok_and(|output| output.status.success())
}

fn shown(command: &Command) -> String {
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    words.map(OsStr::to_string_lossy).collect::<Vec<_>>().join(" ")
}
