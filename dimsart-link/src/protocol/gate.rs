//! Access control of a board with a key.
//!
//! ```text
//! host ──────hello──────▶ board
//! host ◀───challenge───── board
//! host ──proof, request─▶ board
//! host ◀─taken, response─ board
//! ```
//! The board never starts this exchange, and a host whose requests do not [need the key](Request::needs_key)
//! never sees it. A sealed request cannot be forged, changed or replayed. An attacker who controls the line
//! can delay a sealed request until the board accepts a later one: the seal contains no time.

use super::frame::{BufferTooSmall, CHANNEL, DecodeError};
use super::key::{KeyRefusal, KeyState};
use super::request::{Request, decode_request};
use crate::auth::{AuthError, Key, KeyDomain, Opener, Profile};
use crate::carrier::stream;
use dimsart_core::envelope::{AUTHENTICATED_FLAG, Class, HEADER_BYTES, MAX_CONTENT_BYTES};

/// A received message after the check.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum AccessOutcome {
    /// An accepted request with its id.
    Request(u16, Request),
    /// A refused request with its id and the reason.
    Refused(u16, KeyRefusal),
    /// An unknown request with its id.
    Unsupported(u16),
    /// No response except a [handshake](AccessControl::handshake), if any.
    Nothing,
}

/// Checks requests against the board's key.
#[derive(Debug)]
pub struct AccessControl {
    state: State,
}

#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "a board has one, and nowhere else to put it")]
enum State {
    Open,
    Damaged,
    Locked(Opener),
}

impl AccessControl {
    /// Creates the gate of a board without a key.
    #[must_use]
    pub const fn open() -> Self {
        Self { state: State::Open }
    }

    /// Creates the gate of a board whose stored key is corrupt.
    #[must_use]
    pub const fn damaged() -> Self {
        Self { state: State::Damaged }
    }

    /// Creates the gate of a board with a key. `seed` as for [`Opener::new`]; each opener with this key needs
    /// a different one.
    #[must_use]
    pub fn locked(key: &Key, seed: u64) -> Self {
        Self { state: State::Locked(Opener::new(key, KeyDomain::Commands, Profile::Full, CHANNEL, seed)) }
    }

    /// Returns the state of the key.
    #[must_use]
    pub fn state(&self) -> KeyState {
        match self.state {
            State::Open => KeyState::Open,
            State::Damaged => KeyState::Damaged,
            State::Locked(_) => KeyState::Locked,
        }
    }

    /// Checks the content of a frame.
    pub fn check(&mut self, content: &[u8]) -> AccessOutcome {
        let Some((&[class, low, high], _)) = content.split_first_chunk::<HEADER_BYTES>() else {
            return AccessOutcome::Nothing;
        };
        if class != SEALED_REQUEST && class != Class::Handshake as u8 {
            return self.admit(content);
        }
        let opened = match &mut self.state {
            State::Locked(opener) => opener.open_covered(content),
            // The client has a key, the board has none.
            State::Open | State::Damaged => Err(AuthError::Tag),
        };
        match opened {
            Ok(Some(sealed)) => request(sealed),
            Err(_) if class == SEALED_REQUEST => {
                AccessOutcome::Refused(u16::from_le_bytes([low, high]), self.refusal())
            }
            Ok(None) | Err(_) => AccessOutcome::Nothing,
        }
    }

    /// Returns whether a [handshake](Self::handshake) is pending.
    #[must_use]
    pub fn handshake_is_pending(&self) -> bool {
        matches!(&self.state, State::Locked(opener) if opener.handshake_is_pending())
    }

    /// Writes the frame of the pending handshake to `out`; `None` if there is none. Call after every frame.
    ///
    /// # Errors
    /// [`BufferTooSmall`] if `out` is too small; [`MAX_FRAME_BYTES`](super::MAX_FRAME_BYTES) are enough.
    pub fn handshake<'o>(&mut self, out: &'o mut [u8]) -> Result<Option<&'o [u8]>, BufferTooSmall> {
        let State::Locked(opener) = &mut self.state else { return Ok(None) };
        let Some(handshake) = opener.handshake() else { return Ok(None) };
        stream::encode(handshake, out).map(Some).ok_or(BufferTooSmall)
    }

    /// Checks an unsealed request.
    fn admit(&self, content: &[u8]) -> AccessOutcome {
        match decode_request(content) {
            Ok((id, request)) if request.needs_key() && !matches!(self.state, State::Open) => {
                let refusal = match self.state {
                    State::Damaged => KeyRefusal::Damaged,
                    _ => KeyRefusal::Locked,
                };
                AccessOutcome::Refused(id, refusal)
            }
            decoded => taken(decoded),
        }
    }

    /// Returns why sealed requests are refused.
    fn refusal(&self) -> KeyRefusal {
        match self.state {
            State::Damaged => KeyRefusal::Damaged,
            _ => KeyRefusal::NotAccepted,
        }
    }
}

const SEALED_REQUEST: u8 = Class::Request as u8 | AUTHENTICATED_FLAG;

/// Decodes a sealed request.
fn request(sealed: &[u8]) -> AccessOutcome {
    let mut buffer = [0; MAX_CONTENT_BYTES];
    let Some(content) = buffer.get_mut(..sealed.len()) else { return AccessOutcome::Nothing };
    content.copy_from_slice(sealed);
    if let Some(class) = content.first_mut() {
        *class &= !AUTHENTICATED_FLAG;
    }
    taken(decode_request(content))
}

fn taken(decoded: Result<(u16, Request), DecodeError>) -> AccessOutcome {
    match decoded {
        Ok((id, request)) => AccessOutcome::Request(id, request),
        Err(DecodeError::Unsupported { id }) => AccessOutcome::Unsupported(id),
        Err(DecodeError::UnexpectedClass) => AccessOutcome::Nothing,
    }
}
