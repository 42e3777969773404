//! Actuator and friction of one axis.

/// A torque source with a limit, motor inertia, and joint friction.
#[derive(Debug, Clone)]
pub(in crate::plant) struct Actuator {
    /// Path of `viscous`, for errors.
    pub(in crate::plant) viscous_path: String,
    /// Motor inertia at the joint, `kg m²` or `kg`.
    pub(in crate::plant) inertia: f64,
    /// `N m s/rad` or `N s/m`.
    pub(in crate::plant) viscous: f64,
    /// Coulomb friction, `N m` or `N`.
    pub(in crate::plant) coulomb: f64,
    /// Maximum torque or force, `N m` or `N`.
    pub(in crate::plant) effort_limit: f64,
    /// `rad` or `m`.
    pub(in crate::plant) start_position: f64,
}
