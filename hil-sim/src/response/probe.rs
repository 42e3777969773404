//! Disturbs a loop of a rig, and listens to what its controller does about it.

use super::loop_gain::{Answers, LoopFigures};
use super::{ResponseError, rig_of};
use crate::plant::SensorParameters;
use crate::rig::{Probe, Rig};
use crate::rig_file::{MoveSection, RigFile, Step};

use dimsart_core::types;

/// Change of the velocity that a disturbance would make of the load alone, `rad/s` or `m/s`.
const PUSH: f64 = 0.005;
/// Ticks that a loop is listened to: no less, for the slowest frequencies, and no more.
const LEAST_TICKS: usize = 4_000;
const MOST_TICKS: usize = 20_000;
/// Share of the disturbance that the answer must not pass: it grows, and there may be limits.
const GROWN: f64 = 2.0;
/// Share of the largest answer below which nothing more comes.
const OVER: f64 = 1e-6;

/// A force on the first command for one axis of a station.
#[derive(Debug, Clone, Copy)]
pub(super) struct Disturbance {
    pub(super) station: usize,
    pub(super) axis: usize,
    pub(super) force: f64,
}

/// The loop around an axis, from where it stands at the start, without what is known not to be linear; none when something
/// else is not.
///
/// # Errors
/// As the [experiment](super::Experiment::new)'s.
pub(super) fn loop_figures(
    file: &RigFile,
    station: usize,
    axis: usize,
) -> Result<Option<LoopFigures>, ResponseError> {
    let at_rest = at_rest(file);
    let inertia = file.devices.get(station).and_then(|device| device.axes.get(axis));
    let inertia = inertia.map_or(1.0, |axis| axis.plant.load.inertia);
    let force = PUSH * inertia / file.sample_period_s;
    let mut listener = Listener::new(&at_rest, station, axis)?;
    let to_whole = listener.answers(&at_rest, force, MOST_TICKS)?;
    let mut listener = Listener::new(&at_rest, station, axis)?;
    let to_half = listener.answers(&at_rest, 0.5 * force, to_whole.len())?;
    Ok(Answers { disturbance: force, to_whole, to_half }.figures(file.sample_period_s))
}

/// The rig with nothing that moves it, references where the joints stand, and nothing that is known not to be linear: dry
/// friction, a gear's losses, backlash, stops, a sensor's steps and noise.
fn at_rest(file: &RigFile) -> RigFile {
    let mut at_rest = file.clone();
    for axis in at_rest.devices.iter_mut().flat_map(|device| &mut device.axes) {
        for sensor in axis.sensor.values_mut() {
            *sensor = SensorParameters { gain: sensor.gain, ..SensorParameters::default() };
        }
        axis.plant = axis.plant.linear();
    }
    let moves = file.devices.iter().flat_map(|device| {
        device.axes.iter().enumerate().map(|(axis, section)| MoveSection {
            axis,
            step: Some(Step { at_s: -1.0, size: section.plant.load.start_position }),
            ..MoveSection::nothing(&device.name, types::DES_POSITION.name)
        })
    });
    at_rest.experiment.moves = moves.collect();
    at_rest
}

/// The rig at rest, beside which the disturbed one is heard.
struct Listener {
    rig: Rig,
    station: usize,
    axis: usize,
    command: Probe,
}

impl Listener {
    fn new(at_rest: &RigFile, station: usize, axis: usize) -> Result<Self, ResponseError> {
        let rig = rig_of(at_rest, None)?;
        Ok(Self { rig, station, axis, command: Probe::new(types::DES_FORCE.first()) })
    }

    /// What the controller does differently, until nothing more comes or it grows.
    fn answers(&mut self, at_rest: &RigFile, force: f64, ticks: usize) -> Result<Vec<f64>, ResponseError> {
        let Self { station, axis, .. } = *self;
        let mut disturbed = rig_of(at_rest, Some(Disturbance { station, axis, force }))?;
        let mut command = Probe::new(types::DES_FORCE.first());
        let of = |rig: &Rig, probe: &mut Probe| {
            let values = rig.stations().get(station).map(|station| probe.values(station));
            values.and_then(|mut values| values.nth(axis)).unwrap_or_default()
        };
        let (mut answers, mut most, mut quiet_ticks) = (Vec::new(), 0.0_f64, 0);
        while answers.len() < ticks {
            self.rig.step();
            disturbed.step();
            let answer = of(&disturbed, &mut command) - of(&self.rig, &mut self.command);
            answers.push(answer);
            most = most.max(answer.abs());
            quiet_ticks = if answer.abs() > OVER * most { 0 } else { quiet_ticks + 1 };
            let is_over = quiet_ticks > LEAST_TICKS / 2 && answers.len() >= LEAST_TICKS;
            if ticks == MOST_TICKS && (is_over || most > GROWN * force) {
                break;
            }
        }
        Ok(answers)
    }
}
