//! Exact steps of a joint that is linear within a mode: an ideal source on a rigid load with springs, dampers, stops and
//! Coulomb friction.
//!
//! A step has the matrix exponential of its mode ([`Transition`]). The outside force goes along a line through a step, with
//! the impulse of the parabola through its start, middle and end.

use super::flexible::Mesh;
use super::gear::GearParameters;
use super::mechanics::{Inputs, Mechanics};
use super::mode::Slide;
use super::mode::{Mode, direction};
use super::motor::JointMotorParameters;
use super::state::State;
use super::stops::{Contact, StopsParameters};
use crate::plant::transition::{Dynamics, Motion, Transition};

/// Share of all forces that a parabola may miss the outside force by in a step of a whole period.
const SMOOTH: f64 = 1e-8;
/// Steps in use are fewer in any usual joint.
const MAX_KNOWN: usize = 64;

/// The steps met so far, so that each is computed once.
#[derive(Debug)]
pub(super) struct ExactSteps {
    /// Whether nothing is dry: then a whole period can be one step.
    pub(super) slides_freely: bool,
    known: Vec<Known>,
    /// The step that was used last.
    last: usize,
}

#[derive(Debug)]
struct Known {
    stop: Contact,
    /// Of the load's spring, and of the length of the step, `s`.
    bits: [u64; 2],
    dynamics: Dynamics,
    transition: Transition,
}

impl ExactSteps {
    pub(super) fn new(mechanics: &Mechanics) -> Self {
        Self { slides_freely: !mechanics.friction.is_dry(), known: Vec::new(), last: 0 }
    }

    /// The step in `stop`, and its dynamics.
    fn get(&mut self, mechanics: &Mechanics, stop: Contact, step_s: f64) -> &Known {
        let bits = [mechanics.load.stiffness.to_bits(), step_s.to_bits()];
        let is_it = |known: &Known| known.stop == stop && known.bits == bits;
        if !self.known.get(self.last).is_some_and(is_it) {
            self.last = self.known.iter().position(is_it).unwrap_or_else(|| {
                if self.known.len() >= MAX_KNOWN {
                    self.known.clear();
                }
                let dynamics = mechanics.dynamics(stop);
                let transition = Transition::over(&dynamics, step_s);
                self.known.push(Known { stop, bits, dynamics, transition });
                self.known.len() - 1
            });
        }
        #[expect(clippy::indexing_slicing, reason = "the place was just found")]
        &self.known[self.last]
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
        }
    }

    /// What accelerates the joint in `mode`, `N m` or `N`.
    fn net_force(&self, state: &State, mode: &Mode, inputs: &Inputs) -> f64 {
        let resistance = self.load.damping + self.friction.viscous;
        let stop = |stops: &StopsParameters| stops.force(mode.stop, state.position, state.velocity);
        self.gear.ratio * inputs.wanted_nm + inputs.load + self.load.linear_force(state.position)
            - resistance * state.velocity
            - direction(mode.output) * self.friction.coulomb
            + self.stops.as_ref().map_or(0.0, stop)
    }

    /// Takes `state`, in `mode`, on by a step.
    pub(super) fn exact_step(
        &self,
        steps: &mut ExactSteps,
        state: &mut State,
        mode: &Mode,
        inputs: &Inputs,
        push: Push,
        step_s: f64,
    ) {
        if mode.output != Slide::Stuck {
            self.step_by(&steps.get(self, mode.stop, step_s).transition, state, mode, inputs, push, step_s);
        }
    }

    #[inline]
    fn step_by(
        &self,
        transition: &Transition,
        state: &mut State,
        mode: &Mode,
        inputs: &Inputs,
        push: Push,
        step_s: f64,
    ) {
        let Push { start, middle, end } = push;
        let beyond = 2.0 / 3.0 * (middle - 0.5 * (start + end));
        let inputs = Inputs { load: start + beyond, ..*inputs };
        let motion = Motion {
            position_m: state.position,
            velocity_m_per_s: state.velocity,
            acceleration_m_per_s2: self.net_force(state, mode, &inputs) * transition.inverse_mass_per_kg,
        };
        let slope = (end - start) / step_s;
        let next = transition.step(&motion, slope * transition.inverse_mass_per_kg);
        let (moved, slowed) = (next.position_m - state.position, state.velocity - next.velocity_m_per_s);
        // ∫ t v dt, by a cubic between the ends.
        let late = step_s * (0.5 * moved - step_s / 12.0 * slowed);
        let supplied_j = (self.gear.ratio * inputs.wanted_nm + inputs.load) * moved + slope * late;
        let before_j = self.linear_stored_j(state);
        (state.position, state.velocity) = (next.position_m, next.velocity_m_per_s);
        state.supplied_j += supplied_j;
        state.dissipated_j += supplied_j - (self.linear_stored_j(state) - before_j);
    }

    /// [`stored_j`](Self::stored_j) of a joint that takes exact steps.
    fn linear_stored_j(&self, state: &State) -> f64 {
        let inertia = self.load.inertia + self.gear.ratio * self.gear.ratio * self.rotor_kg_m2;
        let stop = |stops: &StopsParameters| {
            let depth = stops.beyond(state.position);
            0.5 * stops.stiffness * depth * depth
        };
        0.5 * inertia * state.velocity * state.velocity
            + self.load.potential_j(state.position)
            + self.stops.as_ref().map_or(0.0, stop)
    }

    /// Takes `state` on by a whole period, in one step; not where something can touch, let go or slide on the way, or where
    /// the outside force is not smooth. Says whether it did.
    ///
    /// From `a' = -w² v - d/m a + j`: `sqrt(a² + w² v²)` grows by at most `|j| t`, so `A`, its value at the start plus
    /// `|j| t`, bounds `|a|`; the velocity changes by at most `A t`, the position by `(|v| + A t) t`. Around its equilibrium
    /// the joint oscillates by at most `A/w²`, which bounds both however long the period is.
    pub(super) fn exact_stride(
        &self,
        steps: &mut ExactSteps,
        state: &mut State,
        inputs: &Inputs,
        (push, quarter): (Push, f64),
        period_s: f64,
    ) -> bool {
        let contact = |stops: &StopsParameters| stops.contact(state.position, state.velocity);
        let stop = self.stops.as_ref().map_or(Contact::Free, contact);
        let mode = Mode { output: Slide::Frictionless, rotor: Slide::Frictionless, stop, mesh: Mesh::Tight };
        let Push { start, middle, end } = push;
        let forces = start.abs() + middle.abs() + end.abs() + (self.gear.ratio * inputs.wanted_nm).abs();
        let parabola = 0.375 * start + 0.75 * middle - 0.125 * end;
        let is_smooth = (quarter - parabola).abs() <= SMOOTH * forces;
        let rooms = self.stops.as_ref().map_or(Some([f64::INFINITY; 2]), |stops| stops.reach(stop, state));
        let Some([room, room_per_s]) = rooms.filter(|_| is_smooth) else { return false };
        let Known { dynamics, transition, .. } = steps.get(self, stop, period_s);
        if room < f64::INFINITY {
            let Dynamics { stiffness_n_per_m, inverse_mass_per_kg, .. } = *dynamics;
            let acceleration = self.net_force(state, &mode, inputs) * inverse_mass_per_kg;
            let rad2_per_s2 = stiffness_n_per_m * inverse_mass_per_kg;
            let pushed = (end - start).abs() + 2.0 * (middle - 0.5 * (start + end)).abs();
            let fastest = (acceleration * acceleration + rad2_per_s2 * state.velocity * state.velocity)
                .sqrt()
                + pushed * inverse_mass_per_kg;
            let swing = 2.0 * fastest / rad2_per_s2;
            let slowed = (fastest * period_s).min(swing * rad2_per_s2.sqrt());
            let moved = ((state.velocity.abs() + slowed) * period_s).min(swing);
            if !(moved < room && slowed < room_per_s) {
                return false;
            }
        }
        self.step_by(transition, state, &mode, inputs, push, period_s);
        true
    }
}
