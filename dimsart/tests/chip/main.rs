//! The flash images, booted in an emulated STM32G4.
//!
//! Without images these tests are skipped with a note; if `DIMSART_FIRMWARE` names a folder of images, as in
//! `cargo xtask test`, a missing image is a failure.
#![expect(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::panic,
    reason = "in helpers of tests as in tests"
)]

mod boot;
mod client;
mod command;
mod commissioning;
mod common;
mod drive;
mod encoders;
mod frame_bits;
mod image_drive;
mod kept_motor;
mod kept_schemes;
mod law;
mod moteus;
mod motor;
mod pair;
mod pin_plan;
mod register_writes;
mod shield;
mod transceiver;
mod trouble;
mod two_boards;
