//! What a device says by itself, ten times per second, whether it is asked or not.

use serde::{Deserialize, Serialize};

use super::blocked::{Blocked, FirstFault};
use super::frame::{DecodeError, NoRoom, decode, encode};
use super::lease::LeaseStatus;
use dimsart_core::envelope::Class;

/// How often a device's heart beats.
pub const HEARTBEATS_PER_S: u32 = 10;

/// How a device is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Heartbeat {
    /// Ticks since the start.
    pub ticks: u64,
    /// Why the scheme did not command the device in the last tick; none when it did. Without a check:
    /// `Tick::Idle` for every scheme that does not run, [`Status`](super::Status) says why.
    pub blocked: Option<Blocked>,
    /// The first tick that was refused, or in which a link was lost.
    pub first_fault: Option<FirstFault>,
    /// Who may move the device.
    pub lease: LeaseStatus,
    /// What was dropped because nobody took it in time: answers, packets in and out, samples.
    pub dropped: u32,
    /// What came over this line and was refused: damaged, cut, or too long.
    pub damaged: u32,
    /// Number of the last [event](crate::Event); 0 before the first one.
    pub events: u32,
}

/// Writes the frame of a heartbeat to the start of `out` and gives it; `counter` counts them.
///
/// # Errors
/// [`NoRoom`] when `out` is too small; [`MAX_FRAME_BYTES`](super::MAX_FRAME_BYTES) are enough.
pub fn encode_heartbeat<'o>(
    heartbeat: &Heartbeat,
    counter: u16,
    out: &'o mut [u8],
) -> Result<&'o [u8], NoRoom> {
    let length = encode(Class::Heartbeat, counter, heartbeat, out).map_err(|_| NoRoom)?;
    out.get(..length).ok_or(NoRoom)
}

/// Reads counter and heartbeat out of a frame's content.
///
/// # Errors
/// [`DecodeError`] when it is none, or one that this version does not know.
pub fn decode_heartbeat(content: &[u8]) -> Result<(u16, Heartbeat), DecodeError> {
    decode(Class::Heartbeat, content)
}
