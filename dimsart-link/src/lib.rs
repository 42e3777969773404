//! Protocol between DIMSART controllers and hosts: encodes and decodes bytes. No allocator, no `unsafe`, no
//! panic.
//!
//! ```text
//! COMM_TX ─▶ packet ─▶ envelope ─▶ (auth) ─▶ carrier ─▶ UART, CAN, UDP ─▶ carrier ─▶ (auth) ─▶ envelope ─▶ COMM_RX
//! request, response, heartbeat, telemetry ─┘
//! ```
//!
//! [`Packet`](dimsart_core::Packet) and [`envelope`](dimsart_core::envelope) are in the core, which receives
//! packets in a tick.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

#[cfg(feature = "auth")]
pub mod auth;
pub mod carrier;
mod encode;
mod event_log;
pub mod exchange;
pub mod protocol;
pub mod saved_scheme;

pub use event_log::{Event, EventKind, EventLog, MAX_EVENTS, StartCause};
