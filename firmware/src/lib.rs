//! What the firmware keeps that needs no board: the schemes it starts with, and when a watchdog is fed.
#![no_std]
#![forbid(unsafe_code)]

mod scheme_store;
mod start;
mod watchdog;

pub use scheme_store::{BUFFER_BYTES, Broken, SchemeStore};
pub use start::start;
pub use watchdog::Watchdog;
