//! Controllers as firmware on the emulated board.
//!
//! Without image or emulator these tests are skipped with a note; if `DIMSART_FIRMWARE` names a folder of images, both are
//! required. Faults are tested everywhere, with a stand-in for the emulator.
#![cfg(unix)]
#![expect(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::panic,
    reason = "in helpers of tests as in tests"
)]

mod admission;
mod by_hand;
mod common;
mod debugger;
mod firmware;
mod flood;
mod kept_schemes;
mod keys;
mod measured;
mod patched;
mod rigs;
mod run;
mod same_bits;
mod same_state;
mod stopped;
mod timer_tick;
mod transactions;
mod trouble;
mod watchdog;
