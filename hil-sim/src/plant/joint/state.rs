//! State of a joint.

/// State, or its rate per second.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct State {
    /// Of the output, `rad` or `m`.
    pub(super) position: f64,
    /// Of the output, `rad/s` or `m/s`.
    pub(super) velocity: f64,
    /// Rotor with a flexible element; unused for a rigid joint.
    pub(super) rotor_rad: f64,
    pub(super) rotor_rad_per_s: f64,
    /// `LuGre`'s `z`, `rad` or `m`.
    pub(super) deflection: f64,
    pub(super) direct_a: f64,
    /// Torque-producing current; a brushed motor's only current.
    pub(super) quadrature_a: f64,
    /// Dead-time compensation of the current controllers' integrators.
    pub(super) learned_d_v: f64,
    pub(super) learned_q_v: f64,
    pub(super) winding_c: f64,
    pub(super) supplied_j: f64,
    pub(super) dissipated_j: f64,
}

impl State {
    /// State of a linear model: without energies and winding temperature.
    pub(super) fn values_mut(&mut self) -> [&mut f64; 9] {
        [
            &mut self.position,
            &mut self.velocity,
            &mut self.rotor_rad,
            &mut self.rotor_rad_per_s,
            &mut self.deflection,
            &mut self.direct_a,
            &mut self.quadrature_a,
            &mut self.learned_d_v,
            &mut self.learned_q_v,
        ]
    }

    /// The state after `time_s` at `rate`.
    pub(super) fn after(&self, time_s: f64, rate: &Self) -> Self {
        let on = |value: f64, rate: f64| value + time_s * rate;
        Self {
            position: on(self.position, rate.position),
            velocity: on(self.velocity, rate.velocity),
            rotor_rad: on(self.rotor_rad, rate.rotor_rad),
            rotor_rad_per_s: on(self.rotor_rad_per_s, rate.rotor_rad_per_s),
            deflection: on(self.deflection, rate.deflection),
            direct_a: on(self.direct_a, rate.direct_a),
            quadrature_a: on(self.quadrature_a, rate.quadrature_a),
            learned_d_v: on(self.learned_d_v, rate.learned_d_v),
            learned_q_v: on(self.learned_q_v, rate.learned_q_v),
            winding_c: on(self.winding_c, rate.winding_c),
            supplied_j: on(self.supplied_j, rate.supplied_j),
            dissipated_j: on(self.dissipated_j, rate.dissipated_j),
        }
    }
}
