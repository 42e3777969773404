//! FDCAN and the bus without a program: the tests write registers, as a debugger does on a halted processor.
#![expect(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::panic,
    reason = "allowed in test helpers as in tests"
)]

mod adapter;
mod desk;
mod errors;
mod filters;
mod frames;
mod rules;
