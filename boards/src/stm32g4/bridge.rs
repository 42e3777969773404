//! A board whose bridge drives a three-phase motor.

use drive::{Checked, Rotor};
use embassy_stm32::pac::timer::TimGp16;

use super::current_sensing::Channels;
use crate::catalogue::ThreePhaseDrive;

/// The encoder of a board. Only the current loop calls it; a call takes bounded time.
pub(crate) trait Encoder {
    /// At the begin of a period: what it says.
    fn rotor(&mut self) -> Rotor;

    /// Starts the next reading, at the end of a period.
    fn end(&mut self);
}

/// A board whose bridge drives a three-phase motor.
pub(crate) trait ThreePhase {
    /// Its motor and what it has for it, as it is compiled.
    const DRIVE: ThreePhaseDrive;
    /// Of the converters.
    const CHANNELS: Channels;
    /// That counts the edges of an incremental encoder.
    const COUNTER: TimGp16;
    /// Whether its gate drivers close a lower switch when their input is low.
    const IS_LOW_SIDE_INVERTED: bool;

    /// Its encoder.
    type Encoder: Encoder;
    /// What that is wired to.
    type EncoderPins: Send + 'static;

    /// What the image runs the motor by.
    fn image() -> Checked;

    /// Whether it can read such an encoder.
    fn reads(encoder: drive::Encoder) -> bool;

    /// Starts an encoder that it reads.
    fn start_encoder(pins: Self::EncoderPins, encoder: drive::Encoder) -> Self::Encoder;
}
