//! What a rig's joint has, to hold estimates against.

use super::Quantity;
use crate::plant::{GearParameters, JointMotorParameters, JointParameters};

/// The truth about a joint, where the force is what drives its load: measured behind the gear, or commanded to an ideal motor
/// without a gear. None where something is between, or where a spring or the friction of presliding is at work.
#[must_use]
pub fn truth(joint: &JointParameters, is_measured: bool) -> Option<[(Quantity, f64); 6]> {
    let is_direct = matches!(joint.motor, JointMotorParameters::Ideal {})
        && joint.gear == GearParameters::default()
        && joint.flexible.is_none();
    let friction = &joint.friction;
    let load = &joint.load;
    if !(is_measured || is_direct) || load.stiffness > 0.0 || friction.presliding_stiffness > 0.0 {
        return None;
    }
    let (sine, cosine) = libm::sincos(load.gravity_angle_rad);
    Some([
        (Quantity::Inertia, load.inertia),
        (Quantity::Viscous, load.damping + friction.viscous),
        (Quantity::Coulomb, friction.coulomb),
        (Quantity::WeightSine, load.gravity_torque_nm * cosine),
        (Quantity::WeightCosine, -load.gravity_torque_nm * sine),
        (Quantity::Constant, load.gravity_force_n),
    ])
}
