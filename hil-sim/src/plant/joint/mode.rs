//! Modes of smooth equations: sliding directions and contacts.

use super::flexible::Mesh;
use super::gear::Flow;
use super::stops::Contact;

/// Direction of Coulomb friction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::plant) enum Slide {
    /// No friction.
    Frictionless,
    /// Sliding towards larger positions.
    Forward,
    /// Sliding towards smaller positions.
    Backward,
    /// Sticking.
    Stuck,
}

impl Slide {
    /// Whether the velocity passed zero on the way to `next`.
    pub(in crate::plant) fn is_reversed_by(self, next: Self) -> bool {
        matches!((self, next), (Self::Forward, Self::Backward) | (Self::Backward, Self::Forward))
    }
}

/// A mode, in which the equations of motion are smooth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Mode {
    /// Output, and rotor of a rigid joint.
    pub(super) output: Slide,
    /// Rotor with a flexible element.
    pub(super) rotor: Slide,
    pub(super) stop: Contact,
    pub(super) mesh: Mesh,
    /// Power through the lossy gear of a rigid joint.
    pub(super) flow: Flow,
    /// Whether the voltage is saturated.
    pub(super) is_limited: bool,
}

impl Mode {
    /// Without Coulomb friction.
    pub(super) fn free(stop: Contact) -> Self {
        let free = Slide::Frictionless;
        Self { output: free, rotor: free, stop, mesh: Mesh::Tight, flow: Flow::None, is_limited: false }
    }
}

/// Returns the sliding direction at `velocity`, or from rest with `acceleration` by direction.
pub(super) fn slide(velocity: f64, acceleration: impl Fn(Slide) -> f64) -> Slide {
    let is_at_rest = velocity.abs() <= 0.0;
    if velocity > 0.0 || (is_at_rest && acceleration(Slide::Forward) > 0.0) {
        Slide::Forward
    } else if velocity < 0.0 || (is_at_rest && acceleration(Slide::Backward) < 0.0) {
        Slide::Backward
    } else {
        Slide::Stuck
    }
}

/// -1, 0 or 1.
pub(super) fn direction(slide: Slide) -> f64 {
    match slide {
        Slide::Frictionless | Slide::Stuck => 0.0,
        Slide::Forward => 1.0,
        Slide::Backward => -1.0,
    }
}
