//! A period of constant command: steps with error control, each within one mode.
//!
//! The method is that of Dormand and Prince, of fifth order with an estimate of fourth (J. R. Dormand, P. J. Prince, "A family
//! of embedded Runge-Kutta formulae", J. Computational and Applied Mathematics 6, 1980).

use super::factors::Factors;
use super::mode::{self, MAX_STOPS, Mode};
use super::state::State;
use super::{AxisValues, Coupled, Dynamics, Mechanism, dot, times};
use crate::plant::joint::Contact;
use crate::plant::joint::Slide;

/// Maximum estimated relative error of a step (relative to 1 + value); the actual error is far smaller.
const TOLERANCE: f64 = 1e-11;
/// Minimum step for error control.
const MIN_STEP_S: f64 = 2e-7;
/// Resolution of a mode change.
const LOCATED_S: f64 = 5e-8;
/// Safety factor of the next step, and its limits relative to the last step.
const SAFETY: f64 = 0.9;
const MIN_CHANGE: f64 = 0.1;
const MAX_CHANGE: f64 = 5.0;
/// Shares of a step at which the mode is checked, besides its end.
const BETWEEN: [f64; 3] = [0.25, 0.5, 0.75];

/// External torques by time, position and velocity, `N m` or `N`.
pub(super) type Outside<'a> = &'a dyn Fn(f64, &AxisValues, &AxisValues) -> AxisValues;

/// A period of constant command.
pub(super) struct Period<'a, M> {
    pub(super) coupled: &'a Coupled<M>,
    /// Torques of the actuators.
    pub(super) actuator_forces: AxisValues,
    pub(super) outside: Outside<'a>,
}

/// One step within a mode.
struct Step {
    next: State,
    /// Rates at its end, in the same mode.
    last: State,
    /// Error relative to the limit; NaN if the state is NaN.
    error: f64,
}

impl<M: Mechanism> Period<'_, M> {
    /// Integrates `state` from `start_s` to `end_s`.
    pub(super) fn pass(&self, state: &mut State, start_s: f64, end_s: f64) {
        let mut mode = self.mode(start_s, state);
        let mut rate = self.rates(start_s, state, &mode);
        let (mut time_s, mut allowed_s) = (start_s, end_s - start_s);
        // End of the interval in which the mode changes.
        let mut changed_s = None;
        while time_s < end_s {
            let rest_s = changed_s.unwrap_or(end_s) - time_s;
            let is_located = changed_s.is_none() || rest_s <= LOCATED_S;
            let wanted_s = if is_located { rest_s } else { 0.5 * rest_s };
            let step_s = wanted_s.min(allowed_s);
            // Exactly the end, independent of rounding.
            let to_s = if step_s < rest_s { time_s + step_s } else { changed_s.unwrap_or(end_s) };
            let step = self.step(state, &rate, &mode, time_s, step_s);
            if step.error > 1.0 && step_s > MIN_STEP_S {
                allowed_s = (step_s * change(step.error)).max(MIN_STEP_S);
                continue;
            }
            let next_mode = self.mode(to_s, &step.next);
            let changes = next_mode != mode || self.changes_between(state, &step, &rate, &mode, step_s);
            if changes && step_s > LOCATED_S {
                changed_s = Some(to_s);
                continue;
            }
            allowed_s = step_s.max(allowed_s) * change(step.error).max(1.0);
            (time_s, changed_s) = (to_s, changed_s.filter(|changed_s| to_s < *changed_s));
            (*state, rate) = (step.next, step.last);
            if next_mode != mode {
                mode = self.turn(to_s, state, &mode, next_mode);
                rate = self.rates(to_s, state, &mode);
            }
        }
    }

    /// Returns the mode after a change: a reversing axis is at rest for an instant, and Coulomb friction may hold it.
    fn turn(&self, time_s: f64, state: &mut State, mode: &Mode, next_mode: Mode) -> Mode {
        let mut held = *mode;
        let mut is_any_reversed = false;
        for (was, is) in held.slides.iter_mut().zip(&next_mode.slides) {
            if was.is_reversed_by(*is) {
                *was = Slide::Stuck;
                is_any_reversed = true;
            }
        }
        if !is_any_reversed {
            return next_mode;
        }
        self.bring_to_rest(state, &held);
        self.mode(time_s, state)
    }

    /// The residual velocity is removed by an impulse on this axis only, which preserves the momentum of the others.
    fn bring_to_rest(&self, state: &mut State, held: &Mode) {
        let mass = self.coupled.dynamics(&state.position, &state.velocity).mass;
        let momentum = times(&mass, &state.velocity);
        state.velocity = Factors::of(&mass, held.is_held(self.coupled.axes())).solve(&momentum);
    }

    /// Returns the mode of `state`.
    fn mode(&self, time_s: f64, state: &State) -> Mode {
        let mut mode = self.shape(state);
        if mode.slides.contains(&Slide::Stuck) {
            let (dynamics, net, _) = self.frictionless(time_s, state, &mode);
            let actuators = &self.coupled.actuators;
            mode::settle(&mut mode, actuators, &state.velocity, &dynamics.mass, &net);
        }
        mode
    }

    /// Returns the mode from positions and velocities: axes at rest stick.
    fn shape(&self, state: &State) -> Mode {
        let mut contacts = [Contact::Free; MAX_STOPS];
        for (contact, stop) in contacts.iter_mut().zip(&self.coupled.stops) {
            *contact = stop.contact(&state.position, &state.velocity);
        }
        Mode { slides: mode::slides(&self.coupled.actuators, &state.velocity), contacts }
    }

    /// Whether a contact changes or an axis reverses within a step.
    fn changes_between(&self, state: &State, step: &Step, rate: &State, mode: &Mode, step_s: f64) -> bool {
        let is_other =
            |share: f64| self.shape(&state.between(&step.next, [rate, &step.last], step_s, share)) != *mode;
        !mode.is_smooth(self.coupled.stops.len()) && BETWEEN.into_iter().any(is_other)
    }

    fn step(&self, state: &State, k1: &State, mode: &Mode, from_s: f64, step_s: f64) -> Step {
        let rates = |share: f64, state: &State| self.rates(from_s + share * step_s, state, mode);
        let k2 = rates(0.2, &state.after(step_s, [(0.2, k1)]));
        let k3 = rates(0.3, &state.after(step_s, [(3.0 / 40.0, k1), (9.0 / 40.0, &k2)]));
        let at = [(44.0 / 45.0, k1), (-56.0 / 15.0, &k2), (32.0 / 9.0, &k3)];
        let k4 = rates(0.8, &state.after(step_s, at));
        let at = [
            (19372.0 / 6561.0, k1),
            (-25360.0 / 2187.0, &k2),
            (64448.0 / 6561.0, &k3),
            (-212.0 / 729.0, &k4),
        ];
        let k5 = rates(8.0 / 9.0, &state.after(step_s, at));
        let at = [
            (9017.0 / 3168.0, k1),
            (-355.0 / 33.0, &k2),
            (46732.0 / 5247.0, &k3),
            (49.0 / 176.0, &k4),
            (-5103.0 / 18656.0, &k5),
        ];
        let k6 = rates(1.0, &state.after(step_s, at));
        let at = [
            (35.0 / 384.0, k1),
            (500.0 / 1113.0, &k3),
            (125.0 / 192.0, &k4),
            (-2187.0 / 6784.0, &k5),
            (11.0 / 84.0, &k6),
        ];
        let next = state.after(step_s, at);
        let last = rates(1.0, &next);
        let off = State::default().after(
            step_s,
            [
                (71.0 / 57600.0, k1),
                (-71.0 / 16695.0, &k3),
                (71.0 / 1920.0, &k4),
                (-17253.0 / 339_200.0, &k5),
                (22.0 / 525.0, &k6),
                (-1.0 / 40.0, &last),
            ],
        );
        Step { next, last, error: off.largest(&next) / TOLERANCE }
    }

    fn rates(&self, time_s: f64, state: &State, mode: &Mode) -> State {
        let (dynamics, net, power) = self.frictionless(time_s, state, mode);
        let actuators = &self.coupled.actuators;
        let forces = mode::with_friction(&net, actuators, &mode.slides);
        let factors = Factors::of(&dynamics.mass, mode.is_held(self.coupled.axes()));
        let rubbed_w: f64 = (actuators.iter().zip(&mode.slides).zip(&state.velocity))
            .map(|((actuator, slide), velocity)| mode::direction(*slide) * actuator.coulomb * velocity)
            .sum();
        State {
            position: state.velocity,
            velocity: factors.solve(&forces),
            supplied_j: power.supplied_w,
            dissipated_j: power.dissipated_w + rubbed_w,
        }
    }

    /// Equations of motion, net of all forces except Coulomb friction, and their power.
    fn frictionless(&self, time_s: f64, state: &State, mode: &Mode) -> (Dynamics, AxisValues, Power) {
        let State { position, velocity, .. } = state;
        let dynamics = self.coupled.dynamics(position, velocity);
        let mut net = (self.outside)(time_s, position, velocity);
        for (net, force) in net.iter_mut().zip(&self.actuator_forces) {
            *net += force;
        }
        let supplied_w = dot(&net, velocity);
        let mut dissipated_w = 0.0;
        for (stop, contact) in self.coupled.stops.iter().zip(&mode.contacts) {
            let force = stop.force(*contact, position, velocity);
            dissipated_w += stop.lost_w(force, position, velocity);
            for (net, share) in net.iter_mut().zip(&stop.direction) {
                *net += share * force;
            }
        }
        for ((net, actuator), velocity) in net.iter_mut().zip(&self.coupled.actuators).zip(velocity) {
            let resistance = actuator.viscous * velocity;
            dissipated_w += resistance * velocity;
            *net -= resistance;
        }
        for (net, bias) in net.iter_mut().zip(&dynamics.bias) {
            *net -= bias;
        }
        (dynamics, net, Power { supplied_w, dissipated_w })
    }
}

/// Maximum factor of the step for this error.
fn change(error: f64) -> f64 {
    // The estimate grows with the fifth power. A step with zero error or NaN has no limit.
    if error > 0.0 { (SAFETY * libm::pow(error, -0.2)).clamp(MIN_CHANGE, MAX_CHANGE) } else { MAX_CHANGE }
}

struct Power {
    supplied_w: f64,
    dissipated_w: f64,
}
