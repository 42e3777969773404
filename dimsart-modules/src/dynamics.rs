//! What the laws that know the masses of an arm share: its equations of motion, and the joints as they are measured.

use core::fmt::Debug;

use dimsart_core::limits::MAX_DOF;
use dimsart_core::{Context, Input, Module, Output, ParameterSet};

/// A value of each axis, 0 beyond the last one.
pub(super) type Axes = [f32; MAX_DOF];

/// An arm with its masses, at a position of its joints: `M(q) q'' + C(q, q') q' + g(q) = tau`.
pub trait Body: Debug + Copy + 'static {
    /// Name of the module that carries its weight.
    const GRAVITY: &'static str;
    /// Name of the module that makes it follow.
    const COMPUTED_TORQUE: &'static str;
    /// Name of the module that finds collisions.
    const COLLISION: &'static str;
    /// Of all axes.
    type Settings: ParameterSet;
    /// Of a link.
    type Link: ParameterSet;

    /// The arm at this position.
    fn at(settings: Self::Settings, links: &[Self::Link; MAX_DOF], position: &Axes) -> Self;

    /// `M a + C v + g`, `N m`.
    fn torques(&self, velocity: &Axes, acceleration: &Axes) -> Axes;

    /// `M v`, and how the kinetic energy changes with each position, `½ d(vᵀ M v)/dq`, which is `Cᵀ v`.
    fn momentum(&self, velocity: &Axes) -> (Axes, Axes);

    /// `g`, `N m`.
    fn gravity(&self) -> Axes {
        self.torques(&[0.0; MAX_DOF], &[0.0; MAX_DOF])
    }
}

/// A signal of every axis.
pub(super) fn axes<M: Module>(context: &Context<'_, M>, signal: Input) -> Axes {
    core::array::from_fn(|axis| context.axis(signal, axis))
}

/// Writes a value of every axis.
pub(super) fn write<M: Module>(context: &Context<'_, M>, signal: Output, values: &Axes) {
    for (axis, value) in values.iter().enumerate() {
        context.set_axis(signal, axis, *value);
    }
}

/// What `of_link` finds of each link among the parameters of its axis.
pub(super) fn links<M: Module, L: ParameterSet>(
    context: &Context<'_, M>,
    any: Input,
    of_link: impl Fn(M::Gains) -> L,
) -> [L; MAX_DOF] {
    let mut links = [L::default(); MAX_DOF];
    let mut places = links.iter_mut();
    context.map_lanes([any], [], |_, lane, _| {
        if let Some(link) = places.next() {
            *link = of_link(lane.gains());
        }
        []
    });
    links
}
