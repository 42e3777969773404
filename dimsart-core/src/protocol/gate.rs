//! Which requests a board takes, by the key that it holds.
//!
//! ```text
//! host ──hello, or what the board does not take──▶ board
//! host ◀──────────────challenge────────────────── board
//! host ──proof, sealed request, sealed request───▶ board
//! ```
//! A challenge is an answer: a board does not challenge by itself, and who asks for nothing that
//! [needs the key](Request::needs_key) never hears of it. What is sealed cannot be read off its tag, changed, or used a
//! second time. Whoever can hold up the line can hold a sealed request back and let it go on later, until the board
//! takes another one: time is not part of it.

use super::frame::{CHANNEL, DecodeError, NoRoom};
use super::key::{KeyRefusal, KeyState};
use super::request::{Request, decode_request};
use crate::auth::{AuthError, Key, Opener, Profile};
use crate::carrier::stream;
use crate::envelope::{Class, HEADER_BYTES, MAX_CONTENT_BYTES, TAGGED};

/// What came in, as far as the gate lets it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Taken {
    /// A request with its id: it may be carried out.
    Request(u16, Request),
    /// A request that may not, with its id and why not.
    Refused(u16, KeyRefusal),
    /// A request that this version does not know, with its id.
    NotUnderstood(u16),
    /// Nothing to be answered but by a [challenge](Gate::challenge), if there is one.
    Nothing,
}

/// Lets in what may be carried out.
#[derive(Debug)]
pub struct Gate {
    state: State,
    is_asked: bool,
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
        Self { state: State::Open, is_asked: false }
    }

    /// Of a board that cannot read what it kept.
    #[must_use]
    pub const fn damaged() -> Self {
        Self { state: State::Damaged, is_asked: false }
    }

    /// Of a board that holds a key. `seed` as for [`Opener::new`]; other openers with this key need others.
    #[must_use]
    pub fn locked(key: Key, seed: u64) -> Self {
        Self { state: State::Locked(Opener::new(key, Profile::Full, CHANNEL, seed)), is_asked: false }
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

    /// Takes the content of a frame. `now_ms` is any clock that wraps at 2^32.
    pub fn take(&mut self, now_ms: u32, content: &[u8]) -> Taken {
        let Some((&[class, low, high], _)) = content.split_first_chunk::<HEADER_BYTES>() else {
            return Taken::Nothing;
        };
        if class != SEALED_REQUEST && class != Class::Handshake as u8 {
            return self.admit(content);
        }
        self.is_asked = true;
        let opened = match &mut self.state {
            State::Locked(opener) => opener.open_covered(now_ms, content),
            // Who seals believes that there is a key.
            State::Open | State::Damaged => Err(AuthError::Tag),
        };
        match opened {
            Ok(Some(sealed)) => {
                self.is_asked = false;
                request(sealed)
            }
            Err(_) if class == SEALED_REQUEST => {
                Taken::Refused(u16::from_le_bytes([low, high]), self.refusal())
            }
            Ok(None) | Err(_) => Taken::Nothing,
        }
    }

    /// Whether somebody waits for a [challenge](Self::challenge).
    #[must_use]
    pub fn is_asked(&self) -> bool {
        self.is_asked && matches!(self.state, State::Locked(_))
    }

    /// The frame of the challenge that was asked for, in `out`; none when none was, or while the last one is not
    /// [`CHALLENGE_MS`](crate::auth::CHALLENGE_MS) old. To be asked for after every frame and every 100 ms or so.
    ///
    /// # Errors
    /// [`NoRoom`] when `out` is too small; [`MAX_FRAME_BYTES`](super::MAX_FRAME_BYTES) are enough.
    pub fn challenge<'o>(&mut self, now_ms: u32, out: &'o mut [u8]) -> Result<Option<&'o [u8]>, NoRoom> {
        let Self { state: State::Locked(opener), is_asked: is_asked @ true } = self else { return Ok(None) };
        let Some(challenge) = opener.challenge(now_ms) else { return Ok(None) };
        *is_asked = false;
        stream::encode(challenge, out).map(Some).ok_or(NoRoom)
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
