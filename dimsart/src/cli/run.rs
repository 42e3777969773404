//! `dimsart run`: simulates a rig and writes a report.

use std::error::Error;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use clap::{Args, Parser};
use dimsart_core::ModuleKinds;
use indicatif::{ProgressBar, ProgressStyle};

use super::line::seconds;
use super::output::say;
use super::{Ending, NOT_STABLE, UsageError, summary};
use crate::pictures;
use crate::recorder_files::{self, RecorderFile};
use crate::report::{
    self, BusTimeline, Report, ReportError, ReportFiles, RunMetadata, SignalsFile, SignalsFormat, SignalsKind,
};
use crate::rig_argument;
use crate::tick_map::tick_maps;
use hil_sim::bus::time::seconds_to_ns;
use hil_sim::emulated::{self, Image};
use hil_sim::experiment::{self, Experiment, ExperimentError};
use hil_sim::key_file;
use hil_sim::link::InProcessParameters;
use hil_sim::response::{SingleStation, one_station};
use hil_sim::rig::{Rig, Station};
use hil_sim::rig_file::{DEFAULT_RIG_NAME, LinkSection, RigFile};

/// Simulate a rig and write a report; with --side, run one station in real time.
///
/// The report has figures, plots, step responses, margins and limit cycles. signals.csv grows during the run. With
/// --signals mcap, the run writes signals.mcap instead: signals in CDR with message definitions, for Foxglove and
/// `PlotJuggler`, and settings, schemes and all inputs, for `dimsart replay`. Rig files: docs/rigs.md.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES, after_long_help = help())]
pub(super) struct Run {
    /// Rig or file of settings (TOML), or shipped rig (default: bilateral).
    rig: Option<PathBuf>,
    /// Change a setting, such as `link.loss=0.1`; repeatable.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Folder of the report (default: runs/latest, or runs/CONTROLLER with --side).
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Run only this controller's station, in real time.
    ///
    /// The other station runs in another process; both exchange packets over UDP, a serial port or CAN
    /// (`link.master_address`). With `link.key_file`, these packets are authenticated.
    #[arg(long, value_name = "CONTROLLER")]
    side: Option<String>,
    /// Maximum time to wait for the other station, s.
    #[arg(long, value_name = "SECONDS", default_value = "60", requires = "side", value_parser = seconds)]
    wait_s: Duration,
    /// Run controllers as firmware on an emulated board, in lockstep.
    #[arg(long, value_name = "BOARD", conflicts_with = "side", value_parser = [emulated::BOARD])]
    target: Option<String>,
    /// Controller to run on the emulated board, or `both` for all controllers (default).
    #[arg(long, value_name = "CONTROLLER", requires = "target")]
    target_side: Option<String>,
    /// Firmware image (default: built by `cargo board mps2-an386`).
    #[arg(long, value_name = "PATH", requires = "target")]
    image: Option<PathBuf>,
    /// Print the figures as one JSON object; tables go to standard error.
    #[arg(long)]
    json: bool,
    /// Exit with status 3 if the run was unstable.
    #[arg(long)]
    fail_if_unstable: bool,
    /// Do not write a report.
    #[arg(long)]
    no_report: bool,
    /// Format of the signals file.
    #[arg(long, value_name = "FORMAT", default_value = "csv", conflicts_with = "no_report")]
    signals: SignalsKind,
    /// Print a shipped rig with all settings, defaults and meanings, and exit.
    #[arg(long)]
    keys: bool,
}

/// Time for an ended emulator to remove its files.
const TO_CLEAN_UP: Duration = Duration::from_millis(500);
/// Update interval of a spinner.
const SPINNER: Duration = Duration::from_millis(100);

/// `--target-side` for all controllers.
const BOTH: &str = "both";

/// Frequently changed settings.
const USUAL_SETTINGS: &[&str] = &[
    "seed",
    "duration_s",
    "dof",
    "environment",
    "link.forward_delay_ticks",
    "link.backward_delay_ticks",
    "link.loss",
    "link.stale",
    "wave.impedance_n_s_per_m",
    "wave.form",
    "master.scheme",
    "master.stiffness_n_per_m",
    "slave.stiffness_n_per_m",
    "hand.contact_force_n",
    "wall.stiffness_n_per_m",
    "record.every_ticks",
];

const EXAMPLES: &str = "\
Examples:
  dimsart run                                                two stations and a delayed link
  dimsart run joint                                          one joint: a position loop and a step
  dimsart run --set link.forward_delay_ticks=200             0.2 s of delay to the slave
  dimsart run --set wave.form=printed --out runs/printed     wave order as printed in the paper; diverges
  dimsart run --set link.carrier=can_fd                      the link over a simulated CAN FD bus
  dimsart run --set link.key_file=link.key                   authenticated packets
  dimsart run scenarios/space_link.toml                      a link to a robot in orbit: low rate, delay and loss
  dimsart run --keys > my.toml                               a rig file to start from
  dimsart run joint --keys > my.toml                         a rig file of one joint
  dimsart run my.toml --set seed=7 --no-report --json        figures for programs
  dimsart run --side master                                  two processes, in two terminals:
  dimsart run --side slave                                   real time over UDP
  dimsart run --target mps2-an386                            both sides as firmware on emulated boards

A run first removes the previous report in the output folder. Ctrl-C ends the run early and writes the report; a second
Ctrl-C ends the report.

Exit status: 0 run completed, also if unstable; 1 error; 2 wrong usage; 3 unstable, with --fail-if-unstable.";

fn help() -> String {
    // Reading the shipped rig is slow: only for help.
    match std::env::args().any(|argument| ["help", "--help"].contains(&argument.as_str())) {
        true => {
            format!(
                "{EXAMPLES}\n\nFrequently changed settings and their defaults (--keys prints all settings):{}",
                usual_settings()
            )
        }
        false => String::new(),
    }
}

fn usual_settings() -> String {
    let line = |name: &&str| {
        let (default, meaning) = RigFile::shipped_setting(DEFAULT_RIG_NAME, name)?;
        let setting = format!("{name}={}", default.as_deref().unwrap_or("..."));
        Some(format!("\n  {setting:<38} {meaning}"))
    };
    USUAL_SETTINGS.iter().filter_map(line).collect()
}

impl Default for Run {
    /// The arguments of an empty command line.
    fn default() -> Self {
        #[derive(Parser)]
        struct Alone {
            #[command(flatten)]
            run: Run,
        }
        Alone::parse_from(["run"]).run
    }
}

impl Run {
    pub(super) fn execute(self, kinds: ModuleKinds, out: &mut impl Write) -> Ending {
        if self.keys {
            let rig = self.rig.as_deref().and_then(Path::to_str).and_then(RigFile::shipped);
            let usual = RigFile::shipped(DEFAULT_RIG_NAME).unwrap_or_default();
            writeln!(out, "{}", rig.unwrap_or(usual).trim_end())?;
            return Ok(ExitCode::SUCCESS);
        }
        let file = rig_argument::read(self.rig.as_deref(), &self.sets, kinds)?;
        self.check_names(&file)?;
        let keys = file.links.iter().filter_map(|link| Some(file.resolve(link.key_file.as_deref()?)));
        if let Some(warning) = keys.filter_map(|key| key_file::permission_warning(&key)).next() {
            eprintln!("dimsart: warning: {warning}");
        }
        let begun = Instant::now();
        let folder = self.folder();
        if !self.no_report {
            // Fail before the run, not after it.
            report::check_folder_writable(&folder)?;
        }
        let stop = stop_on_interrupt()?;
        let mut experiment = self.experiment(&file, &stop)?;
        if self.no_report {
            experiment = experiment.without_recording();
        }
        experiment.record_for_figures();
        if stop.load(Ordering::Relaxed) {
            return Err("interrupted before the run started".into());
        }
        self.move_to_target(&mut experiment, &folder)?;
        let mut signals = None;
        if !self.no_report {
            let stems = pictures::file_stems(&file);
            let stems: Vec<&str> = stems.iter().map(String::as_str).collect();
            let format = self.signals_format(file.to_toml(), experiment.rig_mut());
            let (file, listener) = SignalsFile::create(&folder, &stems, format)?;
            experiment.add_listener(listener);
            signals = Some(file);
        }
        let bar = progress_bar(experiment.duration_s());
        let mut run = experiment.run(&stop, |time_s| bar.set_position(milliseconds(time_s)));
        bar.finish_and_clear();
        // The next Ctrl-C ends the report.
        stop.store(false, Ordering::Relaxed);
        let report = |signals: SignalsFile| {
            signals.finish()?;
            let recorders = write_recorders(&folder, &mut run.rig)?;
            self.write_report(&folder, &file, &run, recorders, &stop)
        };
        let written = signals.map(report).transpose();
        run.outcome.set_wall_s(begun.elapsed().as_secs_f64());
        say(self.json, out, |text| {
            summary::print(text, &run.outcome)?;
            match &written {
                Ok(Some(written)) => print_written(text, &folder, written),
                _ => Ok(()),
            }
        })?;
        if self.json {
            writeln!(out, "{}", serde_json::to_string(&run.outcome)?)?;
        }
        written?;
        run.error.map_or(Ok(self.status(run.outcome.stable)), |broken| Err(broken.into()))
    }

    /// Exit status of a run.
    fn status(&self, is_stable: bool) -> ExitCode {
        if is_stable || !self.fail_if_unstable { ExitCode::SUCCESS } else { ExitCode::from(NOT_STABLE) }
    }

    /// Format of the signals file. For MCAP, the rig records the inputs of its controllers from now on.
    fn signals_format(&self, settings_toml: String, rig: &mut Rig) -> SignalsFormat {
        match self.signals {
            SignalsKind::Csv => SignalsFormat::Csv,
            SignalsKind::Mcap => {
                rig.stations_mut().iter_mut().for_each(Station::record_inputs);
                let facts = RunMetadata::new(settings_toml, rig);
                SignalsFormat::Mcap(if self.side.is_some() { facts.in_real_time() } else { facts })
            }
        }
    }

    fn folder(&self) -> PathBuf {
        let default = || Path::new("runs").join(self.side.as_deref().unwrap_or("latest"));
        self.out.clone().unwrap_or_else(default)
    }

    /// Checks that the rig has the controllers of `--side` and `--target-side`.
    fn check_names(&self, file: &RigFile) -> Result<(), UsageError> {
        let names: Vec<&str> = file.controllers.iter().map(|controller| controller.name()).collect();
        let is_wrong = |name: &&str| !names.contains(name);
        let target = self.target_side.as_deref().filter(|name| *name != BOTH);
        if let Some(name) = self.side.as_deref().into_iter().chain(target).find(is_wrong) {
            let known = names.join(", ");
            return Err(UsageError(format!(
                "unknown controller {name}; controllers of this rig: {known} (`dimsart run --help`)"
            )));
        }
        let cannot = self.side.as_deref().filter(|name| SingleStation::of(file, name).is_none());
        cannot.map_or(Ok(()), |name| {
            Err(UsageError(format!(
                "--side {name}: the rig needs a [[link]] with an `address` from {name} to another controller, and a [[link]] \
                 in the opposite direction"
            )))
        })
    }

    fn experiment(&self, file: &RigFile, stop: &AtomicBool) -> Result<Experiment, ExperimentError> {
        let alone = self.side.as_deref().and_then(|name| SingleStation::of(file, name));
        let Some(alone) = alone else {
            if !file.experiment.margins {
                return Experiment::new(file);
            }
            let spinner = ProgressBar::new_spinner().with_message("analysing loops");
            spinner.enable_steady_tick(SPINNER);
            let experiment = Experiment::new(file);
            spinner.finish_and_clear();
            return experiment;
        };
        if !file.links.iter().all(is_ideal) {
            eprintln!(
                "dimsart: note: --side uses a real link: link.carrier, delays, jitter, loss, duplication and reordering of \
                 the rig are ignored"
            );
        }
        let (name, other) = (alone.own.name(), alone.other.name());
        eprintln!(
            "{name} at {}: waiting up to {} s for the {other} at {} (start: `dimsart run --side {other}`)",
            alone.own_address,
            self.wait_s.as_secs_f64(),
            alone.peer_address(),
        );
        one_station(file, name, self.wait_s, stop)
    }

    /// Starts the firmware of controllers on the target. Its log is written to the folder of the report.
    fn move_to_target(&self, experiment: &mut Experiment, folder: &Path) -> Result<(), Box<dyn Error>> {
        if self.target.is_none() {
            return Ok(());
        }
        let image = Image::find(self.image.as_deref())?;
        if !self.no_report {
            report::make_folder(folder)?;
        }
        emulated::pin_to_current_cpu();
        let wanted = self.target_side.as_deref().filter(|name| *name != BOTH);
        let names = experiment.rig_mut().stations().iter().map(|station| station.name.clone());
        for name in names.filter(|name| wanted.is_none_or(|wanted| wanted == name)).collect::<Vec<_>>() {
            let path = folder.join(format!("firmware-{name}.log"));
            let log = (!self.no_report).then(|| File::create(path)).transpose()?;
            experiment.emulate(&name, &image, log)?;
        }
        Ok(())
    }

    fn write_report(
        &self,
        folder: &Path,
        file: &RigFile,
        run: &experiment::Run,
        recorders: Vec<RecorderFile>,
        stop: &AtomicBool,
    ) -> Result<ReportFiles, ReportError> {
        let report = Report {
            title: pictures::title(file, self.side.as_deref()),
            summary: summary::facts(&run.outcome),
            axes: summary::axes(&run.outcome),
            faults: run.outcome.faults.iter().chain(&run.outcome.undecided).cloned().collect(),
            figures: pictures::figures(file, run, self.side.as_deref()),
            tick_maps: tick_maps(&run.rig),
            bus: BusTimeline::of(&run.media, seconds_to_ns(file.sample_period_s)),
            settings_toml: file.to_toml(),
            recording: &run.recording,
            signals: self.signals,
            recorders,
        };
        let bar = ProgressBar::new(0);
        bar.set_style(style("report     [{bar:40}] {pos}/{len} files"));
        let written = report::write(folder, &report, stop, &bar);
        bar.finish_and_clear();
        written
    }
}

/// Writes the rows of the controllers' recorders; unreadable rows are reported as notes.
fn write_recorders(folder: &Path, rig: &mut Rig) -> Result<Vec<RecorderFile>, ReportError> {
    recorder_files::write(folder, rig, |note| eprintln!("dimsart: note: {note}"))
}

/// Prints the paths of the written files.
fn print_written(out: &mut dyn Write, folder: &Path, written: &ReportFiles) -> std::io::Result<()> {
    for RecorderFile { name, content } in &written.recorders {
        writeln!(out, "recorder: {}: {content}", folder.join(name).display())?;
    }
    writeln!(out, "report: {}", written.page.display())
}

/// Whether a link only delays packets.
fn is_ideal(link: &LinkSection) -> bool {
    let InProcessParameters { jitter_ticks, loss, duplication, reordering, .. } = link.carrier;
    let is_on_none = link.bus.as_deref().is_none_or(|bus| bus == "ideal");
    is_on_none && jitter_ticks == 0 && [loss, duplication, reordering].iter().all(|share| *share <= 0.0)
}

/// Installs a handler and returns the flag that Ctrl-C or SIGTERM sets. A second Ctrl-C ends emulators and the process at once.
pub(super) fn stop_on_interrupt() -> Result<Arc<AtomicBool>, ctrlc::Error> {
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    ctrlc::set_handler(move || {
        if flag.swap(true, Ordering::Relaxed) {
            if emulated::terminate_emulators() {
                std::thread::sleep(TO_CLEAN_UP);
            }
            std::process::exit(130);
        }
    })?;
    Ok(stop)
}

fn progress_bar(duration_s: f64) -> ProgressBar {
    let bar = ProgressBar::new(milliseconds(duration_s));
    bar.set_style(style("simulating [{bar:40}] {percent}% of {msg} s, {eta} left"));
    bar.set_message(format!("{duration_s:.1}"));
    bar.enable_steady_tick(Duration::from_millis(100));
    bar
}

/// A style from a constant template; the default style if it is invalid.
pub(super) fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}

fn milliseconds(time_s: f64) -> u64 {
    u64::try_from(Duration::from_secs_f64(time_s).as_millis()).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_help_shows_every_usual_setting_with_its_default() {
        let help = usual_settings();
        for setting in USUAL_SETTINGS {
            assert!(help.contains(&format!("\n  {setting}=")), "{setting} is no setting any more");
        }
        assert!(help.contains("link.loss=0.0 "), "{help}");
    }
}
