//! A device of a rig: joints with sensors and a delay, and references that come with what is measured.

use std::collections::VecDeque;

use dimsart_core::{DataType, types};

use super::motion::Motion;
use crate::plant::{AxisTruth, Joint, JointState, Plant, Sensor};
use crate::rig_file::AxisUnit;

/// Most ticks that a command can wait.
const MOST_WAITING: usize = 5;

/// Joints behind the frame of a device.
#[derive(Debug)]
pub(super) struct Instrumented {
    axes: Vec<Axis>,
    /// What fills the frame, in its order: every one a value for each axis.
    outputs: Vec<Output>,
    delay_ticks: f64,
    /// Commands that are not over, the newest last.
    waiting: VecDeque<Vec<f64>>,
    time_s: f64,
    /// On the first command for an axis.
    disturbance: Option<(usize, f64)>,
}

/// A joint and what pushes it.
#[derive(Debug)]
pub(super) struct Axis {
    pub(super) unit: AxisUnit,
    pub(super) joint: Joint,
    pub(super) load: Vec<Motion>,
    /// Where its hand wants to be, and how stiffly.
    pub(super) hand: Vec<Motion>,
    pub(super) hand_stiffness: f64,
}

impl Axis {
    /// What pushes it: the load, and its hand's spring.
    fn pushed_by(&self, time_s: f64, position: f64) -> f64 {
        sum_at(&self.load, time_s) + self.hand_stiffness * (sum_at(&self.hand, time_s) - position)
    }
}

/// What fills a part of the frame.
#[derive(Debug)]
pub(super) enum Output {
    /// What is measured of every axis, by a sensor each.
    Sensed(&'static DataType, Vec<Sensor>),
    /// What every axis is to do.
    Reference(Vec<Vec<Motion>>),
}

impl Instrumented {
    /// Joints at rest, before the first command.
    pub(super) fn new(
        axes: Vec<Axis>,
        outputs: Vec<Output>,
        delay_ticks: f64,
        disturbance: Option<(usize, f64)>,
    ) -> Self {
        let mut waiting = VecDeque::with_capacity(MOST_WAITING);
        waiting.resize(MOST_WAITING, vec![0.0; axes.len()]);
        Self { axes, outputs, delay_ticks, waiting, time_s: 0.0, disturbance }
    }

    /// The command for an axis that came so many ticks ago, 0 for the present one.
    fn command(&self, ticks: usize, axis: usize) -> f64 {
        let place = self.waiting.len().checked_sub(ticks + 1);
        place.and_then(|place| self.waiting.get(place)?.get(axis).copied()).unwrap_or_default()
    }
}

/// All of them together.
pub(super) fn sum_at(motions: &[Motion], time_s: f64) -> f64 {
    motions.iter().map(|motion| motion.at(time_s)).sum()
}

impl Plant for Instrumented {
    fn dof(&self) -> usize {
        self.axes.len()
    }

    fn sense(&mut self, measured: &mut [f32]) {
        let Self { axes, outputs, time_s, .. } = self;
        for (output, words) in outputs.iter_mut().zip(measured.chunks_mut(axes.len().max(1))) {
            for (axis, word) in words.iter_mut().enumerate() {
                let state = axes.get(axis).map(|axis| axis.joint.state()).unwrap_or_default();
                let value = match output {
                    Output::Sensed(data_type, sensors) => {
                        let truth = sensed(data_type, &state);
                        sensors.get_mut(axis).map_or(truth, |sensor| sensor.show(*time_s, truth).into())
                    }
                    Output::Reference(motions) => motions.get(axis).map_or(0.0, |all| sum_at(all, *time_s)),
                };
                #[expect(clippy::cast_possible_truncation, reason = "the controller's number is an f32")]
                let value = value as f32;
                *word = value;
            }
        }
    }

    fn advance(&mut self, start_s: f64, period_s: f64, command: &[f32]) {
        self.waiting.rotate_left(1);
        if let Some(newest) = self.waiting.back_mut() {
            for (axis, newest) in newest.iter_mut().enumerate() {
                *newest = command.get(axis).copied().unwrap_or_default().into();
            }
            if let Some((axis, force)) = self.disturbance.take()
                && let Some(newest) = newest.get_mut(axis)
            {
                *newest += force;
            }
        }
        let whole_ticks = libm::floor(self.delay_ticks);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 3")]
        let ticks = whole_ticks as usize;
        let change_s = (self.delay_ticks - whole_ticks) * period_s;
        for axis in 0..self.axes.len() {
            let (older, newer) = (self.command(ticks + 1, axis), self.command(ticks, axis));
            let Some(Axis { joint, load, hand, hand_stiffness, .. }) = self.axes.get_mut(axis) else {
                continue;
            };
            let load = |time_s: f64| sum_at(load, time_s) + *hand_stiffness * sum_at(hand, time_s);
            if change_s > 0.0 {
                joint.advance(start_s, change_s, older, &load);
            }
            joint.advance(start_s + change_s, period_s - change_s, newer, &load);
        }
        self.time_s = start_s + period_s;
    }

    fn truth(&self, _axis: usize) -> Option<AxisTruth> {
        None
    }

    fn is_touching(&self, axis: usize) -> bool {
        self.axes.get(axis).is_some_and(|axis| axis.joint.is_at_stop())
    }

    fn quantities(&self, axis: usize) -> &'static [(&'static str, &'static str)] {
        match self.axes.get(axis).map(|axis| axis.unit) {
            Some(AxisUnit::Metre) => &[
                ("position", "m"),
                ("velocity", "m/s"),
                ("actuator_force", "N"),
                ("load", "N"),
                ("current", "A"),
                ("voltage", "V"),
                ("winding", "°C"),
            ],
            _ => &[
                ("position", "rad"),
                ("velocity", "rad/s"),
                ("actuator_force", "N·m"),
                ("load", "N·m"),
                ("current", "A"),
                ("voltage", "V"),
                ("winding", "°C"),
            ],
        }
    }

    fn look(&self, axis: usize, values: &mut [f64]) {
        let Some(of_axis) = self.axes.get(axis) else { return };
        let state = of_axis.joint.state();
        let JointState { position, velocity, force, current_a, voltage_v, winding_c, .. } = state;
        let load = of_axis.pushed_by(self.time_s, position);
        let known = [position, velocity, force, load, current_a, voltage_v, winding_c];
        for (entry, value) in values.iter_mut().zip(known) {
            *entry = value;
        }
    }
}

/// What a sensor shows of a joint.
fn sensed(data_type: &DataType, state: &JointState) -> f64 {
    match data_type.id {
        id if id == types::VELOCITY.id => state.velocity,
        id if id == types::FORCE.id => state.force,
        _ => state.position,
    }
}
