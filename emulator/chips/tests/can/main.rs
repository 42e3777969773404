//! FDCAN and the bus, without a program: registers are written as a debugger does while the processor stands still.
#![expect(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::panic,
    reason = "in helpers of tests as in tests"
)]

mod adapter;
mod desk;
mod errors;
mod filters;
mod frames;
mod rules;
