//! Which requests a board takes, by the key that it holds.
//!
//! ```text
//! host ──────hello──────▶ board
//! host ◀───challenge───── board
//! host ──proof, request─▶ board
//! host ◀─taken, response─ board
//! ```
//! A board says nothing of this by itself, and who asks for nothing that [needs the key](Request::needs_key) never hears
//! of it. What is sealed cannot be read off its tag, changed, or used a
//! second time. Whoever can hold up the line can hold a sealed request back and let it go on later, until the board
//! takes another one: time is not part of it.

use super::frame::{CHANNEL, DecodeError, NoRoom};
use super::key::{KeyRefusal, KeyState};
use super::request::{Request, decode_request};
use crate::auth::{AuthError, Key, Line, Opener, Profile};
use crate::carrier::stream;
use dimsart_core::envelope::{Class, HEADER_BYTES, MAX_CONTENT_BYTES, TAGGED};

/// What came in, as far as the gate lets it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Taken {
    /// A request with its id: it may be carried out.
    Request(u16, Request),
    /// A request that may not, with its id and why not.
    Refused(u16, KeyRefusal),
    /// A request that this version does not know, with its id.
    NotUnderstood(u16),
    /// Nothing to be answered but by a [handshake](Gate::handshake), if there is one.
    Nothing,
}

/// Lets in what may be carried out.
#[derive(Debug)]
pub struct Gate {
    state: State,
}

#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "a board has one, and nowhere else to put it")]
enum State {
    Open,
    Damaged,
    Locked(Opener),
}

impl Gate {
    /// Of a board that holds no key.
    #[must_use]
    pub const fn open() -> Self {
        Self { state: State::Open }
    }

    /// Of a board that cannot read what it kept.
    #[must_use]
    pub const fn damaged() -> Self {
        Self { state: State::Damaged }
    }

    /// Of a board that holds a key. `seed` as for [`Opener::new`]; other openers with this key need others.
    #[must_use]
    pub fn locked(key: &Key, seed: u64) -> Self {
        Self { state: State::Locked(Opener::new(key, Line::Commands, Profile::Full, CHANNEL, seed)) }
    }

    /// How the board stands to keys.
    #[must_use]
    pub fn state(&self) -> KeyState {
        match self.state {
            State::Open => KeyState::Open,
            State::Damaged => KeyState::Damaged,
            State::Locked(_) => KeyState::Locked,
        }
    }

    /// Takes the content of a frame.
    pub fn take(&mut self, content: &[u8]) -> Taken {
        let Some((&[class, low, high], _)) = content.split_first_chunk::<HEADER_BYTES>() else {
            return Taken::Nothing;
        };
        if class != SEALED_REQUEST && class != Class::Handshake as u8 {
            return self.admit(content);
        }
        let opened = match &mut self.state {
            State::Locked(opener) => opener.open_covered(content),
            // Who seals believes that there is a key.
            State::Open | State::Damaged => Err(AuthError::Tag),
        };
        match opened {
            Ok(Some(sealed)) => request(sealed),
            Err(_) if class == SEALED_REQUEST => {
                Taken::Refused(u16::from_le_bytes([low, high]), self.refusal())
            }
            Ok(None) | Err(_) => Taken::Nothing,
        }
    }

    /// Whether somebody waits for a [handshake](Self::handshake).
    #[must_use]
    pub fn owes_handshake(&self) -> bool {
        matches!(&self.state, State::Locked(opener) if opener.owes_handshake())
    }

    /// The frame of the handshake that answers what came last, in `out`; none when there is none. To be asked for after
    /// every frame.
    ///
    /// # Errors
    /// [`NoRoom`] when `out` is too small; [`MAX_FRAME_BYTES`](super::MAX_FRAME_BYTES) are enough.
    pub fn handshake<'o>(&mut self, out: &'o mut [u8]) -> Result<Option<&'o [u8]>, NoRoom> {
        let State::Locked(opener) = &mut self.state else { return Ok(None) };
        let Some(handshake) = opener.handshake() else { return Ok(None) };
        stream::encode(handshake, out).map(Some).ok_or(NoRoom)
    }

    /// What is not sealed.
    fn admit(&self, content: &[u8]) -> Taken {
        match decode_request(content) {
            Ok((id, request)) if request.needs_key() && !matches!(self.state, State::Open) => {
                let refusal = match self.state {
                    State::Damaged => KeyRefusal::Damaged,
                    _ => KeyRefusal::Locked,
                };
                Taken::Refused(id, refusal)
            }
            decoded => taken(decoded),
        }
    }

    /// Why nothing that is sealed is taken.
    fn refusal(&self) -> KeyRefusal {
        match self.state {
            State::Damaged => KeyRefusal::Damaged,
            _ => KeyRefusal::NotAccepted,
        }
    }
}

const SEALED_REQUEST: u8 = Class::Request as u8 | TAGGED;

/// The request that was sealed.
fn request(sealed: &[u8]) -> Taken {
    let mut buffer = [0; MAX_CONTENT_BYTES];
    let Some(content) = buffer.get_mut(..sealed.len()) else { return Taken::Nothing };
    content.copy_from_slice(sealed);
    if let Some(class) = content.first_mut() {
        *class &= !TAGGED;
    }
    taken(decode_request(content))
}

fn taken(decoded: Result<(u16, Request), DecodeError>) -> Taken {
    match decoded {
        Ok((id, request)) => Taken::Request(id, request),
        Err(DecodeError::NotUnderstood { id }) => Taken::NotUnderstood(id),
        Err(DecodeError::OtherClass) => Taken::Nothing,
    }
}
