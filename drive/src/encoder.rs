//! Absolute encoders: what to send, and what the bytes that come back say.
//!
//! A board's SPI or I²C moves the bytes and keeps the times. Where it fails, the rotor is [`Rotor::Lost`](crate::Rotor).
//! The angle is that of the last sample that the chip took.

mod as5047p;
mod as5600;
mod mt6701;

pub use as5047p::As5047p;
pub use as5600::As5600;
pub use mt6701::Mt6701;
