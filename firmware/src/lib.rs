//! The hardware-independent parts of the firmware: stored schemes, motor configuration, key, arbitration of
//! the command line, and watchdog.
#![no_std]
#![forbid(unsafe_code)]

mod items;
mod key_store;
mod line_input;
mod motor_store;
mod read_back;
mod scheme_store;
mod start;
mod watchdog;

pub use key_store::{KeyStore, SEEDS_PER_START, StoredKey, StoredKeyState};
pub use line_input::{InputEvent, LineInput};
pub use read_back::StorageError;
pub use scheme_store::SchemeStore;
pub use start::start;
pub use watchdog::Watchdog;
