//! `dimsart connect` with a controller behind a socket or serial port, over good and bad lines.
#![expect(
    clippy::unwrap_used,
    clippy::panic,
    clippy::indexing_slicing,
    reason = "in helpers of tests as in tests"
)]

mod asking;
mod board;
mod config;
mod emulated;
mod events;
mod kept;
mod lease;
mod lines;
mod ports;
mod recorder;
mod same_words;
