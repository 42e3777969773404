//! One step: exact or by Runge-Kutta within a mode, halved at mode changes.

use super::exact::ExactSteps;
use super::leg::Leg;
use super::mechanics::{Inputs, Mechanics};
use super::mode::Mode;
use super::push::Push;
use super::state::State;

/// Maximum halvings of a sub-step.
pub(super) const HALVINGS_MAX: u8 = 10;
/// Maximum halvings of a period into exact sub-steps, at least [`SUB_STEPS_MIN`](crate::plant::SUB_STEPS_MIN) if an
/// event is possible.
pub(super) const PERIOD_HALVINGS: u8 = 5;

/// A period of constant command.
pub(super) struct Period<'a> {
    pub(super) mechanics: &'a Mechanics,
    pub(super) load: &'a dyn Fn(f64) -> f64,
    /// Whether the load is constant.
    pub(super) is_held: bool,
    pub(super) sub_steps_per_s: f64,
    /// `None` without exact steps.
    pub(super) exact: Option<&'a mut ExactSteps>,
    /// Time within the period.
    pub(super) inputs: Inputs,
}

impl Period<'_> {
    /// Advances `state`, in `mode` at `from_s`, by `step_s`; halves the step at most `halvings_left` times. A step
    /// longer than a sub-step is taken only if its mode certainly persists.
    pub(super) fn pass(
        &mut self,
        state: &mut State,
        mode: &mut Mode,
        from_s: f64,
        step_s: f64,
        halvings_left: u8,
    ) {
        let end = self.inputs_at(from_s + step_s);
        let next = self.step(state, mode, from_s, step_s, &end, halvings_left);
        let is_sure = halvings_left > HALVINGS_MAX;
        let after = next.map(|next| (next, if is_sure { *mode } else { self.mechanics.mode(&end, &next) }));
        let (mut next, mut next_mode) = match after {
            Some(after) if after.1 == *mode || halvings_left == 0 => after,
            _ => {
                let half_s = 0.5 * step_s;
                self.pass(state, mode, from_s, half_s, halvings_left - 1);
                self.pass(state, mode, from_s + half_s, half_s, halvings_left - 1);
                return;
            }
        };
        // At a reversal the joint is at rest for an instant, and Coulomb friction may hold it.
        let output_reverses = mode.output.is_reversed_by(next_mode.output);
        let rotor_reverses = mode.rotor.is_reversed_by(next_mode.rotor);
        if output_reverses {
            next.velocity = 0.0;
        }
        if rotor_reverses {
            next.rotor_rad_per_s = 0.0;
        }
        if output_reverses || rotor_reverses {
            next_mode = self.mechanics.mode(&end, &next);
        }
        (*state, *mode, self.inputs) = (next, next_mode, end);
    }

    fn inputs_at(&self, time_s: f64) -> Inputs {
        if self.is_held {
            return self.inputs;
        }
        Inputs { load: (self.load)(time_s), ..self.inputs }
    }

    /// Returns the state after a step; `None` if the step is too long.
    fn step(
        &mut self,
        state: &State,
        mode: &Mode,
        from_s: f64,
        step_s: f64,
        end: &Inputs,
        halvings_left: u8,
    ) -> Option<State> {
        let [quarter, middle] = [0.25, 0.5].map(|share| self.inputs_at(from_s + share * step_s));
        match &mut self.exact {
            None => {}
            Some(_) if mode.is_limited => {
                let is_short = halvings_left <= HALVINGS_MAX && self.sub_steps_per_s * step_s <= 1.0;
                if !is_short && halvings_left > 0 {
                    return None;
                }
            }
            Some(steps) => {
                let push = Push {
                    start: self.inputs.load,
                    quarter: quarter.load,
                    middle: middle.load,
                    end: end.load,
                };
                let leg = Leg::new(self.mechanics, steps, mode, state, &self.inputs, (&push, step_s));
                return if halvings_left > HALVINGS_MAX { leg.sure_end() } else { Some(leg.end()) };
            }
        }
        let half_s = 0.5 * step_s;
        let rate = |inputs: &Inputs, state: &State| self.mechanics.rates(inputs, state, mode).state;
        let first = rate(&self.inputs, state);
        let second = rate(&middle, &state.after(half_s, &first));
        let third = rate(&middle, &state.after(half_s, &second));
        let fourth = rate(end, &state.after(step_s, &third));
        let next = state
            .after(step_s / 6.0, &first)
            .after(step_s / 3.0, &second)
            .after(step_s / 3.0, &third)
            .after(step_s / 6.0, &fourth);
        Some(next)
    }
}
