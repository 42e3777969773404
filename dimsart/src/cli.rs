//! The `dimsart` command: one file per sub-command.

mod bridge;
mod bus;
mod check;
mod commission;
mod completions;
mod config;
mod connect;
mod controllers;
mod cycles;
mod dbc;
mod doctor;
#[cfg(test)]
mod documented;
mod emulate;
mod identify;
mod law;
mod line;
mod man;
mod modules;
mod motor;
mod new_module;
mod new_project;
mod output;
mod record;
mod replay;
mod run;
mod scheme;
mod serve;
mod side;
mod stamp;
mod station;
mod summary;
mod sweep;
mod top;
mod view;

use std::error::Error;
use std::io::{self, ErrorKind, Write};
use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::budget::BudgetError;
use crate::sweep::GridError;
use dimsart_core::{DescriptorError, ModuleKinds};
use hil_sim::rig_file::RigFileError;
use hil_sim::untrusted_text::{escape_lines, truncate};

/// Run control schemes on simulated robots and on boards.
///
/// Tables are as wide as the terminal, or have the number of columns in the variable `COLUMNS`. With --json, standard
/// output contains JSON only; tables and notes go to standard error.
#[derive(Debug, Parser)]
#[command(name = "dimsart", version, after_help = EXAMPLES)]
struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,
}

const EXAMPLES: &str = "\
Examples:
  dimsart                            run the bilateral experiment, write the report to runs/latest
  dimsart run --set link.loss=0.1    run the bilateral experiment with 10 % packet loss
  dimsart bus --joints 6             check whether six joints fit on one CAN bus
  dimsart check my.scheme            list the faults of a scheme
  dimsart modules PDCTRL_MOD         ports, parameters, units and ranges of a module
  dimsart serve                      simulate a joint in real time, with a web page to tune its gains
  dimsart top                        tune running controllers in the terminal
  dimsart law check my.law           compile a control law written as text
  dimsart config diff sim:joint      list a controller's differences from the defaults
  dimsart identify                   estimate inertia, friction and weight of a joint
  dimsart record sim:joint           record every tick to a file
  dimsart new-project gripper        create a project with your own laws, tests and images

`dimsart COMMAND --help` is the full reference. Exit status: 0 success, 1 error, 2 wrong usage, such as an invalid --set.";

#[derive(Debug, Subcommand)]
enum Command {
    Run(run::Run),
    Bridge(bridge::Bridge),
    Bus(bus::Bus),
    Check(check::Check),
    Config(config::Config),
    Modules(modules::Modules),
    Motor(motor::Motor),
    NewModule(new_module::NewModule),
    NewProject(new_project::NewProject),
    Commission(commission::Commission),
    Connect(connect::Connect),
    Dbc(dbc::Dbc),
    Cycles(cycles::Cycles),
    Doctor(doctor::Doctor),
    Emulate(emulate::Emulate),
    Law(law::Law),
    Identify(identify::Identify),
    Record(record::Record),
    Replay(replay::Replay),
    Scheme(scheme::Scheme),
    Serve(serve::Serve),
    Stamp(stamp::Stamp),
    Sweep(sweep::Sweep),
    Top(top::Top),
    View(view::View),
    Completions(completions::Completions),
    Man(man::Man),
}

/// Exit status of wrong usage.
const WRONG_USAGE: u8 = 2;
/// Exit status of an unstable run with `--fail-if-unstable`, and of a recording or configuration that differs.
const NOT_STABLE: u8 = 3;

/// Invalid or conflicting arguments.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
struct UsageError(String);

/// Result of a sub-command: its exit status or an error.
type Ending = Result<ExitCode, Box<dyn Error>>;

/// Maximum length of a line in an error message, which may quote input.
const MAX_LINE_CHARS: usize = 2000;

/// Parses the command line and runs the command with these module kinds: `dimsart_modules::ALL`, optionally joined with a
/// project's own kinds.
#[must_use]
pub fn main(kinds: ModuleKinds) -> ExitCode {
    // Slow motion, for tests on a busy machine.
    if let Some(speed) = std::env::var("DIMSART_SPEED").ok().and_then(|speed| serve::speed(&speed).ok()) {
        hil_sim::clock::set_speed(speed);
    }
    let command = Arguments::parse().command.unwrap_or_else(|| Command::Run(run::Run::default()));
    let mut out = io::stdout().lock();
    let ending = match command {
        Command::Run(run) => run.execute(kinds, &mut out),
        Command::Bridge(bridge) => bridge.execute(kinds, &mut out),
        Command::Bus(bus) => bus.execute(kinds, &mut out),
        Command::Check(check) => check.execute(kinds, &mut out),
        Command::Config(config) => config.execute(kinds, &mut out),
        Command::Modules(modules) => modules.execute(kinds, &mut out),
        Command::Motor(motor) => motor.execute(kinds, &mut out),
        Command::NewModule(new_module) => new_module.execute(kinds, &mut out),
        Command::NewProject(new_project) => new_project.execute(kinds, &mut out),
        Command::Commission(commission) => commission.execute(kinds, &mut out),
        Command::Connect(connect) => connect.execute(kinds, &mut out),
        Command::Dbc(dbc) => dbc.execute(kinds, &mut out),
        Command::Cycles(cycles) => cycles.execute(kinds, &mut out),
        Command::Doctor(doctor) => doctor.execute(kinds, &mut out),
        Command::Emulate(emulate) => emulate.execute(&mut out),
        Command::Law(law) => law.execute(&mut out),
        Command::Identify(identify) => identify.execute(kinds, &mut out),
        Command::Record(record) => record.execute(kinds, &mut out),
        Command::Replay(replay) => replay.execute(kinds, &mut out),
        Command::Scheme(scheme) => scheme.execute(kinds, &mut out),
        Command::Serve(serve) => serve.execute(kinds, &mut out),
        Command::Stamp(stamp) => stamp.execute(kinds, &mut out),
        Command::Sweep(sweep) => sweep.execute(kinds, &mut out),
        Command::Top(top) => top.execute(kinds),
        Command::View(view) => view.execute(kinds, &mut out),
        Command::Completions(completions) => completions.execute(&mut out),
        Command::Man(man) => man.execute(&mut out),
    };
    ending.and_then(|code| Ok(out.flush().map(|()| code)?)).unwrap_or_else(|error| {
        // The reader closed the pipe, as `head` does: not an error.
        if error.downcast_ref::<io::Error>().is_some_and(|error| error.kind() == ErrorKind::BrokenPipe) {
            return ExitCode::SUCCESS;
        }
        let text = escape_lines(&error.to_string());
        let lines: Vec<_> = text.lines().map(|line| truncate(line, MAX_LINE_CHARS)).collect();
        eprintln!("dimsart: {}", lines.join("\n"));
        let is_usage_error = error.downcast_ref().is_some_and(RigFileError::is_usage_error)
            || matches!(error.downcast_ref(), Some(BudgetError::UnknownBoard { .. }))
            || error.is::<DescriptorError>()
            || error.is::<GridError>()
            || error.is::<UsageError>();
        if is_usage_error { ExitCode::from(WRONG_USAGE) } else { ExitCode::FAILURE }
    })
}
