//! Advances a coupled machine by periods of constant command.

use super::state::State;
use super::step::{Outside, Period};
use super::{AxisValues, Coupled, Mechanism, Tip, transposed};
use dimsart_core::limits::MAX_DOF;

impl<M: Mechanism> Coupled<M> {
    /// Applies the constant `command` (`N m` or `N`, one per axis; missing entries are 0, surplus is ignored) from
    /// `start_s` for `period_s` with the external torques `load(axis, time_s)` (`N m` or `N`, positive towards larger
    /// positions).
    ///
    /// NaN and infinite commands are applied unchanged within the actuator's limit.
    pub fn advance(
        &mut self,
        start_s: f64,
        period_s: f64,
        command: &[f32],
        load: &dyn Fn(usize, f64) -> f64,
    ) {
        let axes = self.axes();
        let forces = self.limited(self.commanded(command));
        self.state = self.after(start_s, period_s, forces, &|time_s, _, _| {
            let mut torques = [0.0; MAX_DOF];
            for (axis, torque) in torques.iter_mut().take(axes).enumerate() {
                *torque = load(axis, time_s);
            }
            torques
        });
        self.actuator_forces = forces;
    }

    /// Like [`advance`](Self::advance), with an external force on the tip (`N`, base frame) that can depend on its
    /// position and velocity, such as of a wall or hand.
    pub fn advance_with_tip_force(
        &mut self,
        start_s: f64,
        period_s: f64,
        command: &[f32],
        push: &dyn Fn(&Tip) -> [f64; 3],
    ) {
        self.advance_pushed_by(start_s, period_s, self.commanded(command), push);
    }

    /// [`advance_with_tip_force`](Self::advance_with_tip_force) with commanded torques `wanted`.
    pub(in crate::plant) fn advance_pushed_by(
        &mut self,
        start_s: f64,
        period_s: f64,
        wanted: AxisValues,
        push: &dyn Fn(&Tip) -> [f64; 3],
    ) {
        let forces = self.limited(wanted);
        self.state = self.after(start_s, period_s, forces, &|time_s, position, velocity| {
            let force_n = push(&self.tip_of(time_s, position, velocity));
            transposed(&self.mechanism.tip_jacobian(position), &force_n)
        });
        self.actuator_forces = forces;
    }

    /// [`advance`](Self::advance) with commanded torques `wanted` and external torques that can depend on time,
    /// positions and velocities.
    pub(crate) fn advance_under(
        &mut self,
        start_s: f64,
        period_s: f64,
        wanted: AxisValues,
        outside: &dyn Fn(f64, &AxisValues, &AxisValues) -> AxisValues,
    ) {
        let forces = self.limited(wanted);
        self.state = self.after(start_s, period_s, forces, outside);
        self.actuator_forces = forces;
    }

    fn after(&self, start_s: f64, period_s: f64, actuator_forces: AxisValues, outside: Outside<'_>) -> State {
        let period = Period { coupled: self, actuator_forces, outside };
        let mut state = self.state;
        period.pass(&mut state, start_s, start_s + period_s);
        state
    }

    /// Converts the command to torques.
    fn commanded(&self, command: &[f32]) -> AxisValues {
        let mut wanted = [0.0; MAX_DOF];
        for (wanted, command) in wanted.iter_mut().take(self.axes()).zip(command) {
            *wanted = f64::from(*command);
        }
        wanted
    }

    /// Limits the commanded torques.
    fn limited(&self, wanted: AxisValues) -> AxisValues {
        let mut forces = wanted;
        for (force, actuator) in forces.iter_mut().zip(&self.actuators) {
            *force = force.clamp(-actuator.effort_limit, actuator.effort_limit);
        }
        forces
    }
}
