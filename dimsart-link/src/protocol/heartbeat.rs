//! The heartbeat that a device sends ten times per second.

use serde::{Deserialize, Serialize};

use super::blocked::{FirstFault, NotCommandedReason};
use super::frame::{BufferTooSmall, DecodeError, decode, encode};
use super::lease::LeaseStatus;
use dimsart_core::envelope::Class;

/// Heartbeats per second.
pub const HEARTBEATS_PER_S: u32 = 10;

/// State of a device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Heartbeat {
    /// Ticks since the start.
    pub ticks: u64,
    /// Why the scheme did not command the device in the last tick; `None` if it did. For a stopped scheme
    /// always `TickResult::Idle`: [`Status`](super::Status) has the reason.
    pub blocked: Option<NotCommandedReason>,
    /// The first tick that was refused, or in which a link was lost.
    pub first_fault: Option<FirstFault>,
    /// The client that may move the device.
    pub lease: LeaseStatus,
    /// Messages dropped due to full queues: responses, packets in both directions, samples.
    pub dropped: u32,
    /// Frames of this line that were rejected: corrupt, cut off or too long.
    pub damaged: u32,
    /// Number of the last [event](crate::Event); 0 before the first one.
    pub events: u32,
}

/// Encodes the frame of a heartbeat into `out`; `counter` counts heartbeats.
///
/// # Errors
/// [`BufferTooSmall`] if `out` is too small; [`MAX_FRAME_BYTES`](super::MAX_FRAME_BYTES) are enough.
pub fn encode_heartbeat<'o>(
    heartbeat: &Heartbeat,
    counter: u16,
    out: &'o mut [u8],
) -> Result<&'o [u8], BufferTooSmall> {
    let length = encode(Class::Heartbeat, counter, heartbeat, out).map_err(|_| BufferTooSmall)?;
    out.get(..length).ok_or(BufferTooSmall)
}

/// Decodes counter and heartbeat from a frame's content.
///
/// # Errors
/// [`DecodeError`] if it is another message or of an unknown version.
pub fn decode_heartbeat(content: &[u8]) -> Result<(u16, Heartbeat), DecodeError> {
    decode(Class::Heartbeat, content)
}
