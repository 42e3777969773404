//! Watches whether every position, force and wave stays in its declared range, and none grows without bound.

use dimsart_core::{DataType, Tick, types};

use crate::growth::Growth;
use crate::rig::{Probe, Rig};
use crate::scenario::LimitsSection;

/// Share of a signal's declared range below which its growth is noise: above that, `f32` still has digits for it.
const FLOOR: f64 = 1e-7;

/// Watches a rig tick by tick.
#[derive(Debug)]
pub struct Watch {
    position_m: f64,
    /// Per station.
    signals: Vec<[Signal; 3]>,
    /// One that grows is enough to know.
    has_seen_growth: bool,
}

/// What went wrong, in words.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Alarm {
    /// A signal grows without bound and has not left its range yet.
    Grows(String),
    /// Something is out of its range, or a frame was refused: nothing after this means anything.
    Left(String),
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

impl Watch {
    /// A watch over all stations of a rig.
    #[must_use]
    pub fn new(rig: &Rig, limits: &LimitsSection) -> Self {
        let signals = |_| {
            [
                Signal::new("force", "N", limits.force_n, types::DES_FORCE),
                Signal::new("outgoing wave", "sqrt(W)", limits.wave, types::CH1_WAVES),
                Signal::new("incoming wave", "sqrt(W)", limits.wave, types::CH2_WAVES),
            ]
        };
        let signals = rig.stations().iter().map(signals).collect();
        Self { position_m: limits.position_m, signals, has_seen_growth: false }
    }

    /// What is wrong in the present tick; none while all is well. Growth is told once, when it is first seen.
    pub fn look(&mut self, rig: &Rig) -> Option<Alarm> {
        let mut grows = None;
        for (signals, station) in self.signals.iter_mut().zip(rig.stations()) {
            let at = |what: String| format!("{} {what} at {:.3} s", station.name, rig.time_s());
            let positions = (0..station.plant.dof()).filter_map(|axis| station.plant.truth(axis));
            for (axis, truth) in positions.enumerate() {
                if let Some(left) = outside(truth.position_m, self.position_m, "position", axis, "m") {
                    return Some(Alarm::Left(at(left)));
                }
            }
            for signal in signals {
                for (axis, value) in signal.probe.values(station).enumerate() {
                    if let Some(left) = outside(value, signal.range, signal.what, axis, signal.unit) {
                        return Some(Alarm::Left(at(left)));
                    }
                    let growth = signal.growth(axis).and_then(|growth| growth.add(value));
                    if let Some(per_tick) = growth.filter(|_| grows.is_none()) {
                        let what = signal.what;
                        grows = Some(at(format!(
                            "{what} of axis {axis} grows without bound: by a factor of {per_tick:.4} per tick, seen"
                        )));
                    }
                }
            }
            match station.last_tick {
                Tick::Ran | Tick::Idle => {}
                Tick::MeasurementRefused(error) => {
                    return Some(Alarm::Left(at(format!("measurement refused ({error})"))));
                }
                Tick::CommandRefused(error) => {
                    return Some(Alarm::Left(at(format!("command refused ({error})"))));
                }
            }
        }
        let grows = grows.filter(|_| !self.has_seen_growth)?;
        self.has_seen_growth = true;
        Some(Alarm::Grows(grows))
    }
}

impl Signal {
    fn new(what: &'static str, unit: &'static str, range: f64, data_type: &'static DataType) -> Self {
        Self { what, unit, range, probe: Probe::new(data_type.first()), growth: Vec::new() }
    }

    /// The watch of one axis, new with the axis.
    fn growth(&mut self, axis: usize) -> Option<&mut Growth> {
        if self.growth.len() <= axis {
            self.growth.resize(axis + 1, Growth::new(FLOOR * self.range));
        }
        self.growth.get_mut(axis)
    }
}

/// What to say of a value beyond `range` either way, or not a number.
fn outside(value: f64, range: f64, what: &str, axis: usize, unit: &str) -> Option<String> {
    let is_inside = (-range..=range).contains(&value);
    (!is_inside).then(|| format!("{what} of axis {axis} left its range ±{range} {unit}: {value:.4} {unit}"))
}
