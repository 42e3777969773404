//! Commands over a byte stream: frames, requests, responses. Bytes in, bytes out.
//!
//! ```text
//! frame    0 | COBS(content) | 0
//! content  class u8 | id u16 | payload | CRC-32 u32     at most 256 bytes, an envelope of channel 0
//! ```
//! See [`envelope`](dimsart_core::envelope) for the bytes. Zero stands only between frames, so
//! whatever a line made of one frame, the next one is found. The payload is a [`Request`] (class 1) or
//! a [`Response`] (class 2) in postcard's format: variants by number in the order they are declared,
//! whole numbers of more than 8 bits as varints, `f32` as 4 bytes, texts with their length in front.
//!
//! # A host needs no table of its own
//!
//! [`Request::Identify`] says who is there; modules, parameters, ports and data types are listed by
//! rising index until [`Refusal::NotThere`]. What a command does is answered by its [`Effect`], not by
//! its having been understood. Every request is answered, by a response with the same id; a damaged
//! frame is dropped and counted by the [`Receiver`].
//!
//! # Clients
//!
//! Several hosts can share a line, and the high byte of an id says whose request it is ([`request_id`]). All of
//! them may look. Motion needs the [`Lease`], which one of them holds for 200 ms at a time; while it does, nobody
//! else changes anything, and once it does not, the device gets its safe input.
//!
//! # Keys
//!
//! With feature `auth` a board can keep a key ([`KeyAction`]). It then takes what changes or moves something
//! (`Request::needs_key`) sealed with that key alone; see `Gate` and `RequestSealer`. What it answers is not sealed.
//!
//! # Unsolicited
//!
//! A device sends a [`Heartbeat`] (class 5) ten times per second, and to one client at a time the signals that it
//! asked for (class 4, a [`Sample`] every so many ticks). What the line has no room for is dropped and counted.
//!
//! # Versions
//!
//! [`PROTOCOL_VERSION`] counts up when variants are added. They are added at the end, in this module
//! and in every core enum that travels, and from
//! [`OLDEST_PROTOCOL_VERSION`] on what is there never changes. So a device answers
//! all that it knows to an older or newer host, and [`Refusal::NotUnderstood`] to the rest. Devices before
//! [`OLDEST_PROTOCOL_VERSION`] need the host program of their image.
//!
//! # Time
//!
//! The engine belongs to the tick, so [`serve`] is called between two ticks, at most once per tick: a
//! flood of requests waits in the caller's queue and costs the tick no more than one does. A request
//! costs at most one [command](dimsart_core::Engine::command) and one [check](dimsart_core::Engine::check), the latter
//! only while the scheme does not run or when a [`Request::Finding`] asks for it. Instructions, counted on a
//! Cortex-M4F:
//!
//! | Check of | Instructions |
//! |---|---|
//! | the bilateral scheme | 6000 |
//! | 16 modules that match | 11 000 |
//! | each signal that is not simply written once and read after that | up to 3500 more |
//!
//! Most of what asks for neither takes less than 1000. [`Request::SchemeCommand`] takes more: it goes through all
//! parameters of a module. Receiving, decoding and encoding need no engine and
//! belong to a task of lower priority; [`Request`] (16 bytes on a Cortex-M) and [`Response`] (less than
//! 200) are plain values that fit a queue between the two.

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

pub use blocked::{Blocked, FirstFault};
pub use client::{NO_CLIENT, client_of, request_id};
pub use cycles::CyclesReport;
pub use description::{Identity, InstanceText, ModuleText};
pub use device_info::DeviceInfo;
pub use dimsart_core::envelope::MAX_CONTENT_BYTES;
pub use frame::{DecodeError, MAX_FRAME_BYTES, NoRoom};
#[cfg(feature = "auth")]
pub use gate::{Gate, Taken};
pub use heartbeat::{HEARTBEATS_PER_S, Heartbeat, decode_heartbeat, encode_heartbeat};
#[cfg(feature = "auth")]
pub use key::KeyBytes;
pub use key::{KeyAction, KeyRefusal, KeyState};
pub use law::LawAction;
pub use lease::{Lease, LeaseAction, LeaseStatus};
pub use motor::{
    FoundMotor, Identification, IdentificationFailure, MAX_MOTOR_WORDS, MotorAction, MotorFallback,
    MotorRefusal, MotorReport, MotorWords, motor_checksum,
};
pub use receiver::{Counters, Receiver};
pub use refusal::Refusal;
pub use request::{Request, decode_request, encode_request};
pub use response::{
    Effect, MAX_SIGNAL_WORDS, Response, SignalText, Status, TimingReport, decode_response, encode_response,
};
pub use safety::{MAX_REASONS, SafetyReport};
pub use schemes::{Fallback, Origin, SchemeAction, SchemeStatus, StoreError, Trial};
#[cfg(feature = "auth")]
pub use sealed::RequestSealer;
pub use serve::{answer, serve, serve_content};
pub use telemetry::{MAX_TELEMETRY_SIGNALS, MAX_TELEMETRY_WORDS, Sample, decode_sample, encode_sample};

/// Version of requests and responses; see the [module docs](self).
pub const PROTOCOL_VERSION: u16 = 17;

/// Oldest version that a host of this one understands: before it, effects and states had other fields.
pub const OLDEST_PROTOCOL_VERSION: u16 = 17;
/// Bits per second of a serial command line, unless both ends were told otherwise.
pub const DEFAULT_BAUD: u32 = 921_600;
