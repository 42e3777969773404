//! One exact step: its forces and its validity.

use super::exact::{ExactSteps, Known};
use super::mechanics::{Inputs, Mechanics};
use super::mode::{Mode, Slide};
use super::push::Push;
use super::state::State;
use super::stops::StopsParameters;
use super::winding::Current;
use crate::plant::transition::{Motion, Transition};

/// Tolerance of the parabola for the external force, relative to all forces.
const SMOOTH: f64 = 1e-8;
/// Tolerance for nonlinear forces: most errors cancel around the middle.
const SMOOTH_BEND: f64 = 1e-6;
/// Maximum iterations of a parabola; each reduces the error by 100 or more.
const MAX_SUBSTITUTIONS: usize = 8;
/// Relative change at convergence.
const SETTLED: f64 = 1e-8;

/// A step within a mode.
pub(super) struct Leg<'a> {
    mechanics: &'a Mechanics,
    known: &'a Known,
    mode: &'a Mode,
    start: &'a State,
    inputs: &'a Inputs,
    push: &'a Push,
    current: Option<Current>,
    step_s: f64,
}

impl<'a> Leg<'a> {
    pub(super) fn new(
        mechanics: &'a Mechanics,
        steps: &'a mut ExactSteps,
        mode: &'a Mode,
        start: &'a State,
        inputs: &'a Inputs,
        (push, step_s): (&'a Push, f64),
    ) -> Self {
        let known = steps.get(mechanics, mode, step_s);
        let current = mechanics.winding.as_ref().map(|winding| winding.current(inputs.wanted_nm, start));
        Self { mechanics, known, mode, start, inputs, push, current, step_s }
    }

    /// The end of the step.
    pub(super) fn end(&self) -> State {
        self.end_under(&self.bend())
    }

    /// The end of the step, if the mode cannot change on the way and all forces are smooth.
    pub(super) fn sure_end(&self) -> Option<State> {
        let Self { mode, push, .. } = *self;
        let scale = push.scale() + (self.mechanics.gear.ratio * self.inputs.wanted_nm).abs();
        if mode.is_limited || push.is_rougher_than(SMOOTH * scale) {
            return None;
        }
        if mode.output == Slide::Stuck {
            return self.stays_stuck().then(|| self.end_under(&Push::default()));
        }
        if !self.outlasts() {
            return None;
        }
        let bend = self.bend();
        let scale = scale + self.known.regime.coulomb + bend.scale();
        (!bend.is_rougher_than(SMOOTH_BEND * scale)).then(|| self.end_under(&bend))
    }

    /// Returns the acceleration at the start under the force `outside`, `N m` or `N`.
    fn net_force(&self, outside: f64) -> f64 {
        let Self { mechanics, known, mode, start, inputs, .. } = *self;
        mechanics.net_force(&known.regime, start, mode, inputs.wanted_nm, outside)
    }

    /// Motion at the start and jerk under `force`, and the motion at the end of `transition` after `step_s`.
    fn moved(&self, transition: &Transition, force: &Push, step_s: f64) -> (Motion, f64, Motion) {
        let inverse = transition.inverse_mass_per_kg;
        let [outside, change] = force.line();
        let start = Motion {
            position_m: self.start.position,
            velocity_m_per_s: self.start.velocity,
            acceleration_m_per_s2: self.net_force(outside) * inverse,
        };
        let jerk = change / step_s * inverse;
        let end = match self.rate_a_per_s() {
            None => transition.step(&start, jerk),
            Some(rate_a_per_s) => transition.driven_step(&start, rate_a_per_s, jerk),
        };
        (start, jerk, end)
    }

    /// Rate of the current at the start; `None` without a winding.
    fn rate_a_per_s(&self) -> Option<f64> {
        Some(-self.known.regime.dynamics.bandwidth_per_s * self.current?.off_a)
    }

    /// Nonlinear forces of gravity and Stribeck effect along the resulting motion.
    fn bend(&self) -> Push {
        let (Some([half, quarter]), false) = (&self.known.parts, self.mode.output == Slide::Stuck) else {
            return Push::default();
        };
        let at = |position, velocity| self.mechanics.bent_force(self.mode, position, velocity);
        let after = |transition: &Transition, force: &Push, share: f64| {
            let (.., end) = self.moved(transition, force, share * self.step_s);
            at(end.position_m, end.velocity_m_per_s)
        };
        let mut bend = Push::held(at(self.start.position, self.start.velocity));
        for _ in 0..MAX_SUBSTITUTIONS {
            let force = *self.push + bend;
            let middle = after(half, &force.first_half(), 0.5);
            let end = after(&self.known.whole, &force, 1.0);
            let change = (middle - bend.middle).abs() + (end - bend.end).abs();
            bend = Push::parabola([bend.start, middle, end]);
            if change <= SETTLED * bend.scale() {
                break;
            }
        }
        let force = *self.push + bend;
        Push { quarter: after(quarter, &force.first_half().first_half(), 0.25), ..bend }
    }

    fn end_under(&self, bend: &Push) -> State {
        let Self { mechanics, known: Known { whole, .. }, mode, inputs, step_s, .. } = *self;
        let mut state = *self.start;
        let settled = |state: &mut State| {
            let winding = mechanics.winding.as_ref().zip(self.current);
            winding.map_or(0.0, |(winding, current)| winding.settle(whole, state, current, step_s))
        };
        state.supplied_j += settled(&mut state);
        if mode.output == Slide::Stuck {
            return state;
        }
        let (start, jerk, end) = self.moved(whole, &(*self.push + *bend), step_s);
        let moved = end.position_m - start.position_m;
        let rate_a_per_s = self.rate_a_per_s().unwrap_or_default();
        let [outside, change] = self.push.line();
        let outside_j = outside * moved + change / step_s * whole.late_ms(&start, rate_a_per_s, jerk);
        let motor_j = mechanics.gear.ratio
            * match mechanics.winding.as_ref().zip(self.current) {
                None => inputs.wanted_nm * moved,
                Some((winding, Current { settled_a, off_a })) => {
                    let lagged_m = whole.lagged_m(&start, rate_a_per_s, jerk);
                    winding.nm_per_a * (settled_a * moved + off_a * lagged_m)
                }
            };
        state.supplied_j += motor_j + outside_j;
        (state.position, state.velocity) = (end.position_m, end.velocity_m_per_s);
        state
    }

    /// Whether friction holds the joint for the whole step.
    fn stays_stuck(&self) -> bool {
        let Self { mechanics, inputs, mode, start, current, .. } = *self;
        let [least, most] = self.push.range();
        let accelerates = |output: Slide, load: f64, current_a: f64| {
            let (inputs, state) = (Inputs { load, ..*inputs }, State { quadrature_a: current_a, ..*start });
            mechanics.acceleration(&inputs, &state, &Mode { output, ..*mode })
        };
        let [min_a, max_a] = current.map_or([start.quadrature_a; 2], Current::range_a);
        accelerates(Slide::Forward, most, max_a) <= 0.0
            && accelerates(Slide::Backward, least, min_a) >= 0.0
            && self.follows(0.0)
    }

    fn follows(&self, slowed: f64) -> bool {
        let Self { mechanics, start, .. } = self;
        mechanics.winding.as_ref().zip(self.current).is_none_or(|(winding, current)| {
            let ratio = mechanics.gear.ratio;
            winding.follows(start, current, ratio * start.velocity, ratio * slowed)
        })
    }

    /// Whether no event is possible: contact, release, stop of sliding, reversal of power, limit.
    fn outlasts(&self) -> bool {
        let Self { mechanics, known: Known { regime, .. }, mode, start, push, step_s, .. } = *self;
        let reach = |stops: &StopsParameters| stops.reach(mode.stop, start);
        let Some([room, room_per_s]) = mechanics.stops.as_ref().map_or(Some([f64::INFINITY; 2]), reach)
        else {
            return false;
        };
        let bent = mechanics.bent_force(mode, start.position, start.velocity);
        let acceleration = self.net_force(push.start + bent) * regime.dynamics.inverse_mass_per_kg;
        let change_a = self.current.map_or(0.0, |current| current.off_a.abs());
        let change = push.variation() + regime.dynamics.force_n_per_a * change_a;
        let speed = start.velocity.abs();
        let [moved, slowed] = regime.excursion(speed, acceleration, change, step_s);
        let is_there = |room: f64, most: f64| room.is_infinite() || most < room;
        is_there(room, moved)
            && is_there(room_per_s, slowed)
            && (mode.output == Slide::Frictionless || slowed < speed)
            && self.follows(slowed)
            && self.keeps_flow(slowed, moved)
    }

    /// Whether the power through a lossy gear keeps its direction while the current settles, the velocity changes by
    /// at most `slowed` and the position by at most `moved`.
    fn keeps_flow(&self, slowed: f64, moved: f64) -> bool {
        let Self { mechanics, known: Known { regime, .. }, mode, start, inputs, push, .. } = *self;
        if !mechanics.gear.is_lossy() {
            return true;
        }
        let turned = mechanics.motor.viscous_nms_per_rad() * mechanics.gear.ratio * slowed;
        let outer = push.variation()
            + (regime.dynamics.stiffness_n_per_m + mechanics.load.gravity_torque_nm.abs()) * moved
            + (regime.dynamics.damping_n_s_per_m + mechanics.friction.steepest()) * slowed;
        let changes = mechanics.transmitted_by(turned, -outer);
        let first = mechanics.transmitted(&Inputs { load: push.start, ..*inputs }, start, mode);
        let settled_a = self.current.map_or(start.quadrature_a, |current| current.settled_a);
        let settled = State { quadrature_a: settled_a, ..*start };
        let last = mechanics.transmitted(&Inputs { load: push.start, ..*inputs }, &settled, mode);
        first.abs().min(last.abs()) > changes && first * last > 0.0
    }
}
