//! The experiment of a [rig file](crate::rig_file): its devices are moved as it says, and how they follow is measured.
//!
//! ```text
//! RigFile ──▶ Experiment ──▶ Rig { Station: controller ◀─▶ Instrumented { Joint per axis, references, loads } }
//!                              │ every tick: Recorder, Follow, Perceived, Swings, Watch look on
//!                              ▼
//!                            Run { Outcome, Recording } ──▶ pictures ──▶ Report
//! ```

mod body;
mod build;
mod error;
mod follow;
mod instrumented;
mod live;
mod loop_gain;
mod machine;
mod motion;
mod moves;
mod outcome;
mod part;
mod perceived;
mod probe;
mod references;
mod step_response;

use std::fs::File;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::SyncSender;
use std::time::Instant;

pub use build::{LoadedController, loaded_controllers};
pub use error::ResponseError;
pub use live::{Hold, LiveRig};
pub use loop_gain::LoopFigures;
pub use motion::SamplesError;
pub use outcome::{AxisOutcome, Outcome, PerceivedStiffness};
pub use part::Part;

use follow::Follow;
use loop_gain::UNDECIDED;
use perceived::Perceived;
use probe::AtRest;

use crate::bilateral::border::Border;
use crate::bus::MediumReport;
use crate::emulated::{Board, Image};
use crate::limit_cycle::{LimitCycle, Swings};
use crate::outcome::Received;
use crate::port_energy::PortEnergy;
use crate::reception;
use crate::recorder::Recorder;
use crate::recording::{Piece, Recording};
use crate::rig::Rig;
use crate::rig_file::{DeviceSection, HAND, LOAD, MoveSection, RigFile};
use crate::watch::{Alarm, Ranges, Watch};

/// Ticks between two looks at the progress.
const PROGRESS_TICKS: u64 = 512;

/// A rig made of a file, ready to run.
#[derive(Debug)]
pub struct Experiment {
    rig: Rig,
    duration_s: f64,
    ranges: Vec<Ranges>,
    follows: Vec<Follow>,
    loops: Vec<AxisLoop>,
    perceived: Vec<Perceived>,
    swings: Swings,
    border: Option<Border>,
    port_energy: PortEnergy,
    /// Whether hands and loads alone move it: then its controllers have no energy but what they get.
    is_led_by_hand: bool,
    /// None when nothing is to be kept.
    recorder: Option<Recorder>,
}

/// The loop around an axis.
#[derive(Debug)]
struct AxisLoop {
    station: usize,
    axis: usize,
    /// None where it is not linear.
    free: Option<LoopFigures>,
    /// The same with every axis held by its wall; none without one.
    in_contact: Option<LoopFigures>,
}

/// What a run leaves behind.
#[derive(Debug)]
pub struct Run {
    /// The figures.
    pub outcome: Outcome,
    /// The signals.
    pub recording: Recording,
    /// What the buses came to.
    pub media: Vec<MediumReport>,
    /// What broke the run off before its end, beyond what can happen in it.
    pub broken: Option<ResponseError>,
    /// The rig, as the run left it.
    pub rig: Rig,
}

impl Experiment {
    /// All controllers in one process and one virtual time.
    ///
    /// # Errors
    /// [`ResponseError`] when a device, plant or scheme cannot be made of the file.
    pub fn new(file: &RigFile) -> Result<Self, ResponseError> {
        let (mut rig, parts) = (build::rig(file, None)?, Part::of_all(file));
        let (mut follows, mut loops, mut at_rest) = (Vec::new(), Vec::new(), AtRest::new(file, false)?);
        let meets = |section: &DeviceSection| section.axes.iter().any(|axis| axis.wall.is_some());
        let mut at_walls = file.devices.iter().any(meets).then(|| AtRest::new(file, true)).transpose()?;
        for (station, part) in parts.iter().enumerate() {
            follows.extend(moves::follows(file, part, station)?);
            let is_probed = file.experiment.margins && part.device.moves();
            let axes = if is_probed { part.axes.len() } else { 0 };
            for axis in 0..axes {
                let free = at_rest.loop_figures(station, axis)?;
                let in_contact = at_walls.as_mut().map(|at_walls| at_walls.loop_figures(station, axis));
                let in_contact = in_contact.transpose()?.flatten();
                loops.push(AxisLoop { station, axis, free, in_contact });
            }
        }
        let rests_s = parts.iter().map(|part| moves::long_rests_s(file, part));
        let rests_s: Vec<_> = rests_s.collect::<Result<_, _>>()?;
        let swings = Swings::new(&rig, |station| rests_s.get(station).cloned().unwrap_or_default());
        let border = Border::of(file, &mut rig);
        let recorder = Some(Recorder::new(&rig, &file.record)?);
        let ranges = parts.iter().map(|part| part.device.ranges()).collect();
        let brings_energy =
            |moved: &MoveSection| ![HAND, LOAD].contains(&moved.on.as_str()) && !moved.is_constant();
        let is_led_by_hand = !file.experiment.moves.iter().any(brings_energy);
        let (duration_s, perceived) = (file.duration_s, Perceived::of_all(file)?);
        let port_energy = PortEnergy::default();
        Ok(Self {
            rig,
            duration_s,
            ranges,
            follows,
            loops,
            perceived,
            swings,
            border,
            port_energy,
            is_led_by_hand,
            recorder,
        })
    }

    /// Keeps no signals, and takes no memory for them: the run's recording will be empty.
    #[must_use]
    pub fn without_recording(self) -> Self {
        Self { recorder: None, ..self }
    }

    /// Lets every controller run as firmware on an emulated board of its own; `log` gives the file of a device's log.
    ///
    /// # Errors
    /// [`ResponseError::Emulated`] when image or emulator are not there or not the right ones.
    pub fn emulate(
        &mut self,
        image: &Image,
        mut log: impl FnMut(&str) -> Option<File>,
    ) -> Result<(), ResponseError> {
        for station in self.rig.stations_mut() {
            let device = station.name.clone();
            let board = Board::start(image, &mut station.dimsart, None, log(&device));
            station.move_to(board.map_err(|source| ResponseError::Emulated { device, source })?);
        }
        Ok(())
    }

    /// The rig, to look at or to change before it runs.
    pub fn rig_mut(&mut self) -> &mut Rig {
        &mut self.rig
    }

    /// Tells `listener` every row of the run as it is recorded; see [`Recorder::tell`].
    pub fn tell(&mut self, listener: SyncSender<Piece>) {
        if let Some(recorder) = &mut self.recorder {
            recorder.tell(listener);
        }
    }

    /// Keeps of a long run what pictures need, in memory that does not grow with its length. A [listener](Self::tell) hears
    /// every row.
    pub fn keep_for_pictures(&mut self) {
        if let Some(recorder) = &mut self.recorder {
            recorder.keep_for_pictures();
        }
    }

    /// Runs to the end, until something leaves its range, or until `stop` is set. `progress` hears the
    /// virtual time, `s`, now and then.
    pub fn run(mut self, stop: &AtomicBool, mut progress: impl FnMut(f64)) -> Run {
        let start = Instant::now();
        let mut watch = Watch::new(&self.rig, self.ranges.iter().copied());
        let mut faults = self.unstable_loops();
        let (mut is_stable, mut broken) = (faults.is_empty(), None);
        let half_tick_s = 0.5 * self.rig.period_s();
        while self.rig.time_s() < self.duration_s - half_tick_s {
            if stop.load(Ordering::Relaxed) {
                faults.push(format!("stopped by the user at {:.3} s", self.rig.time_s()));
                break;
            }
            if self.rig.ticks().is_multiple_of(PROGRESS_TICKS) {
                progress(self.rig.time_s());
            }
            self.rig.tick();
            if let Some((device, source)) = self.rig.trouble() {
                broken = Some(ResponseError::Emulated { device, source });
                faults.push(format!("broken off at {:.3} s", self.rig.time_s()));
                is_stable = false;
                break;
            }
            self.look();
            match watch.look(&self.rig) {
                None => {}
                Some(Alarm::LinkLost(lost)) => faults.extend(lost),
                Some(Alarm::Grows(fault)) => {
                    faults.push(fault);
                    is_stable = false;
                }
                Some(Alarm::Left(fault)) => {
                    faults.push(fault);
                    is_stable = false;
                    break;
                }
            }
            self.rig.advance();
        }
        progress(self.rig.time_s());
        // Of a run that was broken off, nothing can be said.
        let is_over = self.rig.time_s() >= self.duration_s - half_tick_s;
        let limit_cycles = if is_over { self.swings.found(&self.rig, &mut faults) } else { Vec::new() };
        is_stable &= !limit_cycles.iter().any(|cycle| cycle.is_chatter);
        Run { broken, ..self.finish(start.elapsed().as_secs_f64(), is_stable, limit_cycles, faults) }
    }

    /// Has all that measures look at the present tick.
    fn look(&mut self) {
        let Self { rig, follows, perceived, swings, port_energy, recorder, .. } = self;
        if let Some(recorder) = recorder {
            recorder.record(rig, &[]);
        }
        let time_s = rig.time_s();
        for follow in follows {
            if let Some(station) = rig.stations().get(follow.station) {
                follow.add(time_s, station);
            }
        }
        for axis in perceived {
            axis.add(rig);
        }
        swings.add(rig);
        port_energy.add(rig);
    }

    fn device_name(&self, station: usize) -> &str {
        self.rig.stations().get(station).map_or("", |station| &station.name)
    }

    /// Loops whose disturbances do not die out, in words.
    fn unstable_loops(&self) -> Vec<String> {
        let said = |of: &AxisLoop, figures: Option<LoopFigures>, place: &str| {
            let growth = figures?.growth_per_tick.filter(|growth| *growth >= 1.0 - UNDECIDED)?;
            let what = match growth > 1.0 + UNDECIDED {
                true => "is unstable: a disturbance grows",
                false => "is at its limit: a disturbance stays, or changes too slowly to tell",
            };
            let (axis, device) = (of.axis, self.device_name(of.station));
            Some(format!("the loop of axis {axis} of {device}{place} {what}, {growth:.5} per tick"))
        };
        let both = |of: &AxisLoop| [said(of, of.free, ""), said(of, of.in_contact, " in contact")];
        self.loops.iter().flat_map(both).flatten().collect()
    }

    fn finish(
        mut self,
        wall_s: f64,
        stable: bool,
        limit_cycles: Vec<LimitCycle>,
        mut faults: Vec<String>,
    ) -> Run {
        let media = self.rig.media();
        faults.extend(media.iter().flat_map(|medium| medium.faults.clone()));
        let perceived = self.perceived.iter_mut().filter_map(|axis| axis.outcome(&self.rig)).collect();
        let loop_of = |follow: &Follow| {
            self.loops.iter().find(|of| (of.station, of.axis) == (follow.station, follow.axis))
        };
        let axes = self.follows.iter().filter(|follow| follow.has_followed()).map(|follow| {
            let found = loop_of(follow);
            let in_contact = found.and_then(|of| of.in_contact);
            let contact_growth_per_tick = in_contact.and_then(|figures| figures.growth_per_tick);
            let outcome = follow.outcome(self.device_name(follow.station), found.and_then(|of| of.free));
            AxisOutcome { contact_growth_per_tick, ..outcome }
        });
        let simulated_s = self.rig.time_s();
        let received: Vec<_> = self.rig.stations().iter().filter_map(reception::received).collect();
        let [lost_packets, superseded_packets, refused_packets] = Received::sums(&received);
        let outcome = Outcome {
            stable,
            ticks: self.rig.ticks(),
            simulated_s,
            wall_s,
            realtime_factor: simulated_s / wall_s.max(f64::MIN_POSITIVE),
            axes: axes.collect(),
            perceived,
            energy_ports_min_j: self.is_led_by_hand.then(|| self.port_energy.smallest_j()),
            limit_cycles,
            theory: self.border,
            media: media.iter().map(|medium| medium.traffic.clone()).collect(),
            received,
            lost_packets,
            superseded_packets,
            refused_packets,
            faults,
        };
        Run {
            outcome,
            media,
            broken: None,
            rig: self.rig,
            recording: self.recorder.map(Recorder::finish).unwrap_or_default(),
        }
    }
}

/// Runs a rig from its beginning to its end: what a test does.
///
/// # Errors
/// As [`Experiment::new`].
pub fn run(file: &RigFile) -> Result<Run, ResponseError> {
    Ok(Experiment::new(file)?.run(&AtomicBool::new(false), |_time_s| ()))
}
