//! Damper of a passivity controller: dissipates the excess energy that a port has generated, up to a limit.

use dimsart_core::{ParameterSet, Parameters, Unit, choice, words};

choice! {
    /// Causality of the port.
    pub enum Causality {
        /// Motion in, force out.
        Impedance = "IMPEDANCE",
        /// Force in, motion out.
        Admittance = "ADMITTANCE",
    }
}

impl Causality {
    /// Declares the parameter.
    pub(super) fn parameter(&mut self, visit: &mut Parameters<'_>) {
        visit.structural_choice(self, "CAUSALITY", "Causality of the port; IMPEDANCE: motion in, force out.");
    }
}

words! {
    /// Parameters of one axis.
    pub parameters Damper {
        /// Maximum series damping; for ADMITTANCE, minimum parallel damping.
        damper: f32 = per_axis("DAMPER", Unit::Damping, 0.0..=1e6, 10.0),
        /// Maximum output force, in either direction.
        pub(super) limit: f32 = per_axis("LIMIT", Unit::Force, 0.0..=1e4, 1e4),
        pub(super) energy_limit_j: f32,
        /// Maximum of the damping, or of its inverse.
        pub(super) cap: f32,
    }
}

impl Damper {
    /// Declares the parameters; `kept` is the help text of the energy limit.
    pub(super) fn parameters(&mut self, visit: &mut Parameters<'_>, kept: &'static str) {
        self.visit(visit);
        visit.per_axis(&mut self.energy_limit_j, "ENERGY_LIMIT", Unit::Energy, 0.0..=100.0, 10.0, kept);
    }

    /// Computes the cap.
    pub(super) fn prepare(&mut self, causality: Causality) {
        let is_impedance = causality == Causality::Impedance;
        self.cap = if is_impedance { self.damper } else { 1.0 / self.damper.max(1e-3) };
    }
}

/// Returns the damping that dissipates `deficit_j` in one tick, at most `cap`: `-E / (h flow²)`.
///
/// `flow` is a velocity for a series damper (impedance causality), a force for a parallel damper (admittance
/// causality). The rest above the cap is dissipated in later ticks.
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
