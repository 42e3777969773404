//! Plants of devices: independent joints, or coupled axes.

use dimsart_core::limits::MAX_DOF;

use super::axis::{Axis, AxisState};
use crate::experiment::ExperimentError;
use crate::plant::{Arm, AxisValues, DriveBus, Joint, JointParameters, Phantom, PhantomPort, Repetition};
use crate::rig_file::{AxisSection, DeviceSection};

/// The plant of a device.
#[derive(Debug)]
pub(super) enum Body {
    Joints(Vec<Joint>),
    Arm(Box<Arm>),
    Phantom(Box<Tip>),
    Drives(Box<DriveBus>),
}

/// A `PHANToM`, with Cartesian positions relative to its start.
#[derive(Debug)]
pub(super) struct Tip {
    phantom: Phantom,
    origin_m: [f64; 3],
    /// Command of the last period, at its port.
    command: [f64; 3],
}

impl Body {
    /// Creates the plant of a device at rest, for ticks of `tick_s`.
    ///
    /// # Errors
    /// [`ExperimentError::Plant`] for invalid parameters.
    pub(super) fn new(section: &DeviceSection, tick_s: f64, seed: u64) -> Result<Self, ExperimentError> {
        let wrong = |axis: usize| {
            let place = format!("device '{}', axis {axis}", section.name);
            move |error| ExperimentError::Plant { place, error }
        };
        if !section.has_actuators() {
            return Ok(Self::Joints(Vec::new()));
        }
        let inertia = |axis: &AxisSection| axis.hand.as_ref().map_or(0.0, |hand| hand.inertia);
        if let Some(arm) = &section.arm {
            let mut arm = arm.clone();
            for (link, axis) in arm.link.iter_mut().zip(&section.axes) {
                link.motor_inertia += inertia(axis);
            }
            return Ok(Self::Arm(Box::new(arm.build().map_err(wrong(0))?)));
        }
        if let Some(phantom) = &section.phantom {
            let mut phantom = phantom.clone();
            if phantom.port.is_held_at_tip() {
                phantom.linkage.tip_kg += section.axes.first().map_or(0.0, inertia);
            }
            let phantom = phantom.build().map_err(wrong(0))?;
            let origin_m = phantom.tip(0.0).position_m;
            return Ok(Self::Phantom(Box::new(Tip { phantom, origin_m, command: [0.0; 3] })));
        }
        let joints = section.axes.iter().enumerate().map(|(axis, of_axis)| {
            let joint = of_axis.joint().unwrap_or_else(|| JointParameters::of_inertia(1.0));
            joint.build().map_err(wrong(axis))
        });
        let joints = joints.collect::<Result<_, _>>()?;
        Ok(match (&section.moteus, &section.cia402) {
            (Some(moteus), _) => Self::Drives(Box::new(moteus.build(joints, seed))),
            (_, Some(cia402)) => Self::Drives(Box::new(cia402.build(joints, tick_s, seed))),
            _ => Self::Joints(joints),
        })
    }

    /// Returns the true state of an axis; 0 for a nonexistent axis.
    pub(super) fn state(&self, axis: usize) -> AxisState {
        match self {
            Self::Joints(joints) => joints.get(axis).map_or_else(AxisState::default, AxisState::of),
            Self::Drives(bus) => {
                let state = bus.joint(axis).map_or_else(AxisState::default, AxisState::of);
                AxisState { reading: bus.reading(axis).copied(), ..state }
            }
            Self::Arm(arm) => {
                let state = arm.axis(axis);
                let (position, velocity) = (state.position, state.velocity);
                AxisState { position, velocity, force: state.actuator_force, ..AxisState::default() }
            }
            Self::Phantom(tip) => tip.state(axis),
        }
    }

    /// Returns the position of a joint that is measured directly; `None` for other axes.
    pub(super) fn joint_position(&self, axis: usize) -> Option<f64> {
        match self {
            Self::Joints(joints) => joints.get(axis).map(Joint::position),
            Self::Drives(_) | Self::Arm(_) | Self::Phantom(_) => None,
        }
    }

    /// Returns the position of an axis; 0 for a nonexistent axis.
    pub(super) fn position(&self, axis: usize) -> f64 {
        match self {
            Self::Joints(joints) => joints.get(axis).map_or(0.0, Joint::position),
            Self::Drives(_) | Self::Arm(_) | Self::Phantom(_) => self.state(axis).position,
        }
    }

    /// Returns the position and actuator of an axis, and the joint angle if the axis is a direction of the tip.
    pub(super) fn actuation(&self, axis: usize) -> (f64, f64, Option<[f64; 2]>) {
        match self {
            Self::Joints(joints) => {
                joints.get(axis).map_or((0.0, 0.0, None), |joint| (joint.position(), joint.force(), None))
            }
            Self::Drives(_) | Self::Arm(_) | Self::Phantom(_) => {
                let AxisState { position, force, joint, .. } = self.state(axis);
                (position, force, joint)
            }
        }
    }

    /// Returns the acceleration of an uncoupled axis; 0 for a coupled one.
    pub(super) fn acceleration(&self, axis: usize) -> f64 {
        match self {
            Self::Joints(joints) => joints.get(axis).map_or(0.0, Joint::acceleration),
            Self::Drives(bus) => bus.joint(axis).map_or(0.0, Joint::acceleration),
            Self::Arm(_) | Self::Phantom(_) => 0.0,
        }
    }

    /// Changes the spring of an uncoupled axis.
    pub(super) fn hold(&mut self, axis: usize, stiffness: f64, rest_position: f64) {
        match self {
            Self::Joints(joints) => {
                if let Some(joint) = joints.get_mut(axis) {
                    joint.set_load_spring(stiffness, rest_position);
                }
            }
            Self::Drives(_) | Self::Arm(_) | Self::Phantom(_) => {}
        }
    }

    /// Returns its state by axis.
    pub(super) fn values(&self) -> Vec<f64> {
        let coupled = |positions: &AxisValues, velocities: &AxisValues, axes: usize| {
            positions.iter().take(axes).chain(velocities.iter().take(axes)).copied().collect()
        };
        match self {
            Self::Joints(joints) => joints.iter().flat_map(Joint::values).collect(),
            Self::Drives(bus) => {
                (0..MAX_DOF).map_while(|axis| bus.joint(axis)).flat_map(Joint::values).collect()
            }
            Self::Arm(arm) => coupled(arm.positions(), arm.velocities(), arm.axes()),
            Self::Phantom(tip) => {
                let body = tip.phantom.dynamics();
                coupled(body.positions(), body.velocities(), body.axes())
            }
        }
    }

    /// Sets its state.
    pub(super) fn set_values(&mut self, values: &[f64]) {
        let set = |joint: &mut Joint, left: &mut &[f64]| {
            let (own, rest) = left.split_at_checked(joint.values().len()).unwrap_or_default();
            joint.set_values(own);
            *left = rest;
        };
        let mut left = values;
        let (positions, velocities) = values.split_at(values.len() / 2);
        match self {
            Self::Joints(joints) => joints.iter_mut().for_each(|joint| set(joint, &mut left)),
            Self::Drives(bus) => bus.joints_mut().for_each(|joint| set(joint, &mut left)),
            Self::Arm(arm) => arm.set_state(positions, velocities),
            Self::Phantom(tip) => tip.phantom.body_mut().set_state(positions, velocities),
        }
    }

    /// Whether an axis or its machine is in contact with a stop.
    pub(super) fn is_at_stop(&self, axis: usize) -> bool {
        match self {
            Self::Joints(joints) => joints.get(axis).is_some_and(Joint::is_at_stop),
            Self::Drives(bus) => bus.joint(axis).is_some_and(Joint::is_at_stop),
            Self::Arm(arm) => arm.is_at_stop(),
            Self::Phantom(tip) => tip.phantom.dynamics().is_at_stop(),
        }
    }

    /// Sets whether the actuator of an axis is commanded or off from the next period on.
    pub(super) fn set_enabled(&mut self, axis: usize, is_on: bool) {
        if let Self::Drives(bus) = self {
            bus.set_enabled(axis, is_on);
        }
    }

    /// Whether an actuator holds its command for a whole period.
    pub(super) fn holds_commands(&self) -> bool {
        !matches!(self, Self::Drives(_))
    }

    /// Applies the constant `commands` from `start_s` for `period_s`, with the environment of its axes.
    pub(super) fn advance(
        &mut self,
        start_s: f64,
        period_s: f64,
        commands: &[f64],
        axes: &mut [Axis],
        repetition: Repetition,
    ) {
        if period_s <= 0.0 {
            return;
        }
        if let Self::Joints(joints) = self {
            for ((joint, axis), command) in joints.iter_mut().zip(axes).zip(commands) {
                match axis.still_outside(repetition, start_s, period_s) {
                    Some(force) => joint.advance_with_constant_force(start_s, period_s, *command, force),
                    None => {
                        let outside = |time_s: f64| axis.outside(repetition, time_s);
                        joint.advance(start_s, period_s, *command, &outside);
                    }
                }
            }
            return;
        }
        let axes = &*axes;
        let command = |axis: usize| commands.get(axis).copied().unwrap_or_default();
        let outside =
            |axis: usize, time_s: f64| axes.get(axis).map_or(0.0, |axis| axis.outside(repetition, time_s));
        let force = |axis: usize, time_s: f64, position: f64, velocity: f64| {
            let around = |axis: &Axis| axis.section.force(position, velocity);
            outside(axis, time_s) + axes.get(axis).map_or(0.0, around)
        };
        match self {
            Self::Joints(_) => {}
            Self::Drives(bus) => bus.advance(start_s, period_s, command, &outside),
            Self::Arm(arm) => {
                let pushed = pushes(arm.axes(), &force);
                arm.advance_under(start_s, period_s, core::array::from_fn(command), &pushed);
            }
            Self::Phantom(tip) => tip.advance(start_s, period_s, core::array::from_fn(command), &force),
        }
    }
}

/// External forces on coupled axes by time, position and velocity.
fn pushes(
    axes: usize,
    force: &dyn Fn(usize, f64, f64, f64) -> f64,
) -> impl Fn(f64, &AxisValues, &AxisValues) -> AxisValues {
    move |time_s, positions, velocities| {
        let mut forces = [0.0; MAX_DOF];
        let places = positions.iter().zip(velocities).enumerate().take(axes);
        for (of_axis, (axis, (position, velocity))) in forces.iter_mut().zip(places) {
            *of_axis = force(axis, time_s, *position, *velocity);
        }
        forces
    }
}

impl AxisState {
    fn of(joint: &Joint) -> Self {
        let state = joint.state();
        Self {
            position: state.position,
            velocity: state.velocity,
            force: state.force,
            motor: Some([state.current_a, state.voltage_v, state.winding_c]),
            reading: None,
            joint: None,
        }
    }
}

impl Tip {
    fn state(&self, axis: usize) -> AxisState {
        let of = |values: &[f64; 3]| values.get(axis).copied().unwrap_or_default();
        let force = of(&self.command);
        match self.phantom.port() {
            port @ (PhantomPort::Cartesian | PhantomPort::HeldAtTip) => {
                let tip = self.phantom.tip(0.0);
                let position = of(&tip.position_m) - of(&self.origin_m);
                let turned = self.phantom.axis(axis);
                let joint = (port == PhantomPort::HeldAtTip).then_some([turned.position, turned.velocity]);
                let velocity = of(&tip.velocity_m_per_s);
                AxisState { position, velocity, force, joint, ..AxisState::default() }
            }
            PhantomPort::Joint => {
                let state = self.phantom.axis(axis);
                let (position, velocity) = (state.position, state.velocity);
                AxisState { position, velocity, force: state.actuator_force, ..AxisState::default() }
            }
        }
    }

    fn advance(
        &mut self,
        start_s: f64,
        period_s: f64,
        command: [f64; 3],
        force: &dyn Fn(usize, f64, f64, f64) -> f64,
    ) {
        self.command = command;
        match self.phantom.port() {
            PhantomPort::Cartesian | PhantomPort::HeldAtTip => {
                let origin_m = self.origin_m;
                self.phantom.advance_at_tip(start_s, period_s, command, &|tip| {
                    let places = tip.position_m.iter().zip(origin_m).zip(tip.velocity_m_per_s);
                    let mut forces = [0.0; 3];
                    for (axis, (of_axis, ((position_m, origin_m), velocity))) in
                        forces.iter_mut().zip(places).enumerate()
                    {
                        *of_axis = force(axis, tip.time_s, position_m - origin_m, velocity);
                    }
                    forces
                });
            }
            PhantomPort::Joint => {
                self.phantom.advance_under(start_s, period_s, command, &pushes(3, force));
            }
        }
    }
}
