//! The `dimsart` command: what it can do, one file per sub-command.

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

use std::error::Error;
use std::io::{self, ErrorKind, Write};
use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::budget::BudgetError;
use crate::sweep::GridError;
use dimsart_core::{DescriptorError, Kinds};
use hil_sim::foreign_text::{shortened, visible_lines};
use hil_sim::rig_file::RigFileError;

/// DIMSART on the desk: run control schemes against simulated robots, check them, look modules up.
#[derive(Debug, Parser)]
#[command(name = "dimsart", version, after_help = EXAMPLES)]
struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,
}

const EXAMPLES: &str = "\
Examples:
  dimsart                            the paper's bilateral experiment, report in runs/latest
  dimsart run --set link.loss=0.1    the same with a tenth of the packets lost
  dimsart bus --joints 6             whether a robot's joints fit on a CAN bus
  dimsart check my.scheme            what is wrong with a scheme, if anything
  dimsart modules PDCTRL_MOD         ports, parameters, units and ranges of a module
  dimsart serve                      a simulated joint to tune, in real time, and its page
  dimsart law check my.law           a control law as text: what it needs, or where it is wrong
  dimsart config diff sim:joint      what a controller has that differs from the defaults
  dimsart identify                   inertia, friction and weight of a joint from its motion
  dimsart top                        the same in this terminal
  dimsart record sim:joint           every tick of it into a file
  dimsart new-project gripper        a project of your own: laws, tests, images

`dimsart COMMAND --help` has more. Exit status: 0 done, 1 an error, 2 wrong usage.";

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
    Completions(completions::Completions),
    Man(man::Man),
}

/// Exit status where the command line is wrong.
const WRONG_USAGE: u8 = 2;
/// Exit status of a run that was not stable, where that was asked for, and of a recording or configuration that differs.
const NOT_STABLE: u8 = 3;

/// Arguments that do not go together.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
struct UsageError(String);

/// What a sub-command ends with: its exit status, or what went wrong.
type Ending = Result<ExitCode, Box<dyn Error>>;

/// A line of an error shows no more of an input.
const MAX_LINE_CHARS: usize = 2000;

/// Reads the command line and runs its command, with these module kinds: `dimsart_modules::ALL`, or joined with one's own.
#[must_use]
pub fn main(kinds: Kinds) -> ExitCode {
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
        Command::Completions(completions) => completions.execute(&mut out),
        Command::Man(man) => man.execute(&mut out),
    };
    ending.and_then(|code| Ok(out.flush().map(|()| code)?)).unwrap_or_else(|error| {
        // The reader has seen enough, as `head` has: that is no failure of ours.
        if error.downcast_ref::<io::Error>().is_some_and(|error| error.kind() == ErrorKind::BrokenPipe) {
            return ExitCode::SUCCESS;
        }
        let text = visible_lines(&error.to_string());
        let lines: Vec<_> = text.lines().map(|line| shortened(line, MAX_LINE_CHARS)).collect();
        eprintln!("dimsart: {}", lines.join("\n"));
        let is_usage = error.downcast_ref().is_some_and(RigFileError::is_usage)
            || matches!(error.downcast_ref(), Some(BudgetError::Unknown { .. }))
            || error.is::<DescriptorError>()
            || error.is::<GridError>()
            || error.is::<UsageError>();
        if is_usage { ExitCode::from(WRONG_USAGE) } else { ExitCode::FAILURE }
    })
}
