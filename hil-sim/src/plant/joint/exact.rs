//! Exact steps of a joint that is linear within a mode: an ideal source on a rigid load with springs, dampers, stops and
//! Coulomb friction.
//!
//! A step has the matrix exponential of its mode ([`Transition`]). The outside force goes along a line through a step, with
//! the impulse of the parabola through its start, middle and end.

use super::gear::GearParameters;
use super::mechanics::{Inputs, Mechanics};
use super::mode::Mode;
use super::motor::JointMotorParameters;
use super::state::State;
use super::stops::{Contact, StopsParameters};
use crate::plant::scene::Slide;
use crate::plant::transition::{Dynamics, Motion, Transition};

/// Share of all forces that a parabola may miss the outside force by in a step of a whole period.
const SMOOTH: f64 = 1e-8;
/// Steps in use are fewer in any usual joint.
const MAX_KNOWN: usize = 64;

/// The steps met so far, so that each is computed once.
#[derive(Debug, Default)]
pub(super) struct ExactSteps {
    known: Vec<(Contact, u64, Transition)>,
}

impl ExactSteps {
    fn get(&mut self, mechanics: &Mechanics, stop: Contact, step_s: f64) -> &Transition {
        let is_it =
            |(known, bits, _): &(Contact, u64, Transition)| (*known, *bits) == (stop, step_s.to_bits());
        let place = self.known.iter().position(is_it).unwrap_or_else(|| {
            if self.known.len() >= MAX_KNOWN {
                self.known.clear();
            }
            let transition = Transition::over(&mechanics.dynamics(stop), step_s);
            self.known.push((stop, step_s.to_bits(), transition));
            self.known.len() - 1
        });
        #[expect(clippy::indexing_slicing, reason = "the place was just found")]
        &self.known[place].2
    }
}

/// The outside force over a step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Push {
    pub(super) start: f64,
    pub(super) middle: f64,
    pub(super) end: f64,
}

impl Mechanics {
    /// Whether its equations are linear within a mode, and have no motor.
    pub(super) fn is_linear(&self) -> bool {
        let GearParameters { efficiency, backdrive_efficiency, .. } = self.gear;
        let has_losses = efficiency < 1.0 || backdrive_efficiency < 1.0;
        self.flexible.is_none()
            && self.motor == JointMotorParameters::default()
            && !has_losses
            && self.load.gravity_torque_nm.abs() <= 0.0
            && !self.friction.has_presliding()
            && self.friction.breakaway <= self.friction.coulomb
    }

    fn dynamics(&self, stop: Contact) -> Dynamics {
        let touched = match stop {
            Contact::Free | Contact::Released => None,
            Contact::Lower | Contact::Upper => self.stops.as_ref(),
        };
        let (stiffness, damping) =
            touched.map_or((0.0, 0.0), |StopsParameters { stiffness, damping, .. }| (*stiffness, *damping));
        let inertia = self.load.inertia + self.gear.ratio * self.gear.ratio * self.rotor_kg_m2;
        Dynamics {
            stiffness_n_per_m: self.load.stiffness + stiffness,
            damping_ns_per_m: self.load.damping + self.friction.viscous + damping,
            inverse_mass_per_kg: inertia.recip(),
            decay_per_s: 0.0,
            counter_n_per_m: 0.0,
        }
    }

    /// `state`, in `mode`, a step later.
    pub(super) fn exact_step(
        &self,
        steps: &mut ExactSteps,
        state: &State,
        mode: &Mode,
        inputs: &Inputs,
        push: Push,
        step_s: f64,
    ) -> State {
        if mode.output == Slide::Stuck {
            return *state;
        }
        let transition = steps.get(self, mode.stop, step_s);
        let Push { start, middle, end } = push;
        let beyond = 2.0 / 3.0 * (middle - 0.5 * (start + end));
        let inputs = Inputs { load: start + beyond, ..*inputs };
        let motion = Motion {
            position_m: state.position,
            velocity_m_per_s: state.velocity,
            acceleration_m_per_s2: self.rates(&inputs, state, mode).state.velocity,
            ..Motion::default()
        };
        let slope = (end - start) / step_s;
        let next = transition.step(&motion, slope * transition.inverse_mass_per_kg);
        let (moved, slowed) = (next.position_m - state.position, state.velocity - next.velocity_m_per_s);
        // ∫ t v dt, by a cubic between the ends.
        let late = step_s * (0.5 * moved - step_s / 12.0 * slowed);
        let supplied_j = (self.gear.ratio * inputs.wanted_nm + inputs.load) * moved + slope * late;
        let mut after = State { position: next.position_m, velocity: next.velocity_m_per_s, ..*state };
        after.supplied_j += supplied_j;
        after.dissipated_j += supplied_j - (self.stored_j(&after) - self.stored_j(state));
        after
    }

    /// Whether nothing can touch or slide within a period that begins like this, and the outside force is smooth: then the
    /// period is one step.
    ///
    /// From `a' = -w² v - d/m a + j`: `sqrt(a² + w² v²)` grows by at most `|j| t`, so `A`, its value at the start plus
    /// `|j| t`, bounds `|a|`; the velocity changes by at most `A t`, the position by `(|v| + A t) t`.
    pub(super) fn is_undisturbed(
        &self,
        state: &State,
        mode: &Mode,
        inputs: &Inputs,
        push: Push,
        quarter: f64,
        period_s: f64,
    ) -> bool {
        if mode.output != Slide::Frictionless || mode.stop != Contact::Free {
            return false;
        }
        let Push { start, middle, end } = push;
        let parabola = 0.375 * start + 0.75 * middle - 0.125 * end;
        let forces = start.abs() + middle.abs() + end.abs() + (self.gear.ratio * inputs.wanted_nm).abs();
        let Dynamics { stiffness_n_per_m, inverse_mass_per_kg, .. } = self.dynamics(mode.stop);
        let (velocity, acceleration) = (state.velocity, self.rates(inputs, state, mode).state.velocity);
        let rad2_per_s2 = stiffness_n_per_m * inverse_mass_per_kg;
        let pushed = (end - start).abs() + 2.0 * (middle - 0.5 * (start + end)).abs();
        let fastest = (acceleration * acceleration + rad2_per_s2 * velocity * velocity).sqrt()
            + pushed * inverse_mass_per_kg;
        let reached = (velocity.abs() + fastest * period_s) * period_s;
        let room = self
            .stops
            .as_ref()
            .map_or(f64::INFINITY, |stops| (stops.max - state.position).min(state.position - stops.min));
        (quarter - parabola).abs() <= SMOOTH * forces && reached < room
    }
}
