//! Which smooth equations hold: the sliding directions, and what touches.

use super::flexible::Mesh;
use super::gear::Flow;
use super::stops::Contact;

/// Which way dry friction acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::plant) enum Slide {
    /// There is none.
    Frictionless,
    /// It slides towards larger positions.
    Forward,
    /// It slides towards smaller positions.
    Backward,
    /// Friction holds it.
    Stuck,
}

impl Slide {
    /// Whether the velocity passed zero on the way to `next`: it was at rest for an instant.
    pub(in crate::plant) fn is_reversed_by(self, next: Self) -> bool {
        matches!((self, next), (Self::Forward, Self::Backward) | (Self::Backward, Self::Forward))
    }
}

/// Within one mode the equations of motion are smooth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Mode {
    /// Of the output, and of a rotor that moves along.
    pub(super) output: Slide,
    /// Of a rotor behind a flexible element.
    pub(super) rotor: Slide,
    pub(super) stop: Contact,
    pub(super) mesh: Mesh,
    /// Of power through a lossy gear of a rigid joint.
    pub(super) flow: Flow,
    /// Whether the voltage does not last for the current that is wanted.
    pub(super) is_limited: bool,
}

impl Mode {
    /// Nothing is dry.
    pub(super) fn free(stop: Contact) -> Self {
        let free = Slide::Frictionless;
        Self { output: free, rotor: free, stop, mesh: Mesh::Tight, flow: Flow::None, is_limited: false }
    }
}

/// Which way dry friction lets something slide that moves at `velocity`, or would accelerate from rest in either
/// direction as `acceleration` says.
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
