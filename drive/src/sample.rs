//! Measurements of a board in one period.

use crate::Angle;

/// Measurements at one instant, in the middle of the time in which all lower switches are on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Currents of the phases U, V, W into the motor, `A`; infinite for a saturated converter.
    pub phase_a: [f32; 3],
    /// Supply voltage, `V`.
    pub bus_v: f32,
    /// Temperature of power stage or winding, whichever is closer to its limit, `°C`.
    pub temperature_c: f32,
    /// Encoder reading.
    pub rotor: Rotor,
}

/// Encoder reading of the rotor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rotor {
    /// Valid mechanical angle.
    Angle(Angle),
    /// No reading in this period: the encoder is read less often.
    NotSampled,
    /// No or corrupted response.
    Lost,
    /// Magnet too weak, too strong or missing.
    BadMagnet,
}
