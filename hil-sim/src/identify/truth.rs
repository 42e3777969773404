//! True parameters of a rig's joint, for comparison with estimates.
#![expect(clippy::indexing_slicing, reason = "matrices of a fixed size")]

use super::Quantity;
use crate::plant::{
    ArmParameters, GearParameters, JointMotorParameters, JointParameters, LinkKind, ParameterError,
};

/// True parameters of a joint, if the recorded force drives its load: measured at the gear output, or commanded to an
/// ideal motor without a gear. `None` otherwise, or with a spring or presliding friction.
#[must_use]
pub fn true_parameters(joint: &JointParameters, is_measured: bool) -> Option<[(Quantity, f64); 6]> {
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

/// True parameters of a joint of an arm whose other joints are held at `held_at`, which contains an entry for it as
/// well. Its inertia includes all bodies beyond it and its motor; it depends on the other joints only.
///
/// # Errors
/// As [`ArmParameters::build`].
pub fn true_arm_joint_parameters(
    arm: &ArmParameters,
    axis: usize,
    held_at: &[f64],
) -> Result<Option<[(Quantity, f64); 6]>, ParameterError> {
    let built = arm.build()?;
    let Some(link) = arm.link.get(axis) else { return Ok(None) };
    let weight = |position: f64| {
        let mut positions = held_at.to_vec();
        if let Some(own) = positions.get_mut(axis) {
            *own = position;
        }
        built.gravity_torques(&positions).get(axis).copied().unwrap_or_default()
    };
    let (sine, cosine, constant) = match link.kind {
        LinkKind::Revolute => (weight(core::f64::consts::FRAC_PI_2), weight(0.0), 0.0),
        LinkKind::Prismatic => (0.0, 0.0, weight(0.0)),
    };
    Ok(Some([
        (Quantity::Inertia, built.mass_matrix(held_at)[(axis, axis)]),
        (Quantity::Viscous, link.viscous),
        (Quantity::Coulomb, link.coulomb),
        (Quantity::WeightSine, sine),
        (Quantity::WeightCosine, cosine),
        (Quantity::Constant, constant),
    ]))
}
