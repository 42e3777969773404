//! Absolute encoders: request bytes and decoding of responses.
//!
//! The board's SPI or I²C driver moves the bytes and meets the timing. If it fails, report
//! [`Rotor::Lost`](crate::Rotor). The angle is the chip's last sample.

mod as5047p;
mod as5600;
mod mt6701;

pub use as5047p::As5047p;
pub use as5600::As5600;
pub use mt6701::Mt6701;
