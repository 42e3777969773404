//! Which smooth equations hold: the sliding direction of each axis, and which stops touch.

use super::actuator::Actuator;
use super::factors::Factors;
use super::{Axes, Matrix, times};
use crate::plant::joint::Contact;
use crate::plant::scene::Slide;
use dimsart_core::limits::MAX_DOF;

/// As many stops as axes, and one more for a difference of axes.
pub(super) const MAX_STOPS: usize = MAX_DOF + 1;

/// How often an axis at rest is asked anew, at most. Each answer settles one axis more, in all but contrived cases.
const ANSWERS_MAX: usize = 8 * MAX_DOF;

/// Within one mode the equations of motion are smooth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Mode {
    pub(super) slides: [Slide; MAX_DOF],
    pub(super) contacts: [Contact; MAX_STOPS],
}

impl Mode {
    /// Which axes do not accelerate: those that stick, and those past the last.
    pub(super) fn is_held(&self, axes: usize) -> [bool; MAX_DOF] {
        let mut is_held = self.slides.map(|slide| slide == Slide::Stuck);
        for held in is_held.iter_mut().skip(axes) {
            *held = true;
        }
        is_held
    }
}

impl Mode {
    /// Whether nothing can change it: no dry friction, and no stops.
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

/// The sliding direction of each axis that moves; those at rest are said to stick until [`settle`] knows better.
pub(super) fn slides(actuators: &[Actuator], velocity: &Axes) -> [Slide; MAX_DOF] {
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

/// Which of the axes that stick are torn off, in `mode`, by the `net` of all forces but dry friction.
///
/// An axis that starts to slide pulls at the others through the mass matrix, so that one answer may change another.
/// The answers are the solution of a linear complementarity problem with a positive definite matrix; taking always
/// the first axis that is wrong and turning it finds it (K. G. Murty, "Note on a Bard-type scheme for solving the
/// complementarity problem", Opsearch 11, 1974).
pub(super) fn settle(mode: &mut Mode, actuators: &[Actuator], velocity: &Axes, mass: &Matrix, net: &Axes) {
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

/// `net` less the dry friction of the axes that slide.
pub(super) fn with_friction(net: &Axes, actuators: &[Actuator], slides: &[Slide; MAX_DOF]) -> Axes {
    let mut forces = *net;
    for ((force, actuator), slide) in forces.iter_mut().zip(actuators).zip(slides) {
        *force -= direction(*slide) * actuator.coulomb;
    }
    forces
}

#[cfg(test)]
mod tests;
