//! A device of a rig: what moves, with sensors and a delay, and references that come with what is measured.

use std::collections::VecDeque;

use dimsart_core::{DataType, types};

use super::body::{AxisState, Body};
use super::motion::Motion;
use crate::plant::{AxisTruth, Plant, Sensor};
use crate::rig_file::{AxisSection, AxisUnit};

/// Most ticks that a command can wait.
const MOST_WAITING: usize = 5;

/// What moves, behind the frame of a device.
#[derive(Debug)]
pub(super) struct Instrumented {
    body: Body,
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

/// What pushes and holds an axis.
#[derive(Debug)]
pub(super) struct Axis {
    pub(super) section: AxisSection,
    pub(super) load: Vec<Motion>,
    /// Where its hand wants to be.
    pub(super) hand: Vec<Motion>,
}

impl Axis {
    /// By time alone: the load, and what the hand wants more than 0.
    fn outside(&self, time_s: f64) -> f64 {
        sum_at(&self.load, time_s) + self.section.hand_stiffness() * sum_at(&self.hand, time_s)
    }

    /// The load, and the hand's spring.
    fn pushed_by(&self, time_s: f64, position: f64) -> f64 {
        self.outside(time_s) - self.section.hand_stiffness() * position
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
    /// At rest, before the first command.
    pub(super) fn new(
        body: Body,
        axes: Vec<Axis>,
        outputs: Vec<Output>,
        delay_ticks: f64,
        disturbance: Option<(usize, f64)>,
    ) -> Self {
        let mut waiting = VecDeque::with_capacity(MOST_WAITING);
        waiting.resize(MOST_WAITING, vec![0.0; axes.len()]);
        Self { body, axes, outputs, delay_ticks, waiting, time_s: 0.0, disturbance }
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
        let Self { body, axes, outputs, time_s, .. } = self;
        for (output, words) in outputs.iter_mut().zip(measured.chunks_mut(axes.len().max(1))) {
            for (axis, word) in words.iter_mut().enumerate() {
                let value = match output {
                    Output::Sensed(data_type, sensors) => {
                        let truth = sensed(data_type, &body.state(axis));
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
        let Self { body, axes, waiting, .. } = self;
        let held = |ticks: usize| {
            let place = waiting.len().checked_sub(ticks + 1);
            place.and_then(|place| waiting.get(place)).map(Vec::as_slice).unwrap_or_default()
        };
        let outside = |axis: usize, time_s: f64| axes.get(axis).map_or(0.0, |axis| axis.outside(time_s));
        let around = |axis: usize, position: f64, velocity: f64| {
            axes.get(axis).map_or(0.0, |axis| axis.section.force(position, velocity))
        };
        body.advance(start_s, change_s, held(ticks + 1), &outside, &around);
        body.advance(start_s + change_s, period_s - change_s, held(ticks), &outside, &around);
        self.time_s = start_s + period_s;
    }

    fn truth(&self, _axis: usize) -> Option<AxisTruth> {
        None
    }

    fn is_touching(&self, axis: usize) -> bool {
        let wall = self.axes.get(axis).and_then(|axis| axis.section.wall.as_ref());
        let position = self.body.state(axis).position;
        self.body.is_at_stop(axis) || wall.is_some_and(|wall| wall.depth(position) > 0.0)
    }

    fn quantities(&self, axis: usize) -> &'static [(&'static str, &'static str)] {
        const LINEAR: [(&str, &str); 7] = [
            ("position", "m"),
            ("velocity", "m/s"),
            ("actuator_force", "N"),
            ("load", "N"),
            ("current", "A"),
            ("voltage", "V"),
            ("winding", "°C"),
        ];
        const ROTARY: [(&str, &str); 7] = [
            ("position", "rad"),
            ("velocity", "rad/s"),
            ("actuator_force", "N·m"),
            ("load", "N·m"),
            ("current", "A"),
            ("voltage", "V"),
            ("winding", "°C"),
        ];
        let known: &[_] = match self.axes.get(axis).map(|axis| axis.section.unit) {
            Some(AxisUnit::Metre) => &LINEAR,
            _ => &ROTARY,
        };
        // Coupled axes have no motors of their own.
        let count = if self.body.state(axis).motor.is_some() { known.len() } else { 4 };
        known.get(..count).unwrap_or_default()
    }

    fn look(&self, axis: usize, values: &mut [f64]) {
        let Some(of_axis) = self.axes.get(axis) else { return };
        let AxisState { position, velocity, force, motor } = self.body.state(axis);
        let load = of_axis.pushed_by(self.time_s, position);
        let known = [position, velocity, force, load].into_iter().chain(motor.into_iter().flatten());
        for (entry, value) in values.iter_mut().zip(known) {
            *entry = value;
        }
    }
}

/// What a sensor shows of an axis.
fn sensed(data_type: &DataType, state: &AxisState) -> f64 {
    match data_type.id {
        id if id == types::VELOCITY.id => state.velocity,
        id if id == types::FORCE.id => state.force,
        _ => state.position,
    }
}
