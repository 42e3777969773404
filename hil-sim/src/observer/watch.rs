//! Checks that every position, force and wave stays in range without growth, and that no force alternates between its
//! limits (growth that ended in saturation).

use core::ops::ControlFlow;

use dimsart_core::limits::MAX_DOF;
use dimsart_core::{DataType, TickResult, Unit, Vocabulary as _, types};
use drive::JointFault;

use super::Observer;
use super::growth::Growth;
use crate::outcome::Outcome;
use crate::rig::{Probe, Rig, Station};

/// Share of a signal's range below which growth is noise; `f32` resolves larger values.
const FLOOR: f64 = 1e-7;
/// Share of the maximum force above which an actuator is saturated.
const SATURATED: f64 = 0.999;
/// Maximum ticks from one limit to the other, and number of reversals; steps and impacts cause fewer.
const REVERSAL_TICKS: u32 = 16;
const REVERSALS: u32 = 40;

/// Observes a rig tick by tick.
#[derive(Debug)]
pub struct FaultMonitor {
    stations: Vec<Watched>,
    /// Whether growth has been reported.
    has_seen_growth: bool,
    faults: Vec<String>,
    is_unstable: bool,
}

/// Declared ranges of a station's signals, symmetric around 0, in the units of its axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ranges {
    /// Position range, `m` or `rad`.
    pub position: f64,
    /// Force range, `N` or `N m`.
    pub force: f64,
    /// Maximum force of each actuator, `N` or `N m`.
    pub max_force: [f64; MAX_DOF],
    /// Wave range, `sqrt(W)`.
    pub wave: f64,
}

/// Observed signals of a station.
#[derive(Debug)]
struct Watched {
    position: f64,
    position_unit: &'static str,
    signals: [Signal; 3],
    reversals: [Reversals; MAX_DOF],
    /// Faults of the drives.
    drives: Probe,
    has_lost_link: bool,
}

/// A fault.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Alarm {
    /// A signal grows but is still in range, or alternates between its limits.
    Growth(String),
    /// Links lost, one message per station; the devices get their safe input and the run continues.
    LinkLost(Vec<String>),
    /// A signal is out of range, or a frame was refused; the run ends.
    OutOfRange(String),
}

/// One signal of a station, on every axis.
#[derive(Debug)]
struct Signal {
    what: &'static str,
    unit: &'static str,
    range: f64,
    probe: Probe,
    growth: Vec<Growth>,
}

impl FaultMonitor {
    /// Creates an observer of all stations; `ranges` are in their order.
    #[must_use]
    pub fn new(rig: &Rig, ranges: impl IntoIterator<Item = Ranges>) -> Self {
        let watched = |(station, ranges): (&Station, Ranges)| {
            let kind = station.dimsart.engine().device().axes().first().copied().unwrap_or_default();
            let signal =
                |what, unit: Unit, range, data_type| Signal::new(what, unit.symbol(kind), range, data_type);
            Watched {
                position: ranges.position,
                position_unit: Unit::Position.symbol(kind),
                signals: [
                    signal("force", Unit::Force, ranges.force, types::DES_FORCE),
                    signal("outgoing wave", Unit::Wave, ranges.wave, types::CH1_WAVES),
                    signal("incoming wave", Unit::Wave, ranges.wave, types::CH2_WAVES),
                ],
                reversals: ranges.max_force.map(Reversals::new),
                drives: Probe::new(types::DRIVE_FAULT.first()),
                has_lost_link: false,
            }
        };
        let stations = rig.stations().iter().zip(ranges).map(watched).collect();
        Self { stations, has_seen_growth: false, faults: Vec::new(), is_unstable: false }
    }

    /// Returns the fault of the present tick, if any. Growth is reported once, a lost link once per station.
    pub fn check(&mut self, rig: &Rig) -> Option<Alarm> {
        let (mut grows, mut lost) = (None, Vec::new());
        for (watched, station) in self.stations.iter_mut().zip(rig.stations()) {
            let Watched { position: range, position_unit, signals, reversals, drives, has_lost_link } =
                watched;
            let at = |what: String| format!("{} {what} at {:.3} s", station.name, rig.time_s());
            let said =
                drives.values(station).enumerate().find_map(|(axis, number)| ends_it(axis, number, station));
            if let Some(said) = said {
                return Some(Alarm::OutOfRange(at(said)));
            }
            for (axis, position) in station.position().iter().enumerate() {
                let position = f64::from(*position);
                if is_outside(position, *range) {
                    return Some(Alarm::OutOfRange(at(left(
                        "position",
                        axis,
                        position,
                        *range,
                        position_unit,
                    ))));
                }
            }
            // Signals that do not act on the device are not checked.
            let is_safe =
                matches!(station.last_tick, TickResult::LinkLost { .. } | TickResult::LinkDown { .. });
            for Signal { what, unit, range, probe, growth } in signals.iter_mut().filter(|_| !is_safe) {
                let values = probe.values(station);
                if growth.len() < values.len() {
                    growth.resize(values.len(), Growth::new(FLOOR * *range));
                }
                for (axis, (growth, value)) in growth.iter_mut().zip(values).enumerate() {
                    if is_outside(value, *range) {
                        return Some(Alarm::OutOfRange(at(left(what, axis, value, *range, unit))));
                    }
                    if let Some(per_tick) = growth.add(value).filter(|_| grows.is_none()) {
                        grows = Some(at(format!(
                            "{what} of axis {axis} grows without bound, by a factor of {per_tick:.4} per tick, \
                            detected"
                        )));
                    }
                }
            }
            for (axis, (reversals, force)) in reversals.iter_mut().zip(station.command()).enumerate() {
                if reversals.add(f64::from(*force)) && grows.is_none() {
                    let limit = reversals.limit;
                    grows = Some(at(format!(
                        "has an unstable loop: the force of axis {axis} alternates between its limits ±{limit}, detected"
                    )));
                }
            }
            match station.last_tick {
                // The first packet may take as long as the delay of the link.
                TickResult::Ran | TickResult::Idle | TickResult::LinkDown { .. } => {}
                TickResult::LinkLost { link } => {
                    if !core::mem::replace(has_lost_link, true) {
                        let what = "no packet for TIMEOUT_TICKS of COMM_RXMOD (`link.timeout_ticks`), force set to 0";
                        lost.push(at(format!("lost link {link}: {what}")));
                    }
                }
                TickResult::MeasurementRefused(error) => {
                    return Some(Alarm::OutOfRange(at(format!("refused the measurement ({error})"))));
                }
                TickResult::CommandsLate => {
                    return Some(Alarm::OutOfRange(at("received no external command in time".to_owned())));
                }
                TickResult::DriveFailed(fault) => {
                    return Some(Alarm::OutOfRange(at(format!(
                        "stopped because the drive turned its bridge off ({fault})"
                    ))));
                }
                TickResult::CommandRefused(error) => {
                    return Some(Alarm::OutOfRange(at(format!("refused the command ({error})"))));
                }
                TickResult::ModuleFailed(module) => {
                    let engine = station.dimsart.engine();
                    // Only the signals of a board's controller are available here.
                    let reason = match engine.module_fault() {
                        Some(fault) => engine.explain_module_fault(fault).to_string(),
                        None => format!("{} failed and is isolated", engine.module_name(module)),
                    };
                    return Some(Alarm::OutOfRange(at(reason)));
                }
                TickResult::Disarmed => {
                    let reason = "lease expired: the board set its outputs to the safe value";
                    return Some(Alarm::OutOfRange(at(reason.to_owned())));
                }
            }
        }
        if !lost.is_empty() {
            return Some(Alarm::LinkLost(lost));
        }
        let grows = grows.filter(|_| !self.has_seen_growth)?;
        self.has_seen_growth = true;
        Some(Alarm::Growth(grows))
    }
}

impl Observer for FaultMonitor {
    fn observe(&mut self, rig: &Rig) -> ControlFlow<()> {
        match self.check(rig) {
            None => {}
            Some(Alarm::LinkLost(lost)) => self.faults.extend(lost),
            Some(Alarm::Growth(fault)) => {
                self.faults.push(fault);
                self.is_unstable = true;
            }
            Some(Alarm::OutOfRange(fault)) => {
                self.faults.push(fault);
                self.is_unstable = true;
                return ControlFlow::Break(());
            }
        }
        ControlFlow::Continue(())
    }

    fn report(&mut self, _rig: &Rig, outcome: &mut Outcome) {
        outcome.faults.append(&mut self.faults);
        outcome.stable &= !self.is_unstable;
    }
}

/// Counts reversals of a force between its limits.
#[derive(Debug, Clone, Copy)]
struct Reversals {
    limit: f64,
    is_positive: Option<bool>,
    /// Ticks since the last reversal.
    ticks: u32,
    count: u32,
}

impl Reversals {
    const fn new(limit: f64) -> Self {
        Self { limit, is_positive: None, ticks: 0, count: 0 }
    }

    /// Adds the present tick's force; returns whether the limit of reversals is reached.
    fn add(&mut self, force: f64) -> bool {
        self.ticks = self.ticks.saturating_add(1);
        if self.ticks > REVERSAL_TICKS {
            self.count = 0;
        }
        let is_positive = force > 0.0;
        if force.abs() < SATURATED * self.limit || self.is_positive.replace(is_positive) == Some(is_positive)
        {
            return false;
        }
        (self.ticks, self.count) = (0, self.count + 1);
        self.count >= REVERSALS
    }
}

impl Signal {
    fn new(what: &'static str, unit: &'static str, range: f64, data_type: &'static DataType) -> Self {
        Self { what, unit, range, probe: Probe::new(data_type.first()), growth: Vec::new() }
    }
}

/// Whether a value is beyond ±`range` or NaN.
fn is_outside(value: f64, range: f64) -> bool {
    !(-range..=range).contains(&value)
}

/// Message of a range violation.
#[cold]
fn left(what: &str, axis: usize, value: f64, range: f64, unit: &str) -> String {
    format!("{what} of axis {axis} is out of range: {value:.4} {unit}, limit ±{range} {unit}")
}

/// Describes the drive fault that ended the measurements.
fn ends_it(axis: usize, number: f64, station: &Station) -> Option<String> {
    if !matches!(station.last_tick, TickResult::MeasurementRefused(_)) {
        return None;
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a cast saturates")]
    let trouble = JointFault::from_number(number as u32)?;
    Some(format!("has no measurement: drive of axis {axis}: {trouble}: {}", trouble.remedy()))
}
