//! A device as seen by a controller: sensors of its axes, and references.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use dimsart_core::{DataType, types};
use drive::DriveReading;

use super::axis::{Axis, AxisState};
use super::machine::{Machine, Positions};
use crate::motion::{Motion, sum_at};
use crate::plant::{Actuation, Plant, Repetition, Sensor};
use crate::rig_file::AxisUnit;

/// The axes of a machine of one controller, with the frame of its device.
#[derive(Debug)]
pub(super) struct Instrumented {
    machine: Arc<Mutex<Machine>>,
    /// Indices of the axes in the machine.
    axes: Vec<usize>,
    /// Sources of the frame, in order, with one value per axis.
    outputs: Vec<Output>,
    /// Whether it has a plant; otherwise only references.
    moves: bool,
    /// Whether the experiment is a [press](crate::rig_file::PressSection).
    is_pressed: bool,
    /// Whether the actuator of each axis holds its force for a period.
    holds_force: Vec<bool>,
    /// Whether its actuators can be off.
    can_be_off: bool,
    /// Positions of the machine's axes, readable without locking it.
    positions: Arc<Positions>,
    time_s: f64,
}

/// Source of a part of the frame.
#[derive(Debug)]
pub(super) enum Output {
    /// Sensors of every axis.
    Sensed(&'static DataType, Vec<Sensor>),
    /// References of every axis.
    Reference(Vec<Vec<Motion>>),
}

impl Instrumented {
    pub(super) fn new(
        machine: Arc<Mutex<Machine>>,
        axes: Vec<usize>,
        outputs: Vec<Output>,
        moves: bool,
        is_pressed: bool,
    ) -> Self {
        let known = machine.lock().unwrap_or_else(PoisonError::into_inner);
        let holds_force = axes.iter().map(|axis| known.holds_force(*axis)).collect();
        let (can_be_off, positions) = (!known.body().holds_commands(), known.positions());
        drop(known);
        Self { machine, axes, outputs, moves, is_pressed, holds_force, can_be_off, positions, time_s: 0.0 }
    }

    fn machine(&self) -> MutexGuard<'_, Machine> {
        // A poisoned lock is safe: every call leaves the machine consistent.
        self.machine.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Converts an axis of the controller to an axis of the machine.
    fn axis(&self, place: usize) -> Option<usize> {
        self.axes.get(place).copied()
    }
}

impl Plant for Instrumented {
    fn dof(&self) -> usize {
        self.axes.len()
    }

    fn sense(&mut self, measured: &mut [f32]) {
        let Self { machine, axes, outputs, time_s, .. } = self;
        let machine = machine.lock().unwrap_or_else(PoisonError::into_inner);
        for (output, words) in outputs.iter_mut().zip(measured.chunks_mut(axes.len().max(1))) {
            for (place, (axis, word)) in axes.iter().zip(words).enumerate() {
                let value = match output {
                    Output::Sensed(data_type, sensors) => {
                        let body = machine.body();
                        let position = match data_type.id == types::POSITION.id {
                            true => body.joint_position(*axis),
                            false => None,
                        };
                        let truth = position.unwrap_or_else(|| sensed(data_type, &machine.state(*axis)));
                        match sensors.get_mut(place) {
                            Some(sensor) if !sensor.is_ideal() => sensor.measure(*time_s, truth).into(),
                            _ => truth,
                        }
                    }
                    Output::Reference(motions) => {
                        let at = |time_s| motions.get(place).map_or(0.0, |all| sum_at(all, time_s));
                        machine.repetition().value(*time_s, at)
                    }
                };
                #[expect(clippy::cast_possible_truncation, reason = "the controller's number is an f32")]
                let value = value as f32;
                *word = value;
            }
        }
    }

    fn advance(&mut self, start_s: f64, period_s: f64, command: &[f32]) {
        let commands = command.iter().copied().map(f64::from).chain(std::iter::repeat(0.0));
        self.machine().take(start_s, period_s, self.axes.iter().copied().zip(commands));
        self.time_s = start_s + period_s;
    }

    fn set_enabled(&mut self, is_on: bool) {
        if self.can_be_off {
            self.machine().set_enabled(&self.axes, is_on);
        }
    }

    fn repeat(&mut self, repetition: Repetition) {
        self.machine().repeat(repetition);
    }

    fn hold_hand(&mut self, axis: usize, position: Option<f64>) {
        if let Some(axis) = self.axis(axis) {
            self.machine().hold_hand(axis, position);
        }
    }

    fn position(&self, axis: usize) -> f64 {
        self.axis(axis).map_or(f64::NAN, |axis| self.positions.of(axis))
    }

    fn add_actuations(&self, actuations: &mut Vec<Actuation>) {
        if !self.moves {
            return;
        }
        let machine = self.machine();
        for (axis, is_held) in self.axes.iter().zip(&self.holds_force) {
            let (position, force, joint) = machine.body().actuation(*axis);
            let position = joint.map_or(position, |[turned, _]| turned);
            let is_coupled = joint.is_some();
            actuations.push(Actuation { position, force, is_zero_order_hold: *is_held, is_coupled });
        }
    }

    fn is_touching(&self, axis: usize) -> bool {
        self.axis(axis).is_some_and(|axis| self.machine().is_touching(axis))
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
        // In a press: force of hand and obstacle.
        const PRESSED: [(&str, &str); 9] = [
            ("position", "m"),
            ("velocity", "m/s"),
            ("actuator_force", "N"),
            ("hand_force", "N"),
            ("wall_force", "N"),
            ("load", "N"),
            ("current", "A"),
            ("voltage", "V"),
            ("winding", "°C"),
        ];
        // Its motors drive the joints.
        const AT_TIP: [(&str, &str); 4] =
            [("position", "m"), ("velocity", "m/s"), ("actuator_force", "N·m"), ("load", "N")];
        let Some(axis) = self.axis(axis).filter(|_| self.moves) else { return &[] };
        let machine = self.machine();
        let known: &[_] = match machine.axis(axis).map(|axis| axis.section.unit) {
            _ if machine.state(axis).joint.is_some() => &AT_TIP,
            Some(AxisUnit::Metre) if self.is_pressed => &PRESSED,
            Some(AxisUnit::Metre) => &LINEAR,
            _ => &ROTARY,
        };
        // Coupled axes have no motors of their own.
        let has_motor = machine.state(axis).motor.is_some();
        let is_ideal =
            |axis: &Axis| axis.section.plant.as_ref().is_some_and(|plant| !plant.motor.has_winding());
        let count = match self.is_pressed && machine.axis(axis).is_some_and(is_ideal) {
            // Its load is the hand's force.
            true => 5,
            false if has_motor => known.len(),
            false => 4,
        };
        known.get(..count).unwrap_or_default()
    }

    fn read_quantities(&self, axis: usize, values: &mut [f64]) {
        let (Some(axis), machine) = (self.axis(axis), self.machine()) else { return };
        let Some(of_axis) = machine.axis(axis) else { return };
        let state = machine.state(axis);
        let AxisState { position, velocity, force, motor, .. } = state;
        let load = of_axis.pushed_by(machine.repetition(), self.time_s, position);
        let pressed = self.is_pressed.then(|| {
            let acceleration = machine.body().acceleration(axis);
            let hand = of_axis.hand_force(machine.repetition(), self.time_s, &state, acceleration);
            [hand, of_axis.section.environment_force(position, velocity)]
        });
        let known = [position, velocity, force].into_iter().chain(pressed.into_iter().flatten());
        let known = known.chain([load]).chain(motor.into_iter().flatten());
        for (entry, value) in values.iter_mut().zip(known) {
            *entry = value;
        }
    }
}

/// Sensed quantity of an axis.
pub(super) fn sensed(data_type: &DataType, state: &AxisState) -> f64 {
    if let Some(reading) = &state.reading {
        return said(data_type, reading).into();
    }
    let [position, velocity] = state.joint.unwrap_or([state.position, state.velocity]);
    let [current_a, voltage_v, winding_c] = state.motor.unwrap_or_default();
    match data_type.id {
        id if id == types::VELOCITY.id => velocity,
        id if id == types::FORCE.id => state.force,
        id if id == types::MOTOR_CURRENT.id => current_a,
        id if id == types::MOTOR_VOLTAGE.id => voltage_v,
        id if id == types::WINDING_TEMPERATURE.id => winding_c,
        _ => position,
    }
}

/// Drive reading of an axis.
fn said(data_type: &DataType, reading: &DriveReading) -> f32 {
    match data_type.id {
        id if id == types::VELOCITY.id => reading.velocity_rad_per_s,
        id if id == types::MEASURED_TORQUE.id => reading.torque_nm,
        id if id == types::BUS_VOLTAGE.id => reading.voltage_v,
        id if id == types::TEMPERATURE.id => reading.temperature_c,
        id if id == types::DRIVE_FAULT.id => reading.fault(),
        _ => reading.position_rad,
    }
}
