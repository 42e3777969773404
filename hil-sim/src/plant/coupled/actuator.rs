//! What drives one axis, and what holds it back.

/// A source of torque with a limit, the inertia of its motor, and the friction of the joint.
#[derive(Debug, Clone)]
pub(in crate::plant) struct Actuator {
    /// Where `viscous` stands, for errors.
    pub(in crate::plant) viscous_path: String,
    /// Of the motor, seen from the joint, `kg m²` or `kg`.
    pub(in crate::plant) inertia: f64,
    /// `N m s/rad` or `N s/m`.
    pub(in crate::plant) viscous: f64,
    /// Dry friction, `N m` or `N`.
    pub(in crate::plant) coulomb: f64,
    /// Most that it can apply, `N m` or `N`.
    pub(in crate::plant) effort_limit: f64,
    /// `rad` or `m`.
    pub(in crate::plant) start_position: f64,
}
