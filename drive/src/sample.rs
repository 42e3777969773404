//! What a board's converters show in a period.

use crate::Angle;

/// All that is measured at one instant, in the middle of the time that all lower switches are on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Currents of the phases U, V, W into the motor, `A`; infinite where a converter is at its end.
    pub phase_a: [f32; 3],
    /// Voltage of the supply, `V`.
    pub bus_v: f32,
    /// Temperature of the power stage or the winding, whichever is nearer to its limit, `°C`.
    pub temperature_c: f32,
    /// What the encoder says.
    pub rotor: Rotor,
}

/// The rotor's angle as its encoder has it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rotor {
    /// It is there, a mechanical angle.
    At(Angle),
    /// Its next reading is on the way: it is read less often than once in a period.
    Awaited,
    /// It did not answer, or what it said was damaged.
    Lost,
    /// It says that its magnet is too weak, too strong or gone.
    BadMagnet,
}
