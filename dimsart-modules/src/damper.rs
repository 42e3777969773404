//! The damper of a passivity controller: it takes energy that came out of a port too much back, as much as it may.

use dimsart_core::{ParameterSet, Parameters, Unit, choice, words};

choice! {
    /// What the port takes, and what it gives.
    pub enum Causality {
        /// Motion in, force out.
        Impedance = "IMPEDANCE",
        /// Force in, motion out.
        Admittance = "ADMITTANCE",
    }
}

impl Causality {
    /// Lists it among the parameters.
    pub(super) fn parameter(&mut self, visit: &mut Parameters<'_>) {
        visit.structural_choice(self, "CAUSALITY", "What the port takes, and what it gives.");
    }
}

words! {
    /// Of an axis.
    pub parameters Damper {
        /// Largest damper in series; under ADMITTANCE the smallest one in parallel.
        damper: f32 = per_axis("DAMPER", Unit::Damping, 0.0..=1e6, 10.0),
        /// Largest force out, either way.
        pub(super) limit: f32 = per_axis("LIMIT", Unit::Force, 0.0..=1e4, 1e4),
        pub(super) energy_limit_j: f32,
        /// Most of a damping, or of one over it.
        pub(super) cap: f32,
    }
}

impl Damper {
    /// Lists the parameters; `kept` is the help text of the energy limit.
    pub(super) fn parameters(&mut self, visit: &mut Parameters<'_>, kept: &'static str) {
        self.visit(visit);
        visit.per_axis(&mut self.energy_limit_j, "ENERGY_LIMIT", Unit::Energy, 0.0..=100.0, 10.0, kept);
    }

    /// Works out the cap.
    pub(super) fn prepare(&mut self, causality: Causality) {
        let is_impedance = causality == Causality::Impedance;
        self.cap = if is_impedance { self.damper } else { 1.0 / self.damper.max(1e-3) };
    }
}

/// The damping that takes `deficit_j` out of a port in a tick, at most `cap`: `-E / (h flow²)`.
///
/// `flow` is a velocity for a damper in series (impedance causality), a force for one in parallel (admittance
/// causality). With the cap, what is not taken now is left for later ticks.
#[inline(always)]
pub(super) fn damping(deficit_j: f32, flow: f32, period_s: f32, cap: f32) -> f32 {
    let square = period_s * flow * flow;
    if deficit_j <= 0.0 {
        0.0
    } else if cap * square <= deficit_j {
        cap
    } else {
        deficit_j / square
    }
}
