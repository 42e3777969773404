//! Exact steps of a rigid joint, which is linear within a mode except for gravity and the Stribeck effect.
//!
//! A step uses the matrix exponential of its mode ([`Transition`]). The external force is approximated by a line with
//! the impulse of the parabola through its start, middle and end, as are the nonlinear forces of gravity and
//! friction, whose parabola is found by iteration along the resulting motion.

use super::friction::FrictionParameters;
use super::gear::Flow;
use super::mechanics::{Inputs, Mechanics};
use super::mode::{Mode, direction};
use super::motor::JointMotorParameters;
use super::state::State;
use super::stops::{Contact, StopsParameters};
use crate::plant::transition::{Dynamics, Motion, Transition};

/// Capacity, more than a usual joint needs.
const MAX_KNOWN: usize = 64;

/// Cache of steps.
#[derive(Debug)]
pub(super) struct ExactSteps {
    /// Energy stored at the start, `J`.
    pub(super) start_j: f64,
    /// Whether the joint has no Coulomb friction, losses, winding or nonlinear forces.
    is_plain: bool,
    known: Vec<Known>,
    /// The step that was used last.
    last: usize,
}

#[derive(Debug)]
pub(super) struct Known {
    key: Key,
    pub(super) regime: Regime,
    pub(super) whole: Transition,
    /// Transitions of half and quarter steps; `None` without nonlinear forces.
    pub(super) parts: Option<[Transition; 2]>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Key {
    stop: Contact,
    flow: Flow,
    /// Of the load's spring, and of the length of the step, `s`.
    bits: [u64; 2],
}

/// Coefficients of a mode.
#[derive(Debug, Clone, Copy)]
pub(super) struct Regime {
    pub(super) dynamics: Dynamics,
    /// Force at the output per torque of the rotor.
    pub(super) leverage: f64,
    /// Force against the output per velocity, without a stop's.
    pub(super) resistance: f64,
    /// Coulomb friction force.
    pub(super) coulomb: f64,
    /// Natural frequency.
    rad_per_s: f64,
    /// Growth rate by nonlinear forces, `1/s`.
    growth_per_s: f64,
    /// Maximum displacement per acceleration over any time, `s²`.
    swing_s2: f64,
}

impl ExactSteps {
    pub(super) fn new(mechanics: &Mechanics) -> Self {
        let is_plain = mechanics.is_plain();
        Self { start_j: mechanics.stored_j(&mechanics.start()), is_plain, known: Vec::new(), last: 0 }
    }

    /// Returns the step in `mode`.
    pub(super) fn get(&mut self, mechanics: &Mechanics, mode: &Mode, step_s: f64) -> &Known {
        let bits = [mechanics.load.stiffness.to_bits(), step_s.to_bits()];
        let key = Key { stop: mode.stop, flow: mode.flow, bits };
        let is_it = |known: &Known| known.key == key;
        if !self.known.get(self.last).is_some_and(is_it) {
            self.last = self.known.iter().position(is_it).unwrap_or_else(|| {
                if self.known.len() >= MAX_KNOWN {
                    self.known.clear();
                }
                let regime = mechanics.regime(mode);
                let over = |share: f64| Transition::over(&regime.dynamics, share * step_s);
                let parts = mechanics.is_bent().then(|| [over(0.5), over(0.25)]);
                self.known.push(Known { key, regime, whole: over(1.0), parts });
                self.known.len() - 1
            });
        }
        #[expect(clippy::indexing_slicing, reason = "the place was just found")]
        &self.known[self.last]
    }
}

impl Mechanics {
    /// Whether its equations are linear within a mode, except for gravity and Stribeck effect.
    pub(super) fn is_exact(&self) -> bool {
        self.flexible.is_none() && !self.friction.has_presliding() && self.motor.is_linear()
    }

    /// Whether every mode is linear and only stops change the mode.
    fn is_plain(&self) -> bool {
        let is_dry = self.friction.is_dry() || self.gear.is_lossy();
        self.motor == JointMotorParameters::default() && !is_dry && !self.is_bent()
    }

    /// Whether forces within a mode are nonlinear.
    fn is_bent(&self) -> bool {
        self.load.gravity_torque_nm.abs() > 0.0 || self.friction.breakaway > self.friction.coulomb
    }

    /// Nonlinear force of gravity and Stribeck effect.
    pub(super) fn bent_force(&self, mode: &Mode, position: f64, velocity: f64) -> f64 {
        let FrictionParameters { coulomb, .. } = self.friction;
        let dip = direction(mode.output) * (self.friction.level(velocity) - coulomb);
        self.load.hanging_force(position) - dip
    }

    /// Returns the acceleration in `mode` under the force `outside`, `N m` or `N`.
    #[inline]
    pub(super) fn net_force(
        &self,
        regime: &Regime,
        state: &State,
        mode: &Mode,
        wanted_nm: f64,
        outside: f64,
    ) -> f64 {
        let stop = |stops: &StopsParameters| stops.force(mode.stop, state.position, state.velocity);
        regime.leverage * self.motor.torque_nm(wanted_nm, state)
            + outside
            + self.load.linear_force(state.position)
            - regime.resistance * state.velocity
            - direction(mode.output) * regime.coulomb
            + self.stops.as_ref().map_or(0.0, stop)
    }

    /// Advances a plain joint by a whole period under a constant force; returns false if a stop engages or disengages
    /// within it. [`Leg`](super::leg::Leg) is the general case; this one covers most ticks.
    pub(super) fn glide(
        &self,
        steps: &mut ExactSteps,
        state: &mut State,
        Inputs { wanted_nm, load, .. }: Inputs,
        period_s: f64,
    ) -> bool {
        if !steps.is_plain {
            return false;
        }
        let contact = |stops: &StopsParameters| stops.contact(state.position, state.velocity);
        let mode = Mode::free(self.stops.as_ref().map_or(Contact::Free, contact));
        let Known { regime, whole, .. } = steps.get(self, &mode, period_s);
        let acceleration = self.net_force(regime, state, &mode, wanted_nm, load) * whole.inverse_mass_per_kg;
        if let Some(stops) = &self.stops {
            let Some([room, room_per_s]) = stops.reach(mode.stop, state) else { return false };
            let [moved, slowed] = regime.excursion(state.velocity.abs(), acceleration, 0.0, period_s);
            if !(moved < room && slowed < room_per_s) {
                return false;
            }
        }
        let start = Motion {
            position_m: state.position,
            velocity_m_per_s: state.velocity,
            acceleration_m_per_s2: acceleration,
        };
        let end = whole.step(&start, 0.0);
        state.supplied_j += (self.gear.ratio * wanted_nm + load) * (end.position_m - state.position);
        (state.position, state.velocity) = (end.position_m, end.velocity_m_per_s);
        true
    }

    fn regime(&self, mode: &Mode) -> Regime {
        let touched = match mode.stop {
            Contact::Free | Contact::Released => None,
            Contact::Lower | Contact::Upper => self.stops.as_ref(),
        };
        let (stiffness, damping) =
            touched.map_or((0.0, 0.0), |StopsParameters { stiffness, damping, .. }| (*stiffness, *damping));
        let ratio = self.gear.ratio;
        let leverage = ratio * self.gear.share(mode.flow);
        let inertia = self.load.inertia + leverage * ratio * self.rotor_kg_m2;
        let rotor_ns = leverage * ratio * self.motor.viscous_nms_per_rad();
        let resistance = self.load.damping + self.friction.viscous + rotor_ns;
        let winding = self.winding.as_ref();
        let dynamics = Dynamics {
            stiffness_n_per_m: self.load.stiffness + stiffness,
            damping_n_s_per_m: resistance + damping,
            inverse_mass_per_kg: inertia.recip(),
            bandwidth_per_s: winding.map_or(0.0, |winding| winding.bandwidth_per_s),
            force_n_per_a: winding.map_or(0.0, |winding| leverage * winding.nm_per_a),
        };
        let coulomb = self.friction.coulomb + leverage * self.motor.coulomb_nm();
        let gravity = self.load.gravity_torque_nm.abs();
        let rad2_per_s2 = (dynamics.stiffness_n_per_m + gravity) / inertia;
        let rad_per_s = rad2_per_s2.sqrt();
        let unsteady = self.friction.steepest() + if gravity > 0.0 { gravity / rad_per_s } else { 0.0 };
        let damped = dynamics.damping_n_s_per_m / (inertia * rad_per_s);
        let swing_s2 = 2.0 / rad2_per_s2 * (1.0 + damped * damped).sqrt();
        let growth_per_s = unsteady / inertia;
        let swing_s2 = if gravity > 0.0 || swing_s2.is_nan() { f64::INFINITY } else { swing_s2 };
        Regime { dynamics, leverage, resistance, coulomb, rad_per_s, growth_per_s, swing_s2 }
    }
}

impl Regime {
    /// By how much, at most, position and velocity change in a step that begins at a speed with an acceleration, while other
    /// forces change by `change`.
    ///
    /// From `a' = -w² v - d/m a + j`: `sqrt(a² + w² v²)` grows by at most `|j| t`, so `A`, its value at the start plus
    /// `|j| t`, bounds `|a|`; the velocity changes by at most `A t`, the position by `(|v| + A t) t`. Around its equilibrium
    /// the joint oscillates by at most `A/w² sqrt(1 + (d/(m w))²)`, which bounds both however long the step is. Where the dip
    /// of friction falls by `s` per velocity and gravity changes by `g` per position, with `g` in `w²` the root also grows
    /// with the rate `(s + g/w)/m`.
    pub(super) fn excursion(&self, speed: f64, acceleration: f64, change: f64, step_s: f64) -> [f64; 2] {
        let turning = self.rad_per_s * speed;
        let mut fastest = (acceleration * acceleration + turning * turning).sqrt()
            + change * self.dynamics.inverse_mass_per_kg;
        if self.growth_per_s > 0.0 {
            fastest *= libm::exp(self.growth_per_s * step_s);
        }
        let slowed = (fastest * step_s).min(2.0 * fastest / self.rad_per_s);
        [((speed + slowed) * step_s).min(self.swing_s2 * fastest), slowed]
    }
}
