//! Replaces a controller while the slave moves and while it pushes against the wall: by a transaction, and by stopping,
//! changing and starting. Prints the largest force step as a table and draws the force.
//!
//! `cargo run --release -p dimsart --example takeover [FOLDER]`, with a folder for `takeover.svg`.

use std::error::Error;
use std::path::Path;

use dimsart::report::{Curve, Figure, Panel, write_figure};
use dimsart_core::{Command, Value};
use dimsart_modules::ALL;
use hil_sim::experiment::Experiment;
use hil_sim::recording::{Column, Recording};
use hil_sim::response::phases;
use hil_sim::rig::{Rig, Station};
use hil_sim::rig_file::RigFile;

/// Evaluated ticks before and after the change.
const AROUND: u64 = 100;
/// Gains of the PID: another law than the PD's 5000 N/m.
const GAINS: [f32; 3] = [4_000.0, 2_000.0, 0.3];

/// Method of the replacement.
#[derive(Debug, Clone, Copy)]
enum Change {
    /// In one transaction.
    Transaction,
    /// The whole scheme by another one, in one transaction.
    WholeScheme,
    /// Command by command, with the scheme stopped.
    Stopped,
}

impl Change {
    const ALL: [Self; 3] = [Self::Transaction, Self::WholeScheme, Self::Stopped];

    fn name(self) -> &'static str {
        match self {
            Self::Transaction => "transaction",
            Self::WholeScheme => "whole scheme in a transaction",
            Self::Stopped => "stop, change, start",
        }
    }

    /// Commands, one per tick.
    fn commands(self, from: &str, to: &str, station: &mut Station) -> Result<Vec<Command>, Box<dyn Error>> {
        let module = |name| ALL.module(name).ok_or("no such module");
        let (from, to, behind) = (module(from)?, module(to)?, module("TIMEDELAY_MOD")?);
        let exchange = [Command::Unplug(from), Command::PlaceBefore(behind), Command::PlugIn(to)];
        Ok(match self {
            Self::Transaction => [&[Command::Begin][..], &exchange, &[Command::Commit]].concat(),
            Self::Stopped => [&[Command::Stop][..], &exchange, &[Command::Check]].concat(),
            Self::WholeScheme => {
                let all = station.dimsart.engine_mut().rebuild_commands();
                // Parameters first: the order of the two controllers' parameters differs.
                let (plug_ins, others): (Vec<_>, Vec<_>) =
                    all.partition(|command| matches!(command, Command::PlugIn(_)));
                let plug_ins = plug_ins.into_iter().map(|command| match command {
                    Command::PlugIn(module) if module == from => Command::PlugIn(to),
                    command => command,
                });
                let mut commands = vec![Command::Begin, Command::Close];
                commands.extend(others.into_iter().chain(plug_ins));
                commands.extend([Command::Check, Command::Commit]);
                commands
            }
        })
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1);
    let file = RigFile::from_shipped("bilateral", &[])?;
    let moments = moments(&file)?;
    println!(
        "| Maximum step of the slave's force in a tick, N | before | {} |",
        Change::ALL.map(Change::name).join(" | ")
    );
    println!("|---|---:|---:|---:|---:|");
    let mut curves = Vec::new();
    for (name, start_s) in moments {
        for (from, to) in [("PDCTRL_MOD", "PIDCTRL_MOD"), ("PIDCTRL_MOD", "PDCTRL_MOD")] {
            let mut steps = Vec::new();
            for change in Change::ALL {
                let forces = forces(&file, change, start_s, (from, to))?;
                let (before, after) = forces.split_at(usize::try_from(AROUND)?);
                if steps.is_empty() {
                    steps.push(largest_step(before));
                }
                steps.push(largest_step(after));
                if from == "PDCTRL_MOD" {
                    curves.push((name, change, forces));
                }
            }
            let steps: Vec<_> = steps.iter().map(|step| format!("{step:.3}")).collect();
            let (from, to) = (from.trim_end_matches("CTRL_MOD"), to.trim_end_matches("CTRL_MOD"));
            println!("| {from} to {to}, {name} | {} |", steps.join(" | "));
        }
    }
    let Some(folder) = folder else { return Ok(()) };
    let recording = recorded(&curves);
    let panel = |(name, _): (&str, f64)| {
        let of_panel = curves.iter().enumerate().filter(|(_, (panel, ..))| *panel == name);
        let curves = of_panel.map(|(column, (_, change, _))| Curve {
            label: change.name().to_owned(),
            column,
            subtracted_column: None,
        });
        let (title, y_label) = (name.to_owned(), "force (N)".to_owned());
        Panel { title, y_label, curves: curves.collect(), levels: Vec::new() }
    };
    let figure = Figure {
        file_stem: "takeover".to_owned(),
        title: "PID in the place of PD: force on the slave".to_owned(),
        panels: moments.map(panel).into(),
        spans: Vec::new(),
    };
    eprintln!("{}", write_figure(Path::new(&folder), &figure, &recording)?.display());
    Ok(())
}

/// Times of free motion and of pushing, s.
fn moments(file: &RigFile) -> Result<[(&'static str, f64); 2], Box<dyn Error>> {
    let phases = phases(file)?.ok_or("no press")?;
    Ok([("in motion", 0.5 * phases.path_leg_s), ("in contact", phases.settled_s)])
}

/// Returns the force of the slave's first axis, by tick, around a change.
fn forces(
    file: &RigFile,
    change: Change,
    start_s: f64,
    (from, to): (&str, &str),
) -> Result<Vec<f64>, Box<dyn Error>> {
    let mut experiment = Experiment::new(file)?;
    let rig = experiment.rig_mut();
    let pid = ALL.module("PIDCTRL_MOD").ok_or("no PID")?;
    for (parameter, gain) in (0..).zip(GAINS) {
        slave(rig)?.dimsart.command(Command::set(pid, parameter, Value::Real(gain)))?;
    }
    if from == "PIDCTRL_MOD" {
        for command in Change::Transaction.commands(to, from, slave(rig)?)? {
            slave(rig)?.dimsart.command(command)?;
        }
    }
    while rig.time_s() < start_s {
        rig.step();
    }
    let mut commands = change.commands(from, to, slave(rig)?)?.into_iter();
    let mut forces = Vec::new();
    slave(rig)?.start_trace();
    for tick in 0..2 * AROUND {
        if tick >= AROUND
            && let Some(command) = commands.next()
        {
            slave(rig)?.dimsart.command(command)?;
        }
        rig.tick();
        let commanded = slave(rig)?.trace().and_then(|trace| trace.commands.first());
        forces.push(f64::from(f32::from_bits(commanded.ok_or("no force")?.0)));
        rig.advance();
    }
    Ok(forces)
}

/// Creates a column for each curve, with the change at time 0.
fn recorded(curves: &[(&str, Change, Vec<f64>)]) -> Recording {
    let column = |(source, change, _): &(&str, Change, Vec<f64>)| Column {
        source: (*source).to_owned(),
        signal: change.name().to_owned(),
        indices: Vec::new(),
        unit: "N".to_owned(),
        format: None,
    };
    let mut recording = Recording::new(curves.iter().map(column).collect());
    for tick in 0..2 * AROUND {
        let row = recording.add_row((tick as f64 - AROUND as f64) * 1e-3);
        for (value, (.., forces)) in row.iter_mut().zip(curves) {
            *value =
                usize::try_from(tick).ok().and_then(|tick| forces.get(tick)).copied().unwrap_or(f64::NAN);
        }
    }
    recording
}

fn slave(rig: &mut Rig) -> Result<&mut Station, &'static str> {
    rig.stations_mut().iter_mut().find(|station| station.name == "slave").ok_or("no slave")
}

fn largest_step(forces: &[f64]) -> f64 {
    let steps = forces.iter().zip(forces.iter().skip(1)).map(|(before, after)| (after - before).abs());
    steps.fold(0.0, f64::max)
}
