//! Independent joints as a plant, for tests of a controller without a rig file.

use super::{Actuation, Joint, Plant};

/// Force on a joint by time, `s`, constant within a period.
pub type ExternalForce = Box<dyn Fn(f64) -> f64 + Send>;

/// Independent joints and their external forces.
#[derive(Default)]
pub struct Joints {
    joints: Vec<(Joint, Option<ExternalForce>)>,
}

impl core::fmt::Debug for Joints {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_list().entries(self.joints.iter().map(|(joint, _)| joint)).finish()
    }
}

impl Joints {
    /// Creates a plant of joints with their external forces.
    #[must_use]
    pub fn new(joints: Vec<(Joint, Option<ExternalForce>)>) -> Self {
        Self { joints }
    }

    /// Returns the joints in the order of their axes.
    pub fn joints_mut(&mut self) -> impl Iterator<Item = &mut Joint> {
        self.joints.iter_mut().map(|(joint, _)| joint)
    }

    fn joint(&self, axis: usize) -> Option<&Joint> {
        self.joints.get(axis).map(|(joint, _)| joint)
    }
}

impl Plant for Joints {
    fn dof(&self) -> usize {
        self.joints.len()
    }

    fn sense(&mut self, measured: &mut [f32]) {
        for (entry, (joint, _)) in measured.iter_mut().zip(&self.joints) {
            #[expect(clippy::cast_possible_truncation, reason = "the controller's number is an f32")]
            let position = joint.position() as f32;
            *entry = position;
        }
    }

    fn advance(&mut self, start_s: f64, period_s: f64, command: &[f32]) {
        let commands = command.iter().copied().chain(core::iter::repeat(0.0));
        for ((joint, push), command) in self.joints.iter_mut().zip(commands) {
            let force = push.as_ref().map_or(0.0, |push| push(start_s));
            joint.advance(start_s, period_s, f64::from(command), &|_| force);
        }
    }

    fn position(&self, axis: usize) -> f64 {
        self.joint(axis).map_or(f64::NAN, Joint::position)
    }

    fn add_actuations(&self, actuations: &mut Vec<Actuation>) {
        let actuation = |(joint, _): &(Joint, Option<ExternalForce>)| {
            let state = joint.state();
            Actuation {
                position: state.position,
                force: state.force,
                is_zero_order_hold: true,
                is_coupled: false,
            }
        };
        actuations.extend(self.joints.iter().map(actuation));
    }

    fn is_touching(&self, axis: usize) -> bool {
        self.joint(axis).is_some_and(Joint::is_at_stop)
    }

    fn quantities(&self, _axis: usize) -> &'static [(&'static str, &'static str)] {
        &[("position", "m"), ("velocity", "m/s"), ("actuator_force", "N")]
    }

    fn read_quantities(&self, axis: usize, values: &mut [f64]) {
        let Some(state) = self.joint(axis).map(Joint::state) else { return };
        for (entry, value) in values.iter_mut().zip([state.position, state.velocity, state.force]) {
            *entry = value;
        }
    }
}
