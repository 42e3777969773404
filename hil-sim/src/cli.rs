//! The `dimsart` command: what it can do, one file per sub-command.

mod check;
mod modules;
mod new_module;
mod run;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// DIMSART on the desk: run control schemes against simulated robots, check them, look modules up.
#[derive(Debug, Parser)]
#[command(
    name = "dimsart",
    version,
    after_help = "Without a command, `dimsart run` runs the default scenario."
)]
struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Debug, Subcommand)]
enum Command {
    Run(run::Run),
    Check(check::Check),
    Modules(modules::Modules),
    NewModule(new_module::NewModule),
}

/// What a sub-command ends with: its exit status, or what went wrong.
type Ending = Result<ExitCode, Box<dyn std::error::Error>>;

/// Reads the command line and does what it says.
#[must_use]
pub fn main() -> ExitCode {
    let ending = match Arguments::parse().command.unwrap_or_else(|| Command::Run(run::Run::default())) {
        Command::Run(run) => run.execute(),
        Command::Check(check) => check.execute(),
        Command::Modules(modules) => modules.execute(),
        Command::NewModule(new_module) => new_module.execute(),
    };
    ending.unwrap_or_else(|error| {
        eprintln!("dimsart: {error}");
        ExitCode::FAILURE
    })
}
