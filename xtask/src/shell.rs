//! Runs other programs and says what it runs.

use std::ffi::OsStr;
use std::num::NonZero;
use std::path::PathBuf;
use std::process::Command;
use std::sync::{Mutex, PoisonError};
use std::thread::available_parallelism;

/// What went wrong, and what to do next.
pub(crate) type Outcome = Result<(), String>;

/// A program with its arguments, run in the repository's top folder.
pub(crate) fn command<I: AsRef<OsStr>>(
    program: impl AsRef<OsStr>,
    arguments: impl IntoIterator<Item = I>,
) -> Command {
    let mut command = Command::new(program);
    command.args(arguments).current_dir(top());
    command
}

/// The repository's top folder.
pub(crate) fn top() -> PathBuf {
    let here = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    here.parent().map(PathBuf::from).unwrap_or(here)
}

/// The folder that cargo builds into.
pub(crate) fn target() -> PathBuf {
    top().join(std::env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| "target".into()))
}

/// Where images are collected.
pub(crate) fn image_folder() -> PathBuf {
    target().join("images")
}

/// The cargo that runs this.
pub(crate) fn cargo(arguments: &[&str]) -> Command {
    command(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()), arguments)
}

/// Cargo's manifest of the emulator, which is a workspace of its own.
pub(crate) const EMULATOR: &str = "emulator/Cargo.toml";

/// Cargo for the emulator's workspace. Dependencies of both workspaces are built once, in one target directory.
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
        Err(error) => Err(format!("`{shown}` could not be started: {error}")),
    }
}

/// Does some work for each of these, as many at a time as there are cores: the next one goes to the core that is free first.
/// An error names all that failed.
pub(crate) fn on_every_core<T: Send>(todo: Vec<T>, work: impl Fn(T) -> Outcome + Sync) -> Outcome {
    at_once(cores(), todo, work)
}

/// Cores of this computer.
pub(crate) fn cores() -> usize {
    available_parallelism().map_or(1, NonZero::get)
}

/// The same, so many at a time.
pub(crate) fn at_once<T: Send>(count: usize, todo: Vec<T>, work: impl Fn(T) -> Outcome + Sync) -> Outcome {
    let todo = Mutex::new(todo.into_iter());
    let next = || todo.lock().unwrap_or_else(PoisonError::into_inner).next();
    let on_core = || std::iter::from_fn(next).filter_map(|one| work(one).err()).collect();
    let failed: Vec<String> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..count).map(|_| scope.spawn(on_core)).collect();
        let lost = |_| vec!["a thread was lost".to_owned()];
        workers.into_iter().flat_map(|worker| worker.join().unwrap_or_else(lost)).collect()
    });
    if failed.is_empty() { Ok(()) } else { Err(failed.join("; ")) }
}

/// Whether a command runs and succeeds; what it prints is thrown away.
pub(crate) fn succeeds(command: &mut Command) -> bool {
    command.output().is_ok_and(|output| output.status.success())
}

fn shown(command: &Command) -> String {
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    words.map(OsStr::to_string_lossy).collect::<Vec<_>>().join(" ")
}
