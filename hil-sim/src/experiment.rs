//! A rig with its observers, ready to run.
//!
//! ```text
//!                                               every tick: Recorder and observers watch
//!  rig file ──▶ response ──▶ Experiment ──▶ Rig ─────────────────────────────────────────▶ Run { Outcome, Recording }
//! ```

mod error;

use std::collections::BTreeMap;
use std::fs::File;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::SyncSender;
use std::time::Instant;

pub use error::ExperimentError;

use crate::bus::MediumReport;
use crate::emulated::{Board, BoardKey, EmulatedError, Image};
use crate::observer::Observer;
use crate::observer::channel_energy::ChannelEnergy;
use crate::outcome::{Outcome, RealTime};
use crate::pace::Pace;
use crate::recorder::Recorder;
use crate::recording::{Piece, Recording};
use crate::response::{self, Phases};
use crate::rig::Rig;
use crate::rig_file::RigFile;

/// Ticks between two looks at the progress.
const PROGRESS_TICKS: u64 = 512;
/// Share of late ticks that is a fault: now and then one is normal on a host.
const LATE_SHARE: f64 = 0.01;

/// A rig with its observers, ready to run.
#[derive(Debug)]
pub struct Experiment {
    begun: Instant,
    rig: Rig,
    duration_s: f64,
    /// In the order in which they report.
    observers: Vec<Box<dyn Observer>>,
    /// With what is known before the run.
    outcome: Outcome,
    /// None when nothing is to be kept.
    recorder: Option<Recorder>,
    /// For the recorder; none where there are several channels.
    channel_energy: Option<ChannelEnergy>,
    /// By station: what an emulated board authenticates packets with.
    pub(crate) board_keys: BTreeMap<String, BoardKey>,
    pub(crate) phases: Option<Phases>,
    /// None in virtual time.
    pub(crate) pace: Option<Pace>,
}

/// What a run leaves behind.
#[derive(Debug)]
pub struct Run {
    /// The figures.
    pub outcome: Outcome,
    /// The signals.
    pub recording: Recording,
    /// What the simulated media came to.
    pub media: Vec<MediumReport>,
    /// What broke the run off before its end, beyond what can happen in it.
    pub broken: Option<ExperimentError>,
    /// The rig, as the run left it.
    pub rig: Rig,
    /// When the hand guides, pushes and lets go, in an experiment that has such phases.
    pub phases: Option<Phases>,
}

impl Experiment {
    /// The experiment of a rig file, with all controllers in one process and one virtual time.
    ///
    /// # Errors
    /// [`ExperimentError`] when a device, plant or scheme cannot be made of it.
    pub fn new(file: &RigFile) -> Result<Self, ExperimentError> {
        response::experiment(file)
    }

    /// Observers of a rig that runs for `duration_s`; it was begun to be made at `begun`.
    pub(crate) fn observed(
        begun: Instant,
        rig: Rig,
        duration_s: f64,
        recorder: Recorder,
        observers: Vec<Box<dyn Observer>>,
        outcome: Outcome,
    ) -> Self {
        let channel_energy = ChannelEnergy::of_one_channel(&rig);
        let (recorder, board_keys) = (Some(recorder), BTreeMap::new());
        let (phases, pace) = (None, None);
        Self {
            begun,
            rig,
            duration_s,
            observers,
            outcome,
            recorder,
            channel_energy,
            board_keys,
            phases,
            pace,
        }
    }

    /// Runs the controller of a station as firmware on an emulated board. The firmware's log goes to `log`. Where the
    /// experiment has a key and the image takes one, the firmware authenticates packets.
    ///
    /// # Errors
    /// [`ExperimentError::Emulated`] when image or emulator are missing or do not fit.
    pub fn emulate(
        &mut self,
        station: &str,
        image: &Image,
        log: Option<File>,
    ) -> Result<(), ExperimentError> {
        let key = self.board_keys.get(station).copied().filter(|_| image.is_authenticated());
        let found = self.rig.stations_mut().iter_mut().find(|found| found.name == station);
        if let Some(found) = found {
            let board = Board::start(image, &mut found.dimsart, key, log);
            let emulated = |source: EmulatedError| ExperimentError::Emulated {
                station: station.to_owned(),
                source: source.into(),
            };
            found.move_to(board.map_err(emulated)?);
        }
        Ok(())
    }

    /// The rig, to look at or to change before it runs.
    pub fn rig_mut(&mut self) -> &mut Rig {
        &mut self.rig
    }

    /// Keeps no signals, and takes no memory for them: the run's [`recording`](Run::recording) will be empty.
    #[must_use]
    pub fn without_recording(self) -> Self {
        Self { recorder: None, ..self }
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

    /// Length of the run, `s`.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// Runs to the end, until something leaves its range, or until `stop` is set. `progress` hears the
    /// virtual time, `s`, now and then.
    pub fn run(mut self, stop: &AtomicBool, mut progress: impl FnMut(f64)) -> Run {
        if let Some(recorder) = &mut self.recorder {
            recorder.reserve(self.duration_s / self.rig.period_s());
        }
        self.observers.iter_mut().for_each(|observer| observer.begin());
        let mut broken = None;
        let half_tick_s = 0.5 * self.rig.period_s();
        while self.rig.time_s() < self.duration_s - half_tick_s {
            if stop.load(Ordering::Relaxed) {
                self.outcome.faults.push(format!("stopped by the user at {:.3} s", self.rig.time_s()));
                break;
            }
            if self.rig.ticks().is_multiple_of(PROGRESS_TICKS) {
                progress(self.rig.time_s());
            }
            if let Some(pace) = &mut self.pace {
                pace.wait_for(self.rig.time_s());
            }
            self.rig.tick();
            if let Some((station, source)) = self.rig.trouble() {
                broken = Some(ExperimentError::Emulated { station, source });
                self.outcome.fail(format!("broken off at {:.3} s", self.rig.time_s()));
                break;
            }
            if self.observe() {
                break;
            }
            self.rig.advance();
        }
        progress(self.rig.time_s());
        // The figures of a run that was broken off are those of its beginning.
        self.outcome.is_complete = self.rig.time_s() >= self.duration_s - half_tick_s;
        self.finish(broken)
    }

    /// Has all observers observe the present tick; says whether one of them ends the run.
    fn observe(&mut self) -> bool {
        let Self { rig, observers, recorder, channel_energy, .. } = self;
        if let Some(recorder) = recorder {
            channel_energy.iter_mut().for_each(|energy| energy.add(rig));
            let energy_j = channel_energy.as_ref().map_or_else(Vec::new, ChannelEnergy::energy_j);
            recorder.record(rig, &energy_j);
        }
        observers.iter_mut().fold(false, |ends, observer| observer.observe(rig).is_break() | ends)
    }

    fn finish(mut self, broken: Option<ExperimentError>) -> Run {
        let (rig, outcome) = (self.rig, &mut self.outcome);
        (outcome.ticks, outcome.simulated_s) = (rig.ticks(), rig.time_s());
        for observer in &mut self.observers {
            observer.report(&rig, outcome);
        }
        if let Some(pace) = self.pace {
            outcome.real_time = Some(real_time(&rig, &pace, &mut outcome.faults));
        }
        let media = rig.media();
        outcome.faults.extend(media.iter().flat_map(|medium| medium.faults.clone()));
        outcome.media = media.iter().map(|medium| medium.traffic.clone()).collect();
        outcome.stable &= outcome.undecided.is_empty();
        let recording = self.recorder.map(Recorder::finish).unwrap_or_default();
        outcome.set_wall_s(self.begun.elapsed().as_secs_f64());
        Run { outcome: self.outcome, recording, media, broken, rig, phases: self.phases }
    }
}

/// How well the only station of a rig kept up with the clock.
fn real_time(rig: &Rig, pace: &Pace, faults: &mut Vec<String>) -> RealTime {
    let (late_ticks, ticks) = (pace.late_ticks(), rig.ticks());
    #[expect(clippy::cast_precision_loss, reason = "far fewer ticks than 2^53")]
    if late_ticks as f64 > LATE_SHARE * ticks as f64 {
        faults.push(format!(
            "{late_ticks} of {ticks} ticks were more than a period late: this computer is busy"
        ));
    }
    let side = rig.stations().first().map(|station| station.name.clone()).unwrap_or_default();
    RealTime { side, late_ticks, worst_lateness_s: pace.worst_lateness_s() }
}

/// Runs a rig from its beginning to its end: what a test does.
///
/// # Errors
/// As [`Experiment::new`].
pub fn run(file: &RigFile) -> Result<Run, ExperimentError> {
    Ok(Experiment::new(file)?.run(&AtomicBool::new(false), |_time_s| ()))
}
