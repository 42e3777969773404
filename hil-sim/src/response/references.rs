//! The references of a live rig: they start at the measured position, and the experiment repeats without a jump.
//!
//! ```text
//! controller disarmed   reference = measured position, velocity 0, force 0
//! armed                 approach to the first value of the experiment, ≤ 1 rad/s or 0.1 m/s
//! all armed and there   experiment, return to its first value, experiment, ...
//! ```

use dimsart_core::{TickResult, types};

use super::excitation::Held;
use super::held_hand::HeldHand;
use super::moves::motions;
use crate::experiment::ExperimentError;
use crate::motion::{Motion, sum_at};
use crate::plant::{PEAK_SPEED, Repetition, minimum_jerk};
use crate::rig::{FrameOverride, Rig, Station};
use crate::rig_file::part::ControllerAxes;
use crate::rig_file::{AxisUnit, HAND, RigFile};

/// Maximum speed of an approach.
const MAX_RAD_PER_S: f64 = 1.0;
const MAX_M_PER_S: f64 = 0.1;
/// Minimum duration of an approach and of the return, `s`.
const MIN_APPROACH_S: f64 = 1.0;

/// All references, and the time of the experiment.
#[derive(Debug)]
pub(super) struct References {
    all: Vec<Reference>,
    hands: Vec<HeldHand>,
    /// Controllers that must be armed before the experiment starts.
    moving: Vec<usize>,
    repetition: Repetition,
    period_s: f64,
    start_tick: u64,
    /// Time of the experiment and the return.
    cycle_ticks: u64,
    is_running: bool,
}

#[derive(Debug)]
struct Reference {
    station: usize,
    /// Index in the station's frame.
    place: usize,
    signal: String,
    axis: usize,
    motions: Vec<Motion>,
    start: Start,
    max_speed: f64,
    /// Set by a user, in place of the experiment.
    held: Option<f64>,
    /// Excitation by a user around the held value, with its start and end, `s`.
    excitation: Option<(Motion, [f64; 2])>,
    /// `None` while the controller does not command its device.
    approach: Option<Approach>,
}

/// The value of a reference while its controller does not command the device.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Start {
    /// Position at this index of the frame.
    Measured(usize),
    /// The position of an axis of another controller.
    Led { station: usize, axis: usize },
    /// 0, for a velocity or a force.
    Rest,
    /// The experiment's value, for a reference that does not move the device.
    Experiment,
}

/// Approach from the value at arming to the experiment.
#[derive(Debug, Clone, Copy, Default)]
struct Approach {
    offset: f64,
    done_s: f64,
    duration_s: f64,
}

impl References {
    /// Creates the references of a file's controllers, at the start of the experiment.
    pub(super) fn new(file: &RigFile) -> Result<Self, ExperimentError> {
        let (parts, period_s) = (ControllerAxes::all(file), file.sample_period_s);
        let (mut all, mut hands, mut moving) = (Vec::new(), Vec::new(), Vec::new());
        for (station, part) in parts.iter().enumerate() {
            if part.device.has_actuators() {
                moving.push(station);
            }
            all.extend(Reference::of_part(file, &parts, station, part)?);
            for (place, (axis, section)) in
                part.sections().enumerate().filter(|(_, (_, section))| section.hand.is_some())
            {
                let motions = motions(file, &part.device.name, axis, HAND)?;
                hands.push(HeldHand::new(station, place, section.unit, motions));
            }
        }
        let end_s = (file.duration_s - period_s).max(0.0);
        let mut return_s = MIN_APPROACH_S;
        let mut allow_for = |motions: &[Motion], max_speed: f64| {
            let distance = (sum_at(motions, end_s) - sum_at(motions, 0.0)).abs();
            return_s = return_s.max(PEAK_SPEED * distance / max_speed);
        };
        all.iter().for_each(|reference| allow_for(&reference.motions, reference.max_speed));
        for device in &file.devices {
            for (axis, section) in device.axes.iter().enumerate() {
                allow_for(&motions(file, &device.name, axis, HAND)?, max_speed(section.unit));
            }
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a duration in ticks")]
        let cycle_ticks = ((end_s + return_s) / period_s).ceil().max(1.0) as u64;
        let repetition = Repetition { start_s: 0.0, end_s, return_s };
        Ok(Self { all, hands, moving, repetition, period_s, start_tick: 0, cycle_ticks, is_running: false })
    }

    /// Returns the references and hands that can be held: station, signal and axis.
    pub(super) fn names(&self) -> impl Iterator<Item = (usize, &str, usize)> {
        let references =
            self.all.iter().map(|reference| (reference.station, reference.signal.as_ref(), reference.axis));
        references.chain(self.hands.iter().map(|hand| (hand.station, HAND, hand.axis)))
    }

    /// Holds, excites or releases a reference. Other references are unchanged.
    pub(super) fn hold(&mut self, station: usize, signal: &str, axis: usize, held: Held, rig: &Rig) {
        if signal == HAND {
            let hand = self.hands.iter_mut().find(|hand| hand.station == station && hand.axis == axis);
            let value = match held {
                Held::At(value) | Held::GoTo(value) if value.is_finite() => Some(f64::from(value)),
                Held::Released | Held::At(_) | Held::GoTo(_) | Held::Excited(_) => None,
            };
            return hand.into_iter().for_each(|hand| hand.hold(value));
        }
        let found = self.all.iter_mut().find(|reference| {
            reference.station == station && reference.axis == axis && reference.signal == signal
        });
        let Some(reference) = found else { return };
        reference.excitation = None;
        match held {
            Held::At(value) if value.is_finite() => {
                reference.held = Some(value.into());
                reference.end_approach();
            }
            Held::GoTo(value) if value.is_finite() => {
                let value = f64::from(value);
                let offset = reference.shown(rig).unwrap_or(value) - value;
                reference.held = Some(value);
                if reference.approach.is_some() {
                    reference.approach = Some(Approach::from(offset, reference.max_speed));
                }
            }
            Held::Released | Held::At(_) | Held::GoTo(_) => reference.release(&self.repetition, rig),
            Held::Excited(excitation) => {
                let (now_s, shown) = (rig.time_s(), reference.shown(rig));
                reference.held = shown.or(reference.held);
                reference.end_approach();
                let end_s = now_s + excitation.duration_s();
                reference.excitation = excitation.motion().map(|motion| (motion, [now_s, end_s]));
            }
        }
    }

    /// Sets the references of the next tick.
    pub(super) fn lead(&mut self, rig: &mut Rig) {
        let (tick, time_s) = (rig.ticks(), rig.time_s());
        let commands = |rig: &Rig, station: usize| {
            rig.stations().get(station).is_some_and(|station| station.last_tick == TickResult::Ran)
        };
        if !self.is_running || tick.saturating_sub(self.start_tick) >= self.cycle_ticks {
            self.start_tick = tick;
            self.repetition.start_s = time_s;
            self.is_running = self.moving.iter().all(|station| commands(rig, *station))
                && self.all.iter().all(|reference| !reference.is_approaching());
        }
        rig.stations_mut().iter_mut().for_each(|station| station.plant.repeat(self.repetition));
        for hand in self.hands.iter_mut().filter(|hand| hand.is_moved()) {
            let position = hand.next(&self.repetition, time_s, self.period_s);
            if let Some(station) = rig.stations_mut().get_mut(hand.station) {
                station.plant.hold_hand(hand.axis, position);
            }
        }
        for reference in &mut self.all {
            if reference.excitation.as_ref().is_some_and(|(_, [_, end_s])| time_s >= *end_s) {
                reference.excitation = None;
                reference.release(&self.repetition, rig);
            }
            let (station, is_commanded) = (reference.station, commands(rig, reference.commanded_by()));
            let shown = reference.next(is_commanded, &self.repetition, time_s, self.period_s, rig);
            if let Some(station) = rig.stations_mut().get_mut(station) {
                station.override_entry(reference.place, shown);
            }
        }
    }
}

impl Reference {
    fn of_part(
        file: &RigFile,
        parts: &[ControllerAxes<'_>],
        station: usize,
        part: &ControllerAxes<'_>,
    ) -> Result<Vec<Self>, ExperimentError> {
        let (device, count) = (part.device, part.axes.len());
        let measured = device.measures.iter().position(|name| name == types::POSITION.name);
        let mut all = Vec::new();
        for (row, signal) in device.measures.iter().enumerate() {
            let Some(data_type) = file.data_type(signal).filter(|found| !RigFile::is_sensed(found)) else {
                continue;
            };
            for (axis, of_device) in part.axes.iter().copied().enumerate() {
                let led = || {
                    let leads = device.leads.as_deref()?;
                    let is_it = |part: &ControllerAxes<'_>| part.device.name == leads;
                    parts.iter().enumerate().filter(|(_, part)| is_it(part)).find_map(|(station, part)| {
                        let axis = part.axes.iter().position(|axis| *axis == of_device)?;
                        Some(Start::Led { station, axis })
                    })
                };
                let own = measured.map(|row| Start::Measured(row * count + axis));
                let start = match data_type.id {
                    id if id == types::DES_POSITION.id => own.or_else(led).unwrap_or(Start::Experiment),
                    id if id == types::DES_VELOCITY.id || id == types::DES_FORCE.id => Start::Rest,
                    _ => Start::Experiment,
                };
                let is_position = matches!(start, Start::Measured(_) | Start::Led { .. });
                let unit = device.axes.get(of_device).map(|axis| axis.unit).unwrap_or_default();
                all.push(Self {
                    station,
                    place: row * count + axis,
                    signal: signal.clone(),
                    axis,
                    motions: motions(file, &device.name, of_device, signal)?,
                    start,
                    max_speed: if is_position { max_speed(unit) } else { f64::INFINITY },
                    held: None,
                    excitation: None,
                    approach: None,
                });
            }
        }
        Ok(all)
    }

    /// Returns the station whose device it moves.
    fn commanded_by(&self) -> usize {
        if let Start::Led { station, .. } = self.start { station } else { self.station }
    }

    fn is_approaching(&self) -> bool {
        self.approach.is_some_and(|approach| approach.done_s < approach.duration_s)
    }

    /// Last value.
    fn shown(&self, rig: &Rig) -> Option<f64> {
        rig.stations().get(self.station)?.entry_value(self.place).map(f64::from)
    }

    /// Target value.
    fn base(&self, repetition: &Repetition, time_s: f64) -> f64 {
        let base =
            self.held.unwrap_or_else(|| repetition.value(time_s, |time_s| sum_at(&self.motions, time_s)));
        base + self.excitation.as_ref().map_or(0.0, |(motion, [start_s, _])| motion.at(time_s - start_s))
    }

    /// Ends an approach, so that the next value is the target value.
    fn end_approach(&mut self) {
        if self.approach.is_some() {
            self.approach = Some(Approach::default());
        }
    }

    /// Returns a reference to the experiment, without a jump.
    fn release(&mut self, repetition: &Repetition, rig: &Rig) {
        self.held = None;
        if self.approach.is_some() {
            let base = self.base(repetition, rig.time_s());
            let offset = self.shown(rig).unwrap_or(base) - base;
            self.approach = Some(Approach::from(offset, self.max_speed));
        }
    }

    fn next(
        &mut self,
        is_commanded: bool,
        repetition: &Repetition,
        time_s: f64,
        period_s: f64,
        rig: &Rig,
    ) -> FrameOverride {
        let base = self.base(repetition, time_s);
        if self.start == Start::Experiment {
            return value(base);
        }
        if !is_commanded {
            // After a STOP or disarming, the next client must not find an earlier client's motion.
            (self.approach, self.held, self.excitation) = (None, None, None);
            return match self.start {
                Start::Measured(place) => FrameOverride::OtherEntry(place),
                Start::Led { station, axis } => {
                    let position = |station: &Station| station.plant.position(axis);
                    value(rig.stations().get(station).map_or(base, position))
                }
                Start::Rest => FrameOverride::Value(0.0),
                Start::Experiment => value(base),
            };
        }
        let shown = self.shown(rig).unwrap_or(base);
        let approach = self.approach.get_or_insert_with(|| Approach::from(shown - base, self.max_speed));
        value(base + approach.next(period_s))
    }
}

impl Approach {
    fn from(offset: f64, max_speed: f64) -> Self {
        let duration_s = MIN_APPROACH_S.max(PEAK_SPEED * offset.abs() / max_speed);
        Self { offset, done_s: 0.0, duration_s: if offset.abs() > 0.0 { duration_s } else { 0.0 } }
    }

    fn next(&mut self, period_s: f64) -> f64 {
        self.done_s += period_s;
        if self.done_s >= self.duration_s {
            return 0.0;
        }
        self.offset * (1.0 - minimum_jerk(self.done_s / self.duration_s))
    }
}

fn max_speed(unit: AxisUnit) -> f64 {
    match unit {
        AxisUnit::Radian => MAX_RAD_PER_S,
        AxisUnit::Metre => MAX_M_PER_S,
    }
}

fn value(value: f64) -> FrameOverride {
    #[expect(clippy::cast_possible_truncation, reason = "the controller's number is an f32")]
    let value = value as f32;
    FrameOverride::Value(value)
}
