//! Modes of smooth equations: sliding direction of each axis, and stops in contact.

use super::actuator::Actuator;
use super::factors::Factors;
use super::{AxisValues, Matrix, times};
use crate::plant::joint::Contact;
use crate::plant::joint::Slide;
use dimsart_core::limits::MAX_DOF;

/// Maximum stops: one per axis, and one for a difference of axes.
pub(super) const MAX_STOPS: usize = MAX_DOF + 1;

/// Maximum iterations for axes at rest. Each iteration settles one more axis, except in contrived cases.
const ANSWERS_MAX: usize = 8 * MAX_DOF;

/// A mode, in which the equations of motion are smooth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Mode {
    pub(super) slides: [Slide; MAX_DOF],
    pub(super) contacts: [Contact; MAX_STOPS],
}

impl Mode {
    /// Axes without acceleration: sticking and nonexistent axes.
    pub(super) fn is_held(&self, axes: usize) -> [bool; MAX_DOF] {
        let mut is_held = self.slides.map(|slide| slide == Slide::Stuck);
        for held in is_held.iter_mut().skip(axes) {
            *held = true;
        }
        is_held
    }
}

impl Mode {
    /// Whether the mode is permanent: no Coulomb friction and no stops.
    pub(super) fn is_smooth(&self, stops: usize) -> bool {
        stops == 0 && self.slides.iter().all(|slide| *slide == Slide::Frictionless)
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

/// Sliding direction of each moving axis; axes at rest stick until [`settle`] determines otherwise.
pub(super) fn slides(actuators: &[Actuator], velocity: &AxisValues) -> [Slide; MAX_DOF] {
    let mut slides = [Slide::Frictionless; MAX_DOF];
    for ((slide, actuator), &velocity) in slides.iter_mut().zip(actuators).zip(velocity) {
        if actuator.coulomb > 0.0 {
            *slide = if velocity > 0.0 {
                Slide::Forward
            } else if velocity < 0.0 {
                Slide::Backward
            } else {
                Slide::Stuck
            };
        }
    }
    slides
}

/// Determines which sticking axes break away, in `mode`, from the `net` of all forces except Coulomb friction.
///
/// A breaking axis acts on the others through the mass matrix, so that one result can change another. The results
/// solve a linear complementarity problem with a positive definite matrix; changing always the first wrong axis finds
/// the solution (K. G. Murty, "Note on a Bard-type scheme for solving the complementarity problem", Opsearch 11,
/// 1974).
pub(super) fn settle(
    mode: &mut Mode,
    actuators: &[Actuator],
    velocity: &AxisValues,
    mass: &Matrix,
    net: &AxisValues,
) {
    for _ in 0..ANSWERS_MAX {
        let forces = with_friction(net, actuators, &mode.slides);
        let acceleration = Factors::of(mass, mode.is_held(actuators.len())).solve(&forces);
        let inertial = times(mass, &acceleration);
        let turned = (mode.slides.iter_mut().zip(actuators).zip(velocity))
            .zip(acceleration.iter().zip(forces.iter().zip(&inertial)))
            .filter(|((_, velocity), _)| velocity.abs() <= 0.0)
            .find_map(|(((slide, actuator), _), (acceleration, (force, inertial)))| {
                let pull = force - inertial;
                let right = match slide {
                    Slide::Stuck if pull > actuator.coulomb => Slide::Forward,
                    Slide::Stuck if pull < -actuator.coulomb => Slide::Backward,
                    Slide::Forward if *acceleration < 0.0 => Slide::Stuck,
                    Slide::Backward if *acceleration > 0.0 => Slide::Stuck,
                    _ => return None,
                };
                Some((slide, right))
            });
        match turned {
            Some((slide, right)) => *slide = right,
            None => return,
        }
    }
}

/// `net` minus the Coulomb friction of the sliding axes.
pub(super) fn with_friction(
    net: &AxisValues,
    actuators: &[Actuator],
    slides: &[Slide; MAX_DOF],
) -> AxisValues {
    let mut forces = *net;
    for ((force, actuator), slide) in forces.iter_mut().zip(actuators).zip(slides) {
        *force -= direction(*slide) * actuator.coulomb;
    }
    forces
}

#[cfg(test)]
mod tests;
