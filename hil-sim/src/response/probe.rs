//! Disturbs a loop of a rig, and listens to what its controller does about it.

use super::loop_gain::{Answers, LoopFigures};
use super::part::Part;
use super::{ResponseError, build};
use crate::link::InProcessParameters;
use crate::rig::{Probe, Rig};
use crate::rig_file::{DeviceSection, MoveSection, RigFile, Step};

use dimsart_core::types;

/// Change of the velocity that a disturbance would make of the load alone, `rad/s` or `m/s`.
const PUSH: f64 = 0.005;
/// Of the tip of a `PHANToM`, `kg`.
const LIGHT: f64 = 0.05;
/// Ticks that a loop is listened to: no less, for the slowest frequencies, and no more.
const LEAST_TICKS: usize = 4_000;
const MOST_TICKS: usize = 8_000;
/// Ticks that half of the disturbance is answered: what is not linear shows in the first ones.
const HALF_TICKS: usize = 2_000;
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

/// The rig at rest, beside which disturbed ones are heard.
pub(super) struct AtRest {
    file: RigFile,
    rig: Rig,
    /// Of every station, its commands; by tick, as far as somebody has asked.
    commands: Vec<Vec<Vec<f64>>>,
    probes: Vec<Probe>,
}

impl AtRest {
    /// Of a rig file; in contact, every axis with a wall is held by it from both sides.
    ///
    /// # Errors
    /// As the [experiment](super::Experiment::new)'s.
    pub(super) fn new(file: &RigFile, in_contact: bool) -> Result<Self, ResponseError> {
        let file = at_rest(file, in_contact);
        let rig = build::rig(&file, None)?;
        let probes = rig.stations().iter().map(|_| command_probe()).collect();
        Ok(Self { file, rig, commands: Vec::new(), probes })
    }

    /// The loop around an axis, from where it stands at the start, without what is known not to be linear; none when
    /// something else is not.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub(super) fn loop_figures(
        &mut self,
        station: usize,
        axis: usize,
    ) -> Result<Option<LoopFigures>, ResponseError> {
        let period_s = self.file.sample_period_s;
        let parts = Part::of_all(&self.file);
        let part = parts.get(station).and_then(|part| Some((part.device, *part.axes.get(axis)?)));
        let inertia = part.map_or(1.0, |(device, axis)| inertia(device, axis));
        let force = PUSH * inertia / period_s;
        let to_whole = self.answers(Disturbance { station, axis, force }, MOST_TICKS)?;
        let to_half = self.answers(Disturbance { station, axis, force: 0.5 * force }, HALF_TICKS)?;
        Ok(Answers { disturbance: force, to_whole, to_half }.figures(period_s))
    }

    /// What the controller does differently, until nothing more comes or it grows.
    fn answers(&mut self, disturbance: Disturbance, ticks: usize) -> Result<Vec<f64>, ResponseError> {
        let Disturbance { station, axis, force } = disturbance;
        let mut disturbed = build::rig(&self.file, Some(disturbance))?;
        let mut probe = command_probe();
        let (mut answers, mut most, mut quiet_ticks) = (Vec::new(), 0.0_f64, 0);
        while answers.len() < ticks {
            disturbed.step();
            let values = disturbed.stations().get(station).map(|station| probe.values(station));
            let command = values.and_then(|mut values| values.nth(axis)).unwrap_or_default();
            let answer = command - self.command(answers.len(), station, axis);
            answers.push(answer);
            most = most.max(answer.abs());
            quiet_ticks = if answer.abs() > OVER * most { 0 } else { quiet_ticks + 1 };
            let is_over = quiet_ticks > LEAST_TICKS / 2 && answers.len() >= LEAST_TICKS;
            if is_over || most > GROWN * force {
                break;
            }
        }
        Ok(answers)
    }

    /// Of the rig that nothing disturbs.
    fn command(&mut self, tick: usize, station: usize, axis: usize) -> f64 {
        while self.commands.len() <= tick {
            self.rig.step();
            let stations = self.rig.stations().iter().zip(&mut self.probes);
            self.commands.push(stations.map(|(station, probe)| probe.values(station).collect()).collect());
        }
        let commands = self.commands.get(tick).and_then(|stations| stations.get(station)?.get(axis));
        commands.copied().unwrap_or_default()
    }
}

/// What an axis moves, as good as it must be known to disturb it a little.
fn inertia(device: &DeviceSection, axis: usize) -> f64 {
    let plant = device.axes.get(axis).and_then(|axis| axis.plant.as_ref());
    let arm = || {
        let arm = device.arm.as_ref()?.build().ok()?;
        let start: Vec<f64> = (0..arm.axes()).map(|axis| device.start_position(axis)).collect();
        Some(arm.mass_matrix(&start).at(axis, axis))
    };
    plant.map(|plant| plant.load.inertia).or_else(arm).unwrap_or(LIGHT)
}

fn command_probe() -> Probe {
    Probe::new(types::DES_FORCE.first())
}

/// The rig with nothing that moves it, references where the joints stand, and nothing that is known not to be linear: dry
/// friction, a gear's losses, backlash, stops, a sensor's steps and noise; and nothing that is chance on the links.
fn at_rest(file: &RigFile, in_contact: bool) -> RigFile {
    let mut at_rest = file.clone();
    for device in &mut at_rest.devices {
        *device = device.linear(in_contact);
    }
    for link in &mut at_rest.links {
        link.carrier =
            InProcessParameters { delay_ticks: link.carrier.delay_ticks, ..InProcessParameters::default() };
    }
    let moves = file.devices.iter().flat_map(|device| {
        (0..device.axes.len()).map(|axis| MoveSection {
            axis,
            step: Some(Step { at_s: -1.0, size: device.start_position(axis) }),
            ..MoveSection::nothing(&device.name, types::DES_POSITION.name)
        })
    });
    at_rest.experiment.moves = moves.collect();
    at_rest
}
