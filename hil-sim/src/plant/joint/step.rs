//! One sub-step: exact or by Runge-Kutta within a mode, halved where the mode changes.

use super::exact::{ExactSteps, Push};
use super::mechanics::{Inputs, Mechanics};
use super::mode::Mode;
use super::state::State;

/// One period of held command.
pub(super) struct Period<'a> {
    pub(super) mechanics: &'a Mechanics,
    pub(super) load: &'a dyn Fn(f64) -> f64,
    /// None of a joint that is not linear.
    pub(super) exact: Option<&'a mut ExactSteps>,
    /// Where the period has come to.
    pub(super) inputs: Inputs,
}

impl Period<'_> {
    /// Takes `state`, in `mode` at `from_s`, on by `step_s`; may halve that as often as `halvings_left` says.
    pub(super) fn pass(
        &mut self,
        state: &mut State,
        mode: &mut Mode,
        from_s: f64,
        step_s: f64,
        halvings_left: u8,
    ) {
        let end = self.inputs_at(from_s + step_s);
        let mut next = self.step(state, mode, from_s, step_s, &end);
        let mut next_mode = self.mechanics.mode(&end, &next);
        if next_mode != *mode && halvings_left > 0 {
            let half_s = 0.5 * step_s;
            self.pass(state, mode, from_s, half_s, halvings_left - 1);
            self.pass(state, mode, from_s + half_s, half_s, halvings_left - 1);
            return;
        }
        // Whoever turns around is at rest for an instant, and dry friction may keep it there.
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
        Inputs { load: (self.load)(time_s), ..self.inputs }
    }

    /// Takes `state` on by the whole period, if that is linear and nothing can happen in it; says whether it did. The outside
    /// force may be held for it.
    pub(super) fn stride(&mut self, state: &mut State, start_s: f64, period_s: f64, is_held: bool) -> bool {
        let Some(steps) = self.exact.as_deref_mut().filter(|steps| steps.slides_freely) else { return false };
        let load =
            |share: f64| if is_held { self.inputs.load } else { (self.load)(start_s + share * period_s) };
        let end = Inputs { load: load(1.0), ..self.inputs };
        let push = Push { start: self.inputs.load, middle: load(0.5), end: end.load };
        let quarter = load(0.25);
        let is_one = self.mechanics.exact_stride(steps, state, &self.inputs, (push, quarter), period_s);
        if is_one {
            self.inputs = end;
        }
        is_one
    }

    fn step(&mut self, state: &State, mode: &Mode, from_s: f64, step_s: f64, end: &Inputs) -> State {
        let half_s = 0.5 * step_s;
        let middle = self.inputs_at(from_s + half_s);
        if let Some(steps) = &mut self.exact {
            let push = Push { start: self.inputs.load, middle: middle.load, end: end.load };
            let mut next = *state;
            self.mechanics.exact_step(steps, &mut next, mode, &self.inputs, push, step_s);
            return next;
        }
        let rate = |inputs: &Inputs, state: &State| self.mechanics.rates(inputs, state, mode).state;
        let first = rate(&self.inputs, state);
        let second = rate(&middle, &state.after(half_s, &first));
        let third = rate(&middle, &state.after(half_s, &second));
        let fourth = rate(end, &state.after(step_s, &third));
        state
            .after(step_s / 6.0, &first)
            .after(step_s / 3.0, &second)
            .after(step_s / 3.0, &third)
            .after(step_s / 6.0, &fourth)
    }
}
