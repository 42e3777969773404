//! Rigid-body dynamics shared by the arm modules: equations of motion, and conversion of signals to joint vectors.

use core::fmt::Debug;

use dimsart_core::limits::MAX_DOF;
use dimsart_core::{Context, Input, Module, Output, ParameterSet};

/// One value per axis; 0 beyond the last axis.
pub(super) type Axes = [f32; MAX_DOF];

/// Dynamics of an arm in one pose: `M(q) q'' + C(q, q') q' + g(q) = tau`.
pub trait ArmDynamics: Debug + Copy + 'static {
    /// Name of its gravity compensation module.
    const GRAVITY: &'static str;
    /// Name of its computed-torque module.
    const COMPUTED_TORQUE: &'static str;
    /// Name of its collision detection module.
    const COLLISION: &'static str;
    /// Parameters common to all axes.
    type Settings: ParameterSet;
    /// Parameters of one link.
    type Link: ParameterSet;

    /// Computes the arm's pose-dependent terms at this position.
    fn at(settings: Self::Settings, links: &[Self::Link; MAX_DOF], position: &Axes) -> Self;

    /// Returns `M a + C v + g`, `N m`.
    fn torques(&self, velocity: &Axes, acceleration: &Axes) -> Axes;

    /// Returns `M v` and `Cᵀ v`, the gradient of the kinetic energy `½ d(vᵀ M v)/dq`.
    fn momentum(&self, velocity: &Axes) -> (Axes, Axes);

    /// Returns `g`, `N m`.
    fn gravity(&self) -> Axes {
        self.torques(&[0.0; MAX_DOF], &[0.0; MAX_DOF])
    }
}

/// Reads a signal of all axes.
pub(super) fn axes<M: Module>(context: &Context<'_, M>, signal: Input) -> Axes {
    core::array::from_fn(|axis| context.axis(signal, axis))
}

/// Writes a signal of all axes.
pub(super) fn write<M: Module>(context: &Context<'_, M>, signal: Output, values: &Axes) {
    for (axis, value) in values.iter().enumerate() {
        context.set_axis(signal, axis, *value);
    }
}

/// Returns the parameters of each link, which `of_link` extracts from those of its axis.
pub(super) fn links<M: Module, L: ParameterSet>(
    context: &Context<'_, M>,
    any: Input,
    of_link: impl Fn(M::Gains) -> L,
) -> [L; MAX_DOF] {
    let mut links = [L::default(); MAX_DOF];
    let mut places = links.iter_mut();
    context.map_axis_contexts([any], [], |_, lane, _| {
        if let Some(link) = places.next() {
            *link = of_link(lane.gains());
        }
        []
    });
    links
}
