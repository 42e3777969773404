//! The command line: frames, requests and responses over a byte stream.
//!
//! ```text
//! frame    0 | COBS(content) | 0
//! content  class u8 | id u16 | payload | CRC-32 u32     at most 256 bytes, an envelope of channel 0
//! ```
//! See [`envelope`](dimsart_core::envelope) for the bytes. A zero occurs only between frames, so a receiver
//! resynchronises after any corruption. The payload is a [`Request`] (class 1) or a [`Response`] (class 2) in
//! postcard's format: variants by number in order of declaration, integers of more than 8 bits as varints,
//! `f32` as 4 bytes, texts with a length prefix.
//!
//! # Discovery
//!
//! A host needs no tables. [`Request::Identify`] identifies the device; modules, parameters, ports and data
//! types are listed by ascending index until [`Refusal::NotFound`]. The response to a command is its
//! [`Effect`], not only an acknowledgement. Every request gets one response with the same id; the
//! [`Receiver`] drops and counts damaged frames.
//!
//! # Clients
//!
//! Several hosts can share a line; the high byte of a request's id identifies the client ([`request_id`]).
//! Every client may read. Motion needs the [`Lease`], which one client holds for 200 ms at a time. While a
//! client holds it, all other clients are read-only; when it expires, the device goes to its safe value.
//!
//! # Keys
//!
//! With feature `auth` a board can store a key ([`KeyAction`]). The board then accepts requests that change
//! or move something (`Request::needs_key`) only if they are sealed with that key; see `AccessControl` and
//! `RequestSealer`. Responses are not sealed.
//!
//! # Unsolicited messages
//!
//! A device sends a [`Heartbeat`] (class 5) ten times per second, and telemetry to one client at a time
//! (class 4, a [`Sample`] at the requested interval). Messages that exceed the line's capacity are dropped
//! and counted.
//!
//! # Versions
//!
//! [`PROTOCOL_VERSION`] increases when variants are added. Variants are added at the end, here and in every
//! transmitted core enum; from [`OLDEST_PROTOCOL_VERSION`] on, existing variants never change. A device
//! therefore answers every known request from an older or newer host, and [`Refusal::Unsupported`]
//! otherwise. Devices older than [`OLDEST_PROTOCOL_VERSION`] need the host program of their image.
//!
//! # Time
//!
//! Call [`serve`] between two ticks, at most once per tick: a flood of requests then waits in the caller's
//! queue and costs each tick one request at most. A request costs at most one
//! [command](dimsart_core::Engine::command) and one [check](dimsart_core::Engine::check); the check only
//! while the scheme is stopped, or for a [`Request::Finding`]. Instructions, counted on a Cortex-M4F:
//!
//! | Check of | Instructions |
//! |---|---|
//! | the bilateral scheme | 6000 |
//! | 16 matching modules | 11 000 |
//! | each signal that is not written once before all its reads | up to 3500 more |
//!
//! Most other requests take less than 1000. [`Request::SchemeCommand`] takes more, because it visits all
//! parameters of a module. Receiving, decoding and encoding do not need the engine and can run at lower
//! priority; [`Request`] (16 bytes on a Cortex-M) and [`Response`] (less than 200) are plain values that fit
//! a queue.

mod blocked;
mod client;
mod cycles;
mod description;
mod device_info;
mod frame;
#[cfg(feature = "auth")]
mod gate;
mod heartbeat;
mod key;
mod law;
mod lease;
mod motor;
mod receiver;
mod refusal;
mod request;
mod response;
mod safety;
mod schemes;
#[cfg(feature = "auth")]
mod sealed;
mod serve;
#[cfg(test)]
mod snapshot;
mod telemetry;

pub use blocked::{FirstFault, NotCommandedReason};
pub use client::{NO_CLIENT, request_client, request_id};
pub use cycles::CyclesReport;
pub use description::{Identity, InstanceDescription, ModuleDescription};
pub use device_info::DeviceInfo;
pub use dimsart_core::envelope::MAX_CONTENT_BYTES;
pub use frame::{BufferTooSmall, DecodeError, MAX_FRAME_BYTES};
#[cfg(feature = "auth")]
pub use gate::{AccessControl, AccessOutcome};
pub use heartbeat::{HEARTBEATS_PER_S, Heartbeat, decode_heartbeat, encode_heartbeat};
#[cfg(feature = "auth")]
pub use key::KeyBytes;
pub use key::{KeyAction, KeyRefusal, KeyState};
pub use law::LawAction;
pub use lease::{Lease, LeaseAction, LeaseStatus};
pub use motor::{
    Identification, IdentificationFailure, IdentifiedMotor, MAX_MOTOR_WORDS, MotorAction, MotorFallback,
    MotorRefusal, MotorReport, MotorWords, motor_checksum,
};
pub use receiver::{Counters, Receiver};
pub use refusal::Refusal;
pub use request::{Request, decode_request, encode_request};
pub use response::{
    Effect, MAX_SIGNAL_WORDS, Response, SignalWords, Status, TimingReport, decode_response, encode_response,
};
pub use safety::{MAX_REASONS, SafetyReport};
pub use schemes::{Fallback, Origin, SchemeAction, SchemeStatus, StoreError, Trial};
#[cfg(feature = "auth")]
pub use sealed::RequestSealer;
pub use serve::{answer, serve, serve_content};
pub use telemetry::{MAX_TELEMETRY_SIGNALS, MAX_TELEMETRY_WORDS, Sample, decode_sample, encode_sample};

/// Version of requests and responses; see the [module docs](self).
pub const PROTOCOL_VERSION: u16 = 17;

/// Oldest compatible version: earlier effects and states have other fields.
pub const OLDEST_PROTOCOL_VERSION: u16 = 17;
/// Default bit rate of a serial command line, bit/s.
pub const DEFAULT_BAUD: u32 = 921_600;
