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
mod closed_loop;
mod controller_model;
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
mod plant_model;
mod poles;
mod probe;
mod references;
mod saturation;
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
pub use saturation::Saturation;

use controller_model::Place;
use follow::Follow;
use perceived::Perceived;
use poles::UNDECIDED;
use saturation::Saturated;

use crate::bilateral::border::Border;
use crate::bus::MediumReport;
use crate::emulated::{Board, Image};
use crate::limit_cycle::{LimitCycle, Swings};
use crate::outcome::Received;
use crate::port_energy::PortEnergy;
use crate::reception::{received, silences};
use crate::recorder::Recorder;
use crate::recording::{Piece, Recording};
use crate::rig::Rig;
use crate::rig_file::{HAND, LOAD, MoveSection, RigFile};
use crate::watch::{Alarm, Ranges, Watch};

/// Ticks between two looks at the progress.
const PROGRESS_TICKS: u64 = 512;

/// A rig made of a file, ready to run.
#[derive(Debug)]
pub struct Experiment {
    begun: Instant,
    rig: Rig,
    duration_s: f64,
    ranges: Vec<Ranges>,
    follows: Vec<Follow>,
    loops: Vec<AxisLoop>,
    perceived: Vec<Perceived>,
    swings: Swings,
    saturated: Vec<Saturated>,
    border: Option<Border>,
    port_energy: PortEnergy,
    /// Whether hands and loads alone move it: then its controllers have no energy but what they get.
    is_led_by_hand: bool,
    /// None when nothing is to be kept.
    recorder: Option<Recorder>,
}

/// The loop around an axis.
#[derive(Debug, Default)]
struct AxisLoop {
    station: usize,
    /// Among those of the station.
    axis: usize,
    /// None where it is not linear.
    free: Option<LoopFigures>,
    /// The same with every axis held by its wall; none without one.
    in_contact: Option<LoopFigures>,
}

impl AxisLoop {
    /// One that is not linear.
    fn unknown(at: Place) -> Self {
        Self { station: at.station, axis: at.place, ..Self::default() }
    }
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
        let begun = Instant::now();
        let (mut rig, parts) = (build::rig(file)?, Part::of_all(file));
        let mut follows = Vec::new();
        for (station, part) in parts.iter().enumerate() {
            follows.extend(moves::follows(file, part, station)?);
        }
        let loops = if file.experiment.margins { probe::loops(file)? } else { Vec::new() };
        let rests_s = parts.iter().map(|part| moves::long_rests_s(file, part));
        let rests_s: Vec<_> = rests_s.collect::<Result<_, _>>()?;
        let swings = Swings::new(&rig, |station| rests_s.get(station).cloned().unwrap_or_default());
        let saturated = Saturated::of_all(&rig);
        let border = Border::of(file, &mut rig);
        let recorder = Some(Recorder::new(&rig, &file.record)?);
        let ranges = parts.iter().map(|part| part.device.ranges()).collect();
        let brings_energy =
            |moved: &MoveSection| ![HAND, LOAD].contains(&moved.on.as_str()) && !moved.is_constant();
        let is_led_by_hand = !file.experiment.moves.iter().any(brings_energy);
        let (duration_s, perceived) = (file.duration_s, Perceived::of_all(file)?);
        let port_energy = PortEnergy::default();
        Ok(Self {
            begun,
            rig,
            duration_s,
            ranges,
            follows,
            loops,
            perceived,
            swings,
            saturated,
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
        let mut watch = Watch::new(&self.rig, self.ranges.iter().copied());
        let (mut faults, mut undecided) = self.unstable_loops();
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
        let limit_cycles = match is_over {
            true => self.swings.found(&self.rig, &mut faults, &mut undecided),
            false => Vec::new(),
        };
        is_stable &= undecided.is_empty() && !limit_cycles.iter().any(|cycle| cycle.is_chatter);
        let stations = self.rig.stations().iter();
        for silence in stations.flat_map(|station| silences(station, self.rig.ticks())) {
            is_stable &= !silence.is_refusal;
            faults.push(silence.text);
        }
        Run { broken, ..self.finish(is_stable, limit_cycles, faults, undecided) }
    }

    /// Has all that measures look at the present tick.
    fn look(&mut self) {
        let Self { rig, follows, perceived, swings, saturated, port_energy, recorder, .. } = self;
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
        saturated.iter_mut().zip(rig.stations()).for_each(|(saturated, station)| saturated.add(station));
        port_energy.add(rig);
    }

    fn device_name(&self, station: usize) -> &str {
        self.rig.stations().get(station).map_or("", |station| &station.name)
    }

    /// Loops in which a disturbance grows, and those in which that is undecided, in words.
    fn unstable_loops(&self) -> (Vec<String>, Vec<String>) {
        let (mut unstable, mut undecided) = (Vec::new(), Vec::new());
        for of in &self.loops {
            for (figures, place) in [(of.free, ""), (of.in_contact, " in contact")] {
                let Some(growth) = figures.and_then(|figures| figures.growth_per_tick) else { continue };
                let the_loop =
                    format!("the loop of axis {} of {}{place}", of.axis, self.device_name(of.station));
                if growth > 1.0 + UNDECIDED {
                    unstable
                        .push(format!("{the_loop} is unstable: a disturbance grows by {growth:.5} per tick"));
                } else if growth >= 1.0 - UNDECIDED {
                    undecided.push(format!(
                        "{the_loop} is at its stability limit: a disturbance changes by less than 1e-5 per tick; change a \
                         gain to decide"
                    ));
                }
            }
        }
        (unstable, undecided)
    }

    fn finish(
        mut self,
        stable: bool,
        limit_cycles: Vec<LimitCycle>,
        mut faults: Vec<String>,
        undecided: Vec<String>,
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
        let axes = axes.collect();
        let saturated =
            self.saturated.iter().enumerate().flat_map(|(station, saturated)| {
                saturated.found(self.device_name(station), self.rig.period_s())
            });
        let saturated = saturated.collect();
        let simulated_s = self.rig.time_s();
        let received: Vec<_> = self.rig.stations().iter().filter_map(received).collect();
        let [lost_packets, superseded_packets, refused_packets] = Received::sums(&received);
        let recording = self.recorder.map(Recorder::finish).unwrap_or_default();
        let wall_s = self.begun.elapsed().as_secs_f64();
        let outcome = Outcome {
            stable,
            ticks: self.rig.ticks(),
            simulated_s,
            wall_s,
            realtime_factor: simulated_s / wall_s.max(f64::MIN_POSITIVE),
            axes,
            perceived,
            energy_ports_min_j: self.is_led_by_hand.then(|| self.port_energy.smallest_j()),
            limit_cycles,
            saturated,
            theory: self.border,
            media: media.iter().map(|medium| medium.traffic.clone()).collect(),
            received,
            lost_packets,
            superseded_packets,
            refused_packets,
            faults,
            undecided,
        };
        Run { outcome, media, broken: None, rig: self.rig, recording }
    }
}

/// Runs a rig from its beginning to its end: what a test does.
///
/// # Errors
/// As [`Experiment::new`].
pub fn run(file: &RigFile) -> Result<Run, ResponseError> {
    Ok(Experiment::new(file)?.run(&AtomicBool::new(false), |_time_s| ()))
}
