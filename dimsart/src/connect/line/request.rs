//! Request ids, and which requests may be repeated.

use std::collections::hash_map::RandomState;
use std::hash::{BuildHasher, Hasher};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU16, Ordering};

use dimsart_core::{Command, Value};
use dimsart_link::protocol::{DecodeError, KeyAction, Request, decode_response, request_id};

/// Draws the first id of a client at random: it differs from ids of other hosts and of earlier programs.
pub(super) fn any_id() -> u16 {
    /// Clients of this program often share a line, so their numbers differ.
    static CLIENTS: OnceLock<AtomicU16> = OnceLock::new();
    let [number, first, ..] = RandomState::new().build_hasher().finish().to_le_bytes();
    let client = CLIENTS.get_or_init(|| u16::from(first).into()).fetch_add(1, Ordering::Relaxed);
    let client = u8::try_from(client % u16::from(u8::MAX)).unwrap_or_default() + 1;
    request_id(client, number & !1)
}

/// Returns whether the id belongs to a lease renewal: these have odd numbers.
pub(super) fn is_renewal(id: u16) -> bool {
    id & 1 == 1
}

/// Returns the id of an answer, decoded or not; `None` for other frames.
pub(super) fn answers(content: &[u8]) -> Option<u16> {
    match decode_response(content) {
        Ok((id, _)) | Err(DecodeError::Unsupported { id }) => Some(id),
        Err(DecodeError::UnexpectedClass) => None,
    }
}

/// Returns whether a request is idempotent.
///
/// A module cannot be plugged in, unplugged or closed twice; a type that is added twice is in the list twice; a device with
/// a key refuses an unauthenticated second one.
pub(super) fn may_repeat(request: &Request) -> bool {
    if let Request::Key(action) = request {
        return *action == KeyAction::Read;
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
