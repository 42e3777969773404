//! Cycles of a tick by number of axes and modules, as tables with fitted lines.
//!
//! `cargo run --release -p dimsart --example cycle_figures [ELF]`, after `cargo board nucleo-g474re`.

use std::error::Error;
use std::path::PathBuf;

use cycles::timing::{Column, Timing};
use dimsart::cycles::{Figures, Firmware, Setup, SteadyTick, UNIT, measure};
use dimsart_core::scheme;
use dimsart_modules::ALL;
use hil_sim::experiment::Experiment;
use hil_sim::rig::SimulatedDimsart;
use hil_sim::rig_file::RigFile;
use hil_sim::schemes::device;

const AXES: std::ops::RangeInclusive<usize> = 1..=7;
const MODULES: std::ops::RangeInclusive<usize> = 1..=16;
/// Number of axes while the modules are varied.
const USUAL_AXES: usize = 3;
const RANDOM_TICKS: u64 = 20_000;

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).map(PathBuf::from);
    let firmware = Firmware::find(path.as_deref(), Some("nucleo-g474re"))?;
    println!("`{}`, {UNIT}, memory {}, column upper.\n", firmware.name, firmware.memory().name());
    for side in ["master", "slave"] {
        parts(&figures(&firmware, side)?);
    }
    let scheme = |dof: usize| {
        let rig = RigFile::from_shipped("bilateral", &[format!("dof={dof}")])?;
        let mut experiment = Experiment::new(&rig)?;
        let master = experiment.rig_mut().stations_mut().first_mut().ok_or("no master")?;
        steady(&firmware, &mut master.dimsart)
    };
    let points = AXES.map(|dof| Ok((dof, scheme(dof)?))).collect::<Result<Vec<_>, Box<dyn Error>>>()?;
    table("Axes of the shipped scheme's master", &points);
    let points = MODULES
        .map(|modules| Ok((modules, steady(&firmware, &mut springs(modules)?)?)))
        .collect::<Result<Vec<_>, Box<dyn Error>>>()?;
    table("P controllers of 3 axes", &points);
    Ok(())
}

fn timing(firmware: &Firmware) -> Timing {
    Timing::new(firmware.memory().profile(), Column::Upper)
}

fn steady(firmware: &Firmware, dimsart: &mut SimulatedDimsart) -> Result<SteadyTick, Box<dyn Error>> {
    Ok(SteadyTick::of(firmware, timing(firmware), dimsart)?)
}

fn figures(firmware: &Firmware, side: &'static str) -> Result<Figures, Box<dyn Error>> {
    let rig =
        RigFile::from_shipped("bilateral", &["link.jitter_ticks=2", "link.loss=0.02"].map(str::to_owned))?;
    let setup = Setup {
        firmware,
        rig: &rig,
        side,
        commands: None,
        counts_instructions: false,
        timing: timing(firmware),
        random_ticks: RANDOM_TICKS,
        profile: firmware.memory().name(),
        column: "upper",
    };
    Ok(measure(&setup, |_, _| {})?)
}

/// A tick and its parts.
fn parts(figures: &Figures) {
    println!(
        "| {}, {} axes | Min | Mean | Max | Random, max | Bound | Bound / max |",
        figures.side, figures.dof
    );
    println!("|---|---:|---:|---:|---:|---:|---:|");
    for row in [&figures.tick, &figures.frame_and_engine].into_iter().chain(&figures.modules) {
        let bound = row.bound.map_or("-".to_owned(), |bound| bound.to_string());
        let ratio = row.ratio.map_or("-".to_owned(), |ratio| format!("{ratio:.3}"));
        println!(
            "| {} | {} | {:.0} | {} | {} | {bound} | {ratio} |",
            row.name, row.emulated_min, row.emulated_mean, row.emulated_max, row.random_max
        );
    }
    println!();
}

/// Springs from where the device is to where it is.
fn springs(modules: usize) -> Result<SimulatedDimsart, Box<dyn Error>> {
    let mut rows = String::new();
    for number in 1..=modules {
        rows += &format!("all PCTRL_MOD.{number} PORT_DES_POSITION POSITION\n");
        rows += &format!("all PCTRL_MOD.{number} PORT_DES_FORCE DES_FORCE.{number}\n");
        rows += &format!("all MOD_ENG MOD_ON PCTRL_MOD.{number}\n");
    }
    rows += "all MOD_ENG MATCHING_CHECK\n";
    let device = device("springs", USUAL_AXES, 1e-3)?;
    let mut dimsart = SimulatedDimsart::new(device, ALL).map_err(|error| format!("{error:?}"))?;
    let mut wrong = String::new();
    scheme::load(&rows, "all", &[], &mut dimsart, |error| wrong += &format!("{error:?}\n"));
    if wrong.is_empty() { Ok(dimsart) } else { Err(wrong.into()) }
}

/// Prints the first and the last point, and the fitted line.
fn table(what: &str, points: &[(usize, SteadyTick)]) {
    println!("| {what} | Steady tick | Bound |");
    println!("|---:|---:|---:|");
    for (count, SteadyTick { emulated, bound, .. }) in
        points.iter().take(1).chain(points.iter().skip(1).last())
    {
        println!("| {count} | {emulated} | {bound} |");
    }
    for (name, value) in [
        ("steady tick", (|steady: &SteadyTick| steady.emulated) as fn(&SteadyTick) -> u64),
        ("bound", |steady: &SteadyTick| steady.bound),
    ] {
        let points: Vec<(f64, f64)> =
            points.iter().map(|(count, steady)| (*count as f64, value(steady) as f64)).collect();
        let (slope, offset, distance) = line(&points);
        println!("\n{name}: {offset:.0} + {slope:.1} per unit, max. residual {distance:.0}");
    }
    println!();
}

/// Returns slope, offset and maximum residual of the least-squares line.
fn line(points: &[(f64, f64)]) -> (f64, f64, f64) {
    let count = points.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / count;
    let (x_mean, y_mean) = (mean(|(x, _)| *x), mean(|(_, y)| *y));
    let covariance: f64 = points.iter().map(|(x, y)| (x - x_mean) * (y - y_mean)).sum();
    let variance: f64 = points.iter().map(|(x, _)| (x - x_mean).powi(2)).sum();
    let slope = covariance / variance;
    let offset = y_mean - slope * x_mean;
    let distance = points.iter().map(|(x, y)| (y - offset - slope * x).abs()).fold(0.0, f64::max);
    (slope, offset, distance)
}
