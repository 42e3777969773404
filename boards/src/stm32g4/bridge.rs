//! A board with a bridge for a three-phase motor.

use drive::{Rotor, ValidConfiguration};
use embassy_stm32::pac::timer::TimGp16;

use super::current_sensing::Channels;
use crate::catalogue::ThreePhaseDrive;

/// The encoder of a board, used only by the current loop; calls take bounded time.
pub(crate) trait Encoder {
    /// Returns the reading, at the start of a period.
    fn rotor(&mut self) -> Rotor;

    /// Starts the next reading, at the end of a period.
    fn end(&mut self);
}

/// A board with a bridge for a three-phase motor.
pub(crate) trait ThreePhase {
    /// Default configuration and scaling.
    const DRIVE: ThreePhaseDrive;
    /// ADC channels.
    const CHANNELS: Channels;
    /// Counter for an incremental encoder.
    const COUNTER: TimGp16;
    /// Whether the low-side gate inputs are active low.
    const IS_LOW_SIDE_INVERTED: bool;

    /// Encoder type.
    type Encoder: Encoder;
    /// Wiring of the encoder.
    type EncoderPins: Send + 'static;

    /// Returns the image's configuration.
    fn image() -> ValidConfiguration;

    /// Returns whether the board supports this encoder.
    fn reads(encoder: drive::Encoder) -> bool;

    /// Starts a supported encoder.
    fn start_encoder(pins: Self::EncoderPins, encoder: drive::Encoder) -> Self::Encoder;
}
