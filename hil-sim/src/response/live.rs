//! A rig in real time with controllers that are accessed over lines, like boards.
//!
//! ```text
//! line ──requests──▶ Answering ──▶ Dimsart ◀─▶ plant, as in any rig
//! line ◀──answers, heartbeats, samples──┘
//! hand ──ReferenceOverride──▶ References ──▶ frame, in place of the experiment's
//! ```

use std::collections::VecDeque;
use std::io::{Read, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver as Holding, Sender, SyncSender, channel};
use std::time::Duration;

use dimsart_core::{Command, Timing};
use dimsart_link::EventLog;
use dimsart_link::protocol::{
    DeviceInfo, HEARTBEATS_PER_S, MAX_FRAME_BYTES, Receiver, Request, decode_request, encode_heartbeat,
    encode_response, encode_sample, serve_content,
};

use super::build;
use super::excitation::Held;
use super::press::{self, Planned, release_times_s};
use super::references::References;
use crate::clock;
use crate::experiment::ExperimentError;
use crate::pace::TickPacer;
use crate::pipe::{Pipe, pair};
use crate::recorder::Recorder;
use crate::recording::RecordingChunk;
use crate::rig::{Rig, Station};
use crate::rig_file::RigFile;
use crate::rig_file::part::ControllerAxes;

/// Telemetry streams of each controller: simultaneous clients, or parts of one client's view.
pub const TELEMETRY_STREAMS: usize = 16;

/// Timeout of a read at the other end of a line.
const WAIT: Duration = Duration::from_millis(1);
/// Requests answered per tick; a board answers one, with less time.
const ANSWERS_PER_TICK: usize = 8;
/// Maximum queued requests; surplus requests are dropped.
const ROOM: usize = 64;
/// Identification of the simulated controllers.
const IMAGE: &str = concat!("simulated, DIMSART ", env!("CARGO_PKG_VERSION"));

/// A rig that runs until stopped. Its experiment starts when all controllers are armed, and repeats.
#[derive(Debug)]
pub struct LiveRig {
    file: RigFile,
    planned: Option<Planned>,
    rig: Rig,
    references: References,
    answering: Vec<Answering>,
    hand: Sender<ReferenceOverride>,
    holds: Holding<ReferenceOverride>,
    recorder: Option<Recorder>,
}

/// A reference held by a client.
#[derive(Debug, Clone, PartialEq)]
pub struct ReferenceOverride {
    /// Index of its controller in the rig.
    pub station: usize,
    /// Name of the reference, such as `DES_POSITION`, or `hand`; never a measured signal.
    pub signal: String,
    /// Axis of the controller.
    pub axis: usize,
    /// Requested state of the reference.
    pub held: Held,
}

/// State of a simulated controller beyond its engine, as in the firmware of a board.
#[derive(Debug)]
struct Answering {
    info: DeviceInfo<TELEMETRY_STREAMS>,
    timing: Timing,
    line: Pipe,
    receiver: Receiver,
    waiting: VecDeque<Vec<u8>>,
    dropped: u32,
    heartbeats: u16,
    /// Ticks of the controller, and ticks per heartbeat.
    ticks: u32,
    heartbeat_ticks: u32,
    /// Maximum valid position.
    position_limit: f64,
}

impl LiveRig {
    /// Creates a rig at rest with a line to each of its controllers, by name. Controllers move their devices while a
    /// client holds the lease.
    ///
    /// # Errors
    /// As [`Experiment::new`](super::Experiment::new).
    pub fn new(file: &RigFile) -> Result<(Self, Vec<(String, Pipe)>), ExperimentError> {
        let planned = press::planned(file)?;
        let file = &planned.as_ref().map_or_else(|| file.clone(), |planned| planned.moved(file));
        let (rig, references) =
            (build::rig(file, &release_times_s(planned.as_ref()))?, References::new(file)?);
        let (mut answering, mut lines) = (Vec::new(), Vec::new());
        for (part, station) in ControllerAxes::all(file).iter().zip(rig.stations()) {
            let [client, here] = pair([WAIT, Duration::ZERO]);
            let period_s = file.sample_period_s * f64::from(part.controller.every_ticks.max(1));
            answering.push(Answering::new(here, period_s, part.device.position_limit));
            lines.push((station.name.clone(), client));
        }
        let (hand, holds) = channel();
        let file = file.clone();
        Ok((Self { file, planned, rig, references, answering, hand, holds, recorder: None }, lines))
    }

    /// Sends every tick to `listener`: the signals of `[record]` and all controller inputs. Drops a listener that is
    /// thousands of ticks behind.
    ///
    /// # Errors
    /// [`ExperimentError`] for an unknown signal.
    pub fn add_listener(&mut self, listener: SyncSender<RecordingChunk>) -> Result<(), ExperimentError> {
        self.rig.stations_mut().iter_mut().for_each(Station::record_inputs);
        let mut recorder = Recorder::new(&self.rig, &self.file.record)?.in_real_time();
        recorder.add_listener(listener);
        self.recorder = Some(recorder);
        Ok(())
    }

    /// Returns the rig, for inspection or changes before the run.
    pub fn rig_mut(&mut self) -> &mut Rig {
        &mut self.rig
    }

    /// Returns the channel for held references.
    #[must_use]
    pub fn reference_overrides(&self) -> Sender<ReferenceOverride> {
        self.hand.clone()
    }

    /// Returns the references of a station that can be held, as `DES_POSITION[0]`, and its hands, as `hand[0]`.
    #[must_use]
    pub fn references(&self, station: usize) -> Vec<String> {
        let own = self.references.names().filter(|(of, ..)| *of == station);
        own.map(|(_, signal, axis)| format!("{signal}[{axis}]")).collect()
    }

    /// Runs until `stop` is set. Skips time in which the computer stalls. `say` receives messages for the user.
    pub fn run(mut self, stop: &AtomicBool, mut say: impl FnMut(String)) {
        let mut pace = TickPacer::new(clock::now(), self.rig.period_s());
        while !stop.load(Ordering::Relaxed) {
            if let Some(skipped) = pace.wait_or_skip(self.rig.time_s()) {
                say(skipped.to_string());
            }
            self.step(pace.late_ticks(), &mut say);
        }
        // Sends pending rows to the listener.
        let _ = self.recorder.map(Recorder::finish);
    }

    /// Runs one tick of all controllers and devices; `late_ticks` is the number of late ticks so far.
    pub fn step(&mut self, late_ticks: u64, mut say: impl FnMut(String)) {
        while let Ok(ReferenceOverride { station, signal, axis, held }) = self.holds.try_recv() {
            self.references.hold(station, &signal, axis, held, &self.rig);
        }
        let tick = self.rig.ticks();
        let mut is_due = Vec::new();
        for (station, answering) in self.rig.stations_mut().iter_mut().zip(&mut self.answering) {
            is_due.push(station.is_due(tick));
            if station.is_due(tick) {
                answering.answer(station);
                station.set_motion_allowed(answering.info.begin_tick());
            }
        }
        self.references.lead(&mut self.rig);
        self.rig.tick();
        if let Some(recorder) = &mut self.recorder {
            recorder.record(&self.rig, &[]);
        }
        let due = self.rig.stations().iter().zip(&mut self.answering).zip(is_due);
        for ((station, answering), _) in due.filter(|(_, is_due)| *is_due) {
            answering.end_tick(station, late_ticks);
        }
        self.rig.advance();
        self.put_back(&mut say);
        self.drop_slow_listener(&mut say);
    }

    fn drop_slow_listener(&mut self, say: &mut impl FnMut(String)) {
        if self.recorder.as_ref().is_some_and(Recorder::has_no_listener) {
            self.recorder = None;
            say(format!("recording stopped at {:.3} s: the disk is too slow", self.rig.time_s()));
        }
    }

    /// Resets the plants of a rig whose axes are out of range, for example by too high a gain under test.
    fn put_back(&mut self, say: &mut impl FnMut(String)) {
        let has_left = |(station, answering): &(&Station, &Answering)| {
            let mut positions = (0..station.plant.dof()).map(|axis| station.plant.position(axis));
            positions.any(|position| position.is_nan() || position.abs() > answering.position_limit)
        };
        let Some((station, _)) = self.rig.stations().iter().zip(&self.answering).find(has_left) else {
            return;
        };
        say(format!(
            "{} was out of range at {:.3} s: plant reset to its start position",
            station.name,
            self.rig.time_s()
        ));
        // The rig was built before.
        let Ok(mut anew) = build::rig(&self.file, &release_times_s(self.planned.as_ref())) else { return };
        for (station, fresh) in self.rig.stations_mut().iter_mut().zip(anew.stations_mut()) {
            std::mem::swap(&mut station.plant, &mut fresh.plant);
        }
        self.answering.iter_mut().for_each(|answering| answering.info.end_lease());
    }
}

impl Answering {
    fn new(line: Pipe, period_s: f64, position_limit: f64) -> Self {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1 to a million")]
        let tick_hz = (1.0 / period_s).round().clamp(1.0, 1e6) as u32;
        // The log survives a reset of the controller, as on a board.
        let events: &'static EventLog = Box::leak(Box::new(EventLog::new()));
        Self {
            info: DeviceInfo::new(IMAGE).with_laws().with_client_lease(tick_hz).with_events(events),
            timing: Timing::default(),
            line,
            receiver: Receiver::new(),
            waiting: VecDeque::new(),
            dropped: 0,
            heartbeats: 0,
            ticks: 0,
            heartbeat_ticks: (tick_hz / HEARTBEATS_PER_S).max(1),
            position_limit,
        }
    }

    /// Answers requests between two ticks.
    fn answer(&mut self, station: &mut Station) {
        let Self { info, line, receiver, waiting, dropped, .. } = self;
        let (mut buffer, mut frame) = ([0; 1024], [0; MAX_FRAME_BYTES]);
        while let Ok(count @ 1..) = line.read(&mut buffer) {
            receiver.push_all(buffer.get(..count).unwrap_or_default(), |content| {
                if waiting.len() < ROOM {
                    waiting.push_back(content.to_vec());
                } else {
                    *dropped = dropped.saturating_add(1);
                }
            });
        }
        for content in waiting.drain(..waiting.len().min(ANSWERS_PER_TICK)) {
            // Invalid requests are not answered.
            let Some((id, response)) = serve_content(&content, &mut station.dimsart, info) else { continue };
            station.inputs_mut().into_iter().for_each(|kept| kept.add_request(&content, &response));
            if matches!(decode_request(&content), Ok((_, Request::Command(Command::Reset)))) {
                station.reset_links();
            }
            if let Ok(answer) = encode_response(&response, id, &mut frame) {
                say(line, answer, dropped);
            }
        }
    }

    fn end_tick(&mut self, station: &Station, late_ticks: u64) {
        let Self { info, timing, line, dropped, heartbeats, ticks, heartbeat_ticks, .. } = self;
        timing.count(late_ticks > u64::from(timing.late), false);
        info.set_timing(*timing);
        info.end_tick(station.last_tick, &station.dimsart);
        let mut frame = [0; MAX_FRAME_BYTES];
        for sample in info.samples(station.dimsart.engine().data_base()) {
            if let Ok(bytes) = encode_sample(&sample, &mut frame) {
                say(line, bytes, dropped);
            }
        }
        *ticks = ticks.wrapping_add(1);
        if ticks.is_multiple_of(*heartbeat_ticks) {
            *heartbeats = heartbeats.wrapping_add(1);
            if let Ok(bytes) = encode_heartbeat(&info.heartbeat(*dropped), *heartbeats, &mut frame) {
                say(line, bytes, dropped);
            }
        }
    }
}

/// Sends a message, or counts it as dropped.
fn say(line: &mut Pipe, bytes: &[u8], dropped: &mut u32) {
    if line.write_all(bytes).is_err() {
        *dropped = dropped.saturating_add(1);
    }
}
