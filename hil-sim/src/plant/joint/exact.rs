//! Exact steps of a rigid joint, whose equations are linear within a mode but for gravity and the dip of dry friction.
//!
//! A step has the matrix exponential of its mode ([`Transition`]). The outside force goes along a line through a step, with
//! the impulse of the parabola through its start, middle and end. So does what gravity and friction exert beyond linear
//! forces: the parabola's values are those along the motion that it leads to, by repeated substitution.

use super::friction::FrictionParameters;
use super::gear::Flow;
use super::mechanics::Mechanics;
use super::mode::{Mode, direction};
use super::stops::{Contact, StopsParameters};
use crate::plant::transition::{Dynamics, Transition};

/// Steps in use are fewer in any usual joint.
const MAX_KNOWN: usize = 64;

/// The steps met so far, so that each is computed once.
#[derive(Debug)]
pub(super) struct ExactSteps {
    /// Energy stored at the start, `J`.
    pub(super) start_j: f64,
    known: Vec<Known>,
    /// The step that was used last.
    last: usize,
}

#[derive(Debug)]
pub(super) struct Known {
    key: Key,
    pub(super) regime: Regime,
    pub(super) whole: Transition,
    /// Of its half and its quarter; none where forces are linear.
    pub(super) parts: Option<[Transition; 2]>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Key {
    stop: Contact,
    flow: Flow,
    /// Of the load's spring, and of the length of the step, `s`.
    bits: [u64; 2],
}

/// The coefficients of a mode.
#[derive(Debug, Clone, Copy)]
pub(super) struct Regime {
    pub(super) dynamics: Dynamics,
    /// Force at the output per torque of the rotor.
    pub(super) leverage: f64,
    /// Force against the output per velocity, without a stop's.
    pub(super) resistance: f64,
    /// Force against the motion.
    pub(super) coulomb: f64,
}

impl ExactSteps {
    pub(super) fn new(mechanics: &Mechanics) -> Self {
        Self { start_j: mechanics.stored_j(&mechanics.start()), known: Vec::new(), last: 0 }
    }

    /// The step in `mode`.
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
    /// Whether its equations are linear within a mode, but for gravity and the dip of dry friction.
    pub(super) fn is_exact(&self) -> bool {
        self.flexible.is_none() && !self.friction.has_presliding() && self.motor.is_linear()
    }

    /// Whether forces within a mode are not linear.
    fn is_bent(&self) -> bool {
        self.load.gravity_torque_nm.abs() > 0.0 || self.friction.breakaway > self.friction.coulomb
    }

    /// What gravity and the dip of dry friction exert beyond linear forces.
    pub(super) fn bent_force(&self, mode: &Mode, position: f64, velocity: f64) -> f64 {
        let FrictionParameters { coulomb, .. } = self.friction;
        let dip = direction(mode.output) * (self.friction.level(velocity) - coulomb);
        self.load.hanging_force(position) - dip
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
            damping_ns_per_m: resistance + damping,
            inverse_mass_per_kg: inertia.recip(),
            bandwidth_per_s: winding.map_or(0.0, |winding| winding.bandwidth_per_s),
            force_n_per_a: winding.map_or(0.0, |winding| leverage * winding.nm_per_a),
        };
        let coulomb = self.friction.coulomb + leverage * self.motor.coulomb_nm();
        Regime { dynamics, leverage, resistance, coulomb }
    }
}
