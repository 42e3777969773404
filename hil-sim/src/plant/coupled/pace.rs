//! How fast a coupled machine can change now, and the sub-steps that resolve it.

use super::matrix::Factors;
use super::{Axes, Coupled, Mechanism};
use crate::plant::SUB_STEPS_MIN;
use crate::plant::parameter::{ParameterError, require};
use dimsart_core::limits::MAX_DOF;

/// Sub-steps per unit of time constant: a fourth-order Runge-Kutta step of a tenth errs by 1e-6 of it.
const SUB_STEPS_PER_TIME_CONSTANT: f64 = 10.0;
/// What a simulation can afford.
const SUB_STEPS_PER_MS_MAX: f64 = 5000.0;

/// Sub-steps for a period that starts in the present state. How light an axis is depends on where the others are, so
/// that this is asked anew in every period.
pub(super) fn sub_steps<M: Mechanism>(coupled: &Coupled<M>, period_s: f64) -> f64 {
    let velocity = &coupled.state.velocity;
    let mut squares_per_s2 = velocity.iter().map(|velocity| velocity * velocity).sum::<f64>();
    each(coupled, |_, _, per_s| squares_per_s2 += per_s * per_s);
    let sub_steps_per_s = SUB_STEPS_PER_TIME_CONSTANT * squares_per_s2.sqrt();
    (sub_steps_per_s.min(1e3 * SUB_STEPS_PER_MS_MAX) * period_s).ceil().max(f64::from(SUB_STEPS_MIN))
}

/// # Errors
/// The fastest parameter at the start, if it takes too many sub-steps.
pub(super) fn check<M: Mechanism>(coupled: &Coupled<M>) -> Result<(), ParameterError> {
    let mut outcome = Ok(());
    each(coupled, |path, value, per_s| {
        let sub_steps_per_ms = 1e-3 * per_s * SUB_STEPS_PER_TIME_CONSTANT;
        if outcome.is_ok() {
            let allowed = format!(
                "what {SUB_STEPS_PER_MS_MAX} sub-steps per millisecond resolve; this takes {sub_steps_per_ms:.0}"
            );
            outcome = require(path, value, sub_steps_per_ms <= SUB_STEPS_PER_MS_MAX, &allowed);
        }
    });
    outcome
}

/// Calls `see` with the path of each damper and spring, its value, and how fast it lets the machine change, `1/s`.
fn each<M: Mechanism>(coupled: &Coupled<M>, mut see: impl FnMut(&str, f64, f64)) {
    let is_held = core::array::from_fn(|axis| axis >= coupled.axes());
    let factors = Factors::of(&coupled.dynamics(&coupled.state.position, &[0.0; MAX_DOF]).mass, is_held);
    for (axis, actuator) in coupled.actuators.iter().enumerate() {
        let direction: Axes = core::array::from_fn(|other| if other == axis { 1.0 } else { 0.0 });
        let viscous = actuator.viscous;
        see(&actuator.viscous_path, viscous, viscous * factors.mobility(&direction));
    }
    for stop in &coupled.stops {
        let mobility = factors.mobility(&stop.direction);
        let (stiffness, damping) = (stop.ends.stiffness, stop.ends.damping);
        see(&stop.stiffness_path, stiffness, (stiffness * mobility).sqrt());
        see(&stop.damping_path, damping, damping * mobility);
    }
}
