//! Requests: whose they are and what for, by their ids, and which may be sent twice.

use std::collections::hash_map::RandomState;
use std::hash::{BuildHasher, Hasher};

use dimsart_core::protocol::{DecodeError, KeyAction, Request, decode_response, request_id};
use dimsart_core::{Command, Value};

/// A client's first id. From the system's own randomness: not what another host on the line draws, nor an earlier
/// program here.
pub(super) fn any_id() -> u16 {
    let [number, client, ..] = RandomState::new().build_hasher().finish().to_le_bytes();
    request_id(client.max(1), number & !1)
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
