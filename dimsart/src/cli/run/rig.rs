//! `dimsart run` of a rig file.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use super::{Ending, Run, print_written, progress_bar, stop_on_interrupt, style, write_recorders};
use crate::cli::UsageError;
use crate::cli::output::say;
use crate::cli::summary;
use crate::pictures::response::{figures, file_stems};
use crate::report::{self, BusTimeline, Fact, Report, SignalsFile, Table};
use crate::tick_map::tick_maps;
use dimsart_core::types;
use hil_sim::bus::time::seconds_ns;
use hil_sim::emulated::{self, Image};
use hil_sim::response::{AxisOutcome, Experiment, LoopFigures, Outcome, PerceivedStiffness, Saturation};
use hil_sim::rig_file::{RigFile, RigFileError, SHIPPED};
use hil_sim::schemes::suggestion;
use indicatif::ProgressBar;

/// Where there is no figure.
const NONE: &str = "-";
/// From one look of a spinner to the next.
const SPINNER: Duration = Duration::from_millis(100);

/// The rig file at a path, or the shipped one of that name; none for anything else.
pub(in crate::cli) fn read(path: Option<&Path>, sets: &[String]) -> Result<Option<RigFile>, RigFileError> {
    let Some(path) = path else { return Ok(None) };
    let shipped = path.to_str().and_then(RigFile::shipped).filter(|_| !path.exists());
    if let Some(text) = shipped {
        let name = path.display().to_string();
        return RigFile::read(text, &name, PathBuf::new(), sets).map(Some);
    }
    if !path.exists() && path.extension().is_none() {
        let (name, known) = (path.display().to_string(), SHIPPED.map(|(name, _)| name.to_owned()));
        return Err(RigFileError::NotShipped { near: suggestion(&name, &known), name });
    }
    // What cannot be read, the scenario says as well.
    match std::fs::read_to_string(path) {
        Ok(text) if RigFile::is_one(&text) => RigFile::load(path, sets).map(Some),
        _ => Ok(None),
    }
}

/// The rig that a name or a TOML file is of; none for a scheme.
pub(in crate::cli) fn read_rig(path: &Path) -> Result<Option<RigFile>, RigFileError> {
    let is_toml = path.extension().is_some_and(|extension| extension == "toml");
    let is_shipped = path.to_str().and_then(RigFile::shipped).is_some();
    if is_toml || is_shipped { read(Some(path), &[]) } else { Ok(None) }
}

pub(super) fn run(command: &Run, file: &RigFile, out: &mut impl Write) -> Ending {
    if command.side.is_some() || command.target_side.is_some() {
        let reason = "--side and --target-side are for scenarios of two sides; of a rig, all controllers run here, or \
                      with --target all of them as firmware";
        return Err(UsageError(reason.to_owned()).into());
    }
    let begun = Instant::now();
    let folder = command.folder();
    if !command.no_report {
        report::try_folder(&folder)?;
    }
    let stop = stop_on_interrupt()?;
    let probing = ProgressBar::new_spinner().with_message("analysing every loop");
    probing.enable_steady_tick(SPINNER);
    let experiment = Experiment::new(file);
    probing.finish_and_clear();
    let mut experiment = experiment?;
    if command.no_report {
        experiment = experiment.without_recording();
    }
    experiment.keep_for_pictures();
    if command.target.is_some() {
        let image = Image::find(command.image.as_deref())?;
        if !command.no_report {
            report::make_folder(&folder)?;
        }
        emulated::share_one_processor();
        let log = |device: &str| File::create(folder.join(format!("firmware-{device}.log"))).ok();
        experiment.emulate(&image, |device| if command.no_report { None } else { log(device) })?;
    }
    let mut signals = None;
    if !command.no_report {
        let stems = file_stems(file);
        let stems: Vec<&str> = stems.iter().map(String::as_str).collect();
        let (written, listener) = SignalsFile::create(
            &folder,
            &stems,
            command.signals_format(file.to_toml(), experiment.rig_mut()),
        )?;
        experiment.tell(listener);
        signals = Some(written);
    }
    let bar = progress_bar(file.duration_s);
    let mut run = experiment.run(&stop, |time_s| bar.set_position(super::milliseconds(time_s)));
    bar.finish_and_clear();
    stop.store(false, Ordering::Relaxed);
    let write = |signals: SignalsFile| {
        signals.finish()?;
        let recorders = write_recorders(&folder, &mut run.rig)?;
        let names: Vec<&str> = file.devices.iter().map(|device| device.name.as_str()).collect();
        let report = Report {
            title: format!("Response of {}", names.join(", ")),
            summary: facts(&run.outcome),
            axes: axes(&run.outcome),
            faults: run.outcome.faults.iter().chain(&run.outcome.undecided).cloned().collect(),
            figures: figures(&run.recording, file),
            tick_maps: tick_maps(&run.rig),
            bus: BusTimeline::of(&run.media, seconds_ns(file.sample_period_s)),
            settings_toml: file.to_toml(),
            recording: &run.recording,
            signals: command.signals,
            recorders,
        };
        let bar = ProgressBar::new(0);
        bar.set_style(style("report     [{bar:40}] {pos}/{len} files"));
        let written = report::write(&folder, &report, &stop, &bar);
        bar.finish_and_clear();
        Ok::<_, Box<dyn std::error::Error>>(written?)
    };
    let written = signals.map(write).transpose();
    run.outcome.set_wall_s(begun.elapsed().as_secs_f64());
    say(command.json, out, |text| print(text, &run.outcome))?;
    if let Some(written) = written? {
        say(command.json, out, |text| print_written(text, &folder, &written))?;
    }
    if command.json {
        writeln!(out, "{}", serde_json::to_string(&run.outcome)?)?;
    }
    run.broken.map_or(Ok(command.status(run.outcome.stable)), |broken| Err(broken.into()))
}

fn print(out: &mut dyn Write, outcome: &Outcome) -> std::io::Result<()> {
    summary::print_tables(out, facts(outcome), axes(outcome))?;
    for fault in &outcome.faults {
        writeln!(out, "fault: {fault}")?;
    }
    for undecided in &outcome.undecided {
        writeln!(out, "{undecided}")?;
    }
    Ok(())
}

/// What a run came to as a whole.
fn facts(outcome: &Outcome) -> Vec<Fact> {
    let (stable, note) = match outcome.stable {
        true => ("yes", "all signals in range; no growth, no sustained oscillation"),
        false if outcome.faults.is_empty() => ("undecided", "see below"),
        false => ("NO", "see the fault"),
    };
    let mut facts = vec![
        summary::fact("stable", stable.to_owned(), "", note),
        summary::fact(
            "simulated",
            format!("{:.3}", outcome.simulated_s),
            "s",
            &format!("{} ticks", outcome.ticks),
        ),
        summary::fact(
            "took",
            format!("{:.3}", outcome.wall_s),
            "s",
            &format!("{:.0} times real time", outcome.realtime_factor),
        ),
    ];
    facts.extend(outcome.perceived.iter().map(perceived));
    facts.extend(outcome.energy_ports_min_j.map(summary::port_energy));
    facts.extend(summary::limit_cycles(&outcome.limit_cycles));
    facts.extend(outcome.saturated.iter().map(|found| saturated(found, outcome.simulated_s)));
    facts.extend(outcome.media.iter().map(summary::medium));
    facts.extend(summary::lost(&outcome.received));
    facts
}

fn saturated(found: &Saturation, simulated_s: f64) -> Fact {
    let Saturation { device, axis, time_s } = found;
    let share = 100.0 * time_s / simulated_s.max(f64::MIN_POSITIVE);
    let note = format!("{share:.0} % of the run: commands beyond range or rate of axis {axis} of {device}");
    summary::fact("saturated", format!("{time_s:.3}"), "s", &note)
}

fn perceived(felt: &PerceivedStiffness) -> Fact {
    let PerceivedStiffness { device, axis, met_by, unit, stiffness, unsettled } = felt;
    let settled = unsettled.as_ref().map_or_else(String::new, |how| format!("; NOT settled: {how}"));
    let note =
        format!("by the hand on axis {axis} of {device}, from where {met_by} meets something{settled}");
    summary::fact("perceived stiffness", format!("{stiffness:.1}"), unit, &note)
}

/// How each axis followed its references.
fn axes(outcome: &Outcome) -> Table {
    let header = [
        "axis",
        "follows",
        "rise (s)",
        "overshoot",
        "settled (s)",
        "rms error",
        "peak error",
        "phase margin",
        "gain margin",
        "bandwidth",
    ];
    let seconds = |time_s: Option<f64>| time_s.map_or(NONE.to_owned(), |time_s| format!("{time_s:.4}"));
    let row = |axis: &AxisOutcome| {
        let AxisOutcome { unit, .. } = axis;
        let LoopFigures { phase_margin_deg, gain_margin, bandwidth_hz, .. } =
            axis.loop_figures.unwrap_or_default();
        let number = |value: Option<f64>, unit: &str| {
            value.map_or(NONE.to_owned(), |value| format!("{value:.1}{unit}"))
        };
        vec![
            format!("{} {}", axis.device, axis.axis),
            axis.reference.to_owned(),
            seconds(axis.rise_time_s),
            axis.overshoot.map_or(NONE.to_owned(), |share| format!("{:.1} %", 100.0 * share)),
            seconds(axis.settling_time_s),
            format!("{:.1e} {unit}", axis.rms_error),
            format!("{:.1e} {unit}", axis.peak_error),
            number(phase_margin_deg, "°"),
            number(gain_margin, ""),
            number(bandwidth_hz, " Hz"),
        ]
    };
    let rows: Vec<Vec<String>> = outcome.axes.iter().map(row).collect();
    let is_usual = outcome.axes.iter().all(|axis| axis.reference == types::DES_POSITION.name);
    // What says nothing takes no room.
    let is_shown = |column: &usize| match column {
        1 => !is_usual,
        _ => rows.iter().any(|row| row.get(*column).is_some_and(|entry| entry != NONE)),
    };
    let shown: Vec<usize> = (0..header.len()).filter(is_shown).collect();
    let pick = |row: &[String]| shown.iter().filter_map(|column| row.get(*column).cloned()).collect();
    Table { header: pick(&header.map(str::to_owned)), rows: rows.iter().map(|row| pick(row)).collect() }
}
