//! Time constants of a coupled machine, and whether it can be simulated.

use super::factors::Factors;
use super::{AxisValues, Coupled, Mechanism};
use crate::plant::parameter::{ParameterError, require};
use dimsart_core::limits::MAX_DOF;

/// Steps per time constant: none is much longer than 0.1 time constants.
const STEPS_PER_TIME_CONSTANT: f64 = 10.0;
/// Maximum steps per millisecond.
const STEPS_PER_MS_MAX: f64 = 5000.0;

/// # Errors
/// The fastest parameter at the start, if it takes too many steps.
pub(super) fn check<M: Mechanism>(coupled: &Coupled<M>) -> Result<(), ParameterError> {
    let is_held = core::array::from_fn(|axis| axis >= coupled.axes());
    let factors = Factors::of(&coupled.dynamics(&coupled.state.position, &[0.0; MAX_DOF]).mass, is_held);
    // Path and value of a damper or spring, and its rate.
    let resolved = |path: &str, value: f64, per_s: f64| {
        let steps_per_ms = 1e-3 * per_s * STEPS_PER_TIME_CONSTANT;
        let allowed =
            format!("small enough for {STEPS_PER_MS_MAX} sub-steps per ms (needs {steps_per_ms:.0})");
        require(path, value, steps_per_ms <= STEPS_PER_MS_MAX, &allowed)
    };
    for (axis, actuator) in coupled.actuators.iter().enumerate() {
        let direction: AxisValues = core::array::from_fn(|other| if other == axis { 1.0 } else { 0.0 });
        let viscous = actuator.viscous;
        resolved(&actuator.viscous_path, viscous, viscous * factors.mobility(&direction))?;
    }
    for stop in &coupled.stops {
        let mobility = factors.mobility(&stop.direction);
        let (stiffness, damping) = (stop.ends.stiffness, stop.ends.damping);
        resolved(&stop.stiffness_path, stiffness, (stiffness * mobility).sqrt())?;
        resolved(&stop.damping_path, damping, damping * mobility)?;
    }
    Ok(())
}
