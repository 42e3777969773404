//! The repository's own chores: `cargo xtask test` sets up what is missing and passes all tests.

mod bench;
mod panic_free;
mod setup;
mod shell;
mod test;

use std::process::ExitCode;

const USAGE: &str = "\
usage: cargo xtask COMMAND

  test        set up what is missing (Python packages of the oracle), then run every test
  bench       count the instructions of a tick, hold them to their budgets, and time the shipped scenario
              (docs/benchmarks.md)
  panic-free  show that nothing a tick reaches in the machine code can panic
  ci          formatting, lints and documentation with warnings denied, then all of the above
";

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let result = match (arguments.next().as_deref(), arguments.next()) {
        (Some("test"), None) => test::test(),
        (Some("bench"), None) => bench::run(),
        (Some("panic-free"), None) => panic_free::run(),
        (Some("ci"), None) => test::ci(),
        (Some("help" | "-h" | "--help"), _) => {
            print!("{USAGE}");
            return ExitCode::SUCCESS;
        }
        _ => {
            eprint!("{USAGE}");
            return ExitCode::from(2);
        }
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("xtask: {message}");
            ExitCode::FAILURE
        }
    }
}
