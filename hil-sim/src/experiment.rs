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
use crate::pace::TickPacer;
use crate::phases::Phases;
use crate::recorder::Recorder;
use crate::recording::{Recording, RecordingChunk};
use crate::rig::Rig;
use crate::rig_file::RigFile;

/// Ticks between two progress reports.
const PROGRESS_TICKS: u64 = 512;
/// Share of late ticks that is a fault; a few late ticks are normal on a host.
const LATE_SHARE: f64 = 0.01;

/// A rig with its observers, ready to run.
#[derive(Debug)]
pub struct Experiment {
    begun: Instant,
    rig: Rig,
    duration_s: f64,
    /// In reporting order.
    observers: Vec<Box<dyn Observer>>,
    /// Outcome, with results that are known before the run.
    pub(crate) outcome: Outcome,
    /// `None` if no signals are recorded.
    recorder: Option<Recorder>,
    /// Channel energy for the recorder; `None` for several channels.
    channel_energy: Option<ChannelEnergy>,
    /// Key of each station's emulated board.
    pub(crate) board_keys: BTreeMap<String, BoardKey>,
    pub(crate) phases: Option<Phases>,
    /// `None` in virtual time.
    pub(crate) pace: Option<TickPacer>,
}

/// Results of a run.
#[derive(Debug)]
pub struct Run {
    /// Figures.
    pub outcome: Outcome,
    /// Recorded signals.
    pub recording: Recording,
    /// Reports of the simulated media.
    pub media: Vec<MediumReport>,
    /// Error that aborted the run.
    pub error: Option<ExperimentError>,
    /// The rig at the end of the run.
    pub rig: Rig,
    /// Times at which the hand guides, presses and releases, if the experiment has these phases.
    pub phases: Option<Phases>,
}

impl Experiment {
    /// Creates an experiment of `duration_s` from a rig and observers; its construction started at `begun`.
    pub(crate) fn observed(
        begun: Instant,
        rig: Rig,
        duration_s: f64,
        recorder: Recorder,
        observers: Vec<Box<dyn Observer>>,
        outcome: Outcome,
    ) -> Self {
        let channel_energy = ChannelEnergy::between_two_stations(&rig);
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

    /// Runs the controller of a station as firmware on an emulated board; the firmware's log is written to `log`.
    /// With a key, and an image that supports keys, the firmware authenticates packets.
    ///
    /// # Errors
    /// [`ExperimentError::Emulated`] if image or emulator are missing or incompatible.
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
            found.run_on_board(board.map_err(emulated)?);
        }
        Ok(())
    }

    /// Returns the rig, for inspection or changes before the run.
    pub fn rig_mut(&mut self) -> &mut Rig {
        &mut self.rig
    }

    /// Disables recording and its memory: the run's [`recording`](Run::recording) is empty.
    #[must_use]
    pub fn without_recording(self) -> Self {
        Self { recorder: None, ..self }
    }

    /// Sends every recorded row to `listener`; see [`Recorder::add_listener`].
    pub fn add_listener(&mut self, listener: SyncSender<RecordingChunk>) {
        if let Some(recorder) = &mut self.recorder {
            recorder.add_listener(listener);
        }
    }

    /// Limits the recording to the rows needed for pictures, independent of the length of the run. A
    /// [listener](Self::add_listener) still receives every row.
    pub fn record_for_figures(&mut self) {
        if let Some(recorder) = &mut self.recorder {
            recorder.record_for_figures();
        }
    }

    /// Returns the length of the run, `s`.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// Runs until the end, a range violation, or `stop`. Calls `progress` regularly with the virtual time, `s`.
    pub fn run(mut self, stop: &AtomicBool, mut progress: impl FnMut(f64)) -> Run {
        if let Some(recorder) = &mut self.recorder {
            recorder.reserve(self.duration_s / self.rig.period_s());
        }
        self.observers.iter_mut().for_each(|observer| observer.begin());
        let mut broken = None;
        let half_tick_s = 0.5 * self.rig.period_s();
        while self.rig.time_s() < self.duration_s - half_tick_s {
            if stop.load(Ordering::Relaxed) {
                self.outcome.faults.push(format!("run stopped by the user at {:.3} s", self.rig.time_s()));
                break;
            }
            if self.rig.ticks().is_multiple_of(PROGRESS_TICKS) {
                progress(self.rig.time_s());
            }
            if let Some(pace) = &mut self.pace {
                pace.wait_until(self.rig.time_s());
            }
            self.rig.tick();
            if let Some((station, source)) = self.rig.take_board_error() {
                broken = Some(ExperimentError::Emulated { station, source });
                self.outcome.fail(format!("run aborted at {:.3} s", self.rig.time_s()));
                break;
            }
            if self.observe() {
                break;
            }
            self.rig.advance();
        }
        progress(self.rig.time_s());
        // The figures of an aborted run cover its completed part.
        self.outcome.is_complete = self.rig.time_s() >= self.duration_s - half_tick_s;
        self.finish(broken)
    }

    /// Calls all observers for the present tick; returns whether one of them ends the run.
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
        Run { outcome: self.outcome, recording, media, error: broken, rig, phases: self.phases }
    }
}

/// Timing of a single station relative to the clock.
fn real_time(rig: &Rig, pace: &TickPacer, faults: &mut Vec<String>) -> RealTime {
    let (late_ticks, ticks) = (pace.late_ticks(), rig.ticks());
    #[expect(clippy::cast_precision_loss, reason = "far fewer ticks than 2^53")]
    if late_ticks as f64 > LATE_SHARE * ticks as f64 {
        faults.push(format!(
            "{late_ticks} of {ticks} ticks were more than one period late: this computer is overloaded"
        ));
    }
    let side = rig.stations().first().map(|station| station.name.clone()).unwrap_or_default();
    RealTime { side, late_ticks, worst_lateness_s: pace.worst_lateness_s() }
}

/// Runs a rig from start to end, for tests.
///
/// # Errors
/// As [`Experiment::new`].
pub fn run(file: &RigFile) -> Result<Run, ExperimentError> {
    Ok(Experiment::new(file)?.run(&AtomicBool::new(false), |_time_s| ()))
}
