//! One sub-step: Runge-Kutta within a mode, halved where the mode changes.

use super::matrix::Factors;
use super::mode::{self, MAX_STOPS, Mode};
use super::state::State;
use super::{Axes, Coupled, Dynamics, Mechanism, dot};
use crate::plant::joint::Contact;
use crate::plant::joint::Slide;

/// Torques from outside at a time, in a position, at a velocity, `N m` or `N`.
pub(super) type Outside<'a> = &'a dyn Fn(f64, &Axes, &Axes) -> Axes;

/// One period of held command.
pub(super) struct Period<'a, M> {
    pub(super) coupled: &'a Coupled<M>,
    /// What the actuators apply.
    pub(super) actuator_forces: Axes,
    pub(super) outside: Outside<'a>,
}

impl<M: Mechanism> Period<'_, M> {
    /// Takes `state`, in `mode` at `from_s`, on by `step_s`; may halve that as often as `halvings_left` says.
    pub(super) fn pass(
        &self,
        state: &mut State,
        mode: &mut Mode,
        from_s: f64,
        step_s: f64,
        halvings_left: u8,
    ) {
        let end_s = from_s + step_s;
        let mut next = self.step(state, mode, from_s, step_s);
        let mut next_mode = self.mode(end_s, &next);
        if next_mode != *mode && halvings_left > 0 {
            let half_s = 0.5 * step_s;
            self.pass(state, mode, from_s, half_s, halvings_left - 1);
            self.pass(state, mode, from_s + half_s, half_s, halvings_left - 1);
            return;
        }
        let mut held = *mode;
        let mut is_any_reversed = false;
        for (was, is) in held.slides.iter_mut().zip(&next_mode.slides) {
            if was.is_reversed_by(*is) {
                *was = Slide::Stuck;
                is_any_reversed = true;
            }
        }
        if is_any_reversed {
            self.bring_to_rest(&mut next, &held);
            next_mode = self.mode(end_s, &next);
        }
        (*state, *mode) = (next, next_mode);
    }

    /// Whatever turns around is at rest for an instant, and dry friction may keep it there. Only an impulse on the axis
    /// itself takes what little is left of its velocity, so that the others keep their momentum.
    fn bring_to_rest(&self, state: &mut State, held: &Mode) {
        let mass = self.coupled.dynamics(&state.position, &state.velocity).mass;
        let momentum = mass.times(&state.velocity);
        state.velocity = Factors::of(&mass, held.is_held(self.coupled.axes())).solve(&momentum);
    }

    /// The mode that `state` is in.
    pub(super) fn mode(&self, time_s: f64, state: &State) -> Mode {
        let mut contacts = [Contact::Free; MAX_STOPS];
        for (contact, stop) in contacts.iter_mut().zip(&self.coupled.stops) {
            *contact = stop.contact(&state.position, &state.velocity);
        }
        let actuators = &self.coupled.actuators;
        let mut mode = Mode { slides: mode::slides(actuators, &state.velocity), contacts };
        if mode.slides.contains(&Slide::Stuck) {
            let (dynamics, net, _) = self.frictionless(time_s, state, &mode);
            mode::settle(&mut mode, actuators, &state.velocity, &dynamics.mass, &net);
        }
        mode
    }

    fn step(&self, state: &State, mode: &Mode, from_s: f64, step_s: f64) -> State {
        let half_s = 0.5 * step_s;
        let (middle_s, end_s) = (from_s + half_s, from_s + step_s);
        let first = self.rates(from_s, state, mode);
        let second = self.rates(middle_s, &state.after(half_s, &first), mode);
        let third = self.rates(middle_s, &state.after(half_s, &second), mode);
        let fourth = self.rates(end_s, &state.after(step_s, &third), mode);
        state
            .after(step_s / 6.0, &first)
            .after(step_s / 3.0, &second)
            .after(step_s / 3.0, &third)
            .after(step_s / 6.0, &fourth)
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

    /// All but dry friction: the equations of motion, the net of all forces, and their power.
    fn frictionless(&self, time_s: f64, state: &State, mode: &Mode) -> (Dynamics, Axes, Power) {
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

struct Power {
    supplied_w: f64,
    dissipated_w: f64,
}
