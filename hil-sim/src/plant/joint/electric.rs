//! The electrical side of a motor.

use super::state::State;

/// The electrical side at one instant.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Electric {
    /// Rates of the motor's states.
    pub(super) rates: State,
    /// Voltage, `V`; three-phase: amplitude.
    pub(super) voltage_v: f64,
    /// Power from the amplifier, `W`.
    pub(super) supplied_w: f64,
    /// Power loss in winding and amplifier, `W`.
    pub(super) lost_w: f64,
}
