//! Requests: whose they are and what for, by their ids, and which may be sent twice.

use std::collections::hash_map::RandomState;
use std::hash::{BuildHasher, Hasher};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU16, Ordering};

use dimsart_core::{Command, Value};
use dimsart_link::protocol::{DecodeError, KeyAction, Request, decode_response, request_id};

/// A client's first id. From the system's own randomness: not what another host on the line draws, nor an earlier
/// program here.
pub(super) fn any_id() -> u16 {
    /// Clients of this program have different numbers: they share lines more often than others do.
    static CLIENTS: OnceLock<AtomicU16> = OnceLock::new();
    let [number, first, ..] = RandomState::new().build_hasher().finish().to_le_bytes();
    let client = CLIENTS.get_or_init(|| u16::from(first).into()).fetch_add(1, Ordering::Relaxed);
    let client = u8::try_from(client % u16::from(u8::MAX)).unwrap_or_default() + 1;
    request_id(client, number & !1)
}

/// Whether a request of this id was a renewal of the lease: they have odd numbers.
pub(super) fn is_renewal(id: u16) -> bool {
    id & 1 == 1
}

/// The id of an answer, understood or not; none for other frames.
pub(super) fn answers(content: &[u8]) -> Option<u16> {
    match decode_response(content) {
        Ok((id, _)) | Err(DecodeError::NotUnderstood { id }) => Some(id),
        Err(DecodeError::OtherClass) => None,
    }
}

/// Whether a request given twice comes to the same as given once.
///
/// A module cannot be plugged in, out or closed twice, and a type that is added twice is in the list
/// twice. A device that has been given a key takes no other one unsealed.
pub(super) fn may_repeat(request: &Request) -> bool {
    if let Request::Key(action) = request {
        return *action == KeyAction::Look;
    }
    let Request::Command(command) = request else { return true };
    !matches!(
        command,
        Command::PlugIn(_)
            | Command::Unplug(_)
            | Command::CloseModule(_)
            | Command::Set { value: Value::Type(_), .. }
    )
}
