//! Sub-steps that resolve the time constants of a joint.

use super::mechanics::Mechanics;
use super::pace::Pace;
use crate::plant::parameter::{ParameterError, require};

/// Sub-steps per time constant: a fourth-order Runge-Kutta step of 0.1 time constants has a relative error of 1e-6.
const SUB_STEPS_PER_TIME_CONSTANT: f64 = 10.0;
/// Maximum sub-steps per millisecond.
const SUB_STEPS_PER_MS_MAX: f64 = 5000.0;

/// Returns the sub-steps per second that resolve the joint.
///
/// # Errors
/// The parameter with the fastest rate, if it requires too many sub-steps.
pub(super) fn sub_steps_per_s(mechanics: &Mechanics) -> Result<f64, ParameterError> {
    let paces = paces(mechanics);
    let per_s = paces.iter().map(|pace| pace.per_s * pace.per_s).sum::<f64>().sqrt();
    let sub_steps_per_ms = 1e-3 * per_s * SUB_STEPS_PER_TIME_CONSTANT;
    if let Some(fastest) = paces.iter().max_by(|one, other| one.per_s.total_cmp(&other.per_s)) {
        let allowed =
            format!("small enough for {SUB_STEPS_PER_MS_MAX} sub-steps per ms (needs {sub_steps_per_ms:.0})");
        require(fastest.path, fastest.value, sub_steps_per_ms <= SUB_STEPS_PER_MS_MAX, &allowed)?;
    }
    Ok(1e3 * sub_steps_per_ms)
}

fn paces(mechanics: &Mechanics) -> Vec<Pace> {
    let Mechanics { load, stops, friction, gear, flexible, motor, rotor_kg_m2, .. } = mechanics;
    let ratio2 = gear.ratio * gear.ratio;
    // Minimum inertia at the output, and at the rotor.
    let (moved, turned_kg_m2) = if flexible.is_some() {
        (load.inertia, *rotor_kg_m2)
    } else {
        let moved = load.inertia + ratio2 * rotor_kg_m2 * gear.efficiency;
        (moved, moved / ratio2)
    };
    let natural = |path, stiffness: f64| Pace::of(path, stiffness, (stiffness.abs() / moved).sqrt());
    let decay = |path, damping: f64| Pace::of(path, damping, damping / moved);
    let mut paces = motor.paces(turned_kg_m2);
    paces.extend([
        decay("load.damping", load.damping),
        natural("load.gravity_torque_nm", load.gravity_torque_nm),
        natural("load.stiffness", load.stiffness),
        Pace::of("friction.stribeck_velocity", friction.stribeck_velocity, friction.steepest() / moved),
        decay("friction.viscous", friction.viscous),
        natural("friction.presliding_stiffness", friction.presliding_stiffness),
        decay("friction.presliding_damping", friction.presliding_damping),
    ]);
    if let Some(stops) = stops {
        paces.extend([natural("stops.stiffness", stops.stiffness), decay("stops.damping", stops.damping)]);
    }
    if let Some(flexible) = flexible {
        let mobility = load.inertia.recip() + (ratio2 * rotor_kg_m2).recip();
        let (stiffness, damping) = (flexible.stiffness, flexible.damping);
        paces.extend([
            Pace::of("flexible.stiffness", stiffness, (stiffness * mobility).sqrt()),
            Pace::of("flexible.damping", damping, damping * mobility),
        ]);
    }
    paces
}
