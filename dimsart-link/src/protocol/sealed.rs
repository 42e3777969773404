//! Sealed requests, the host's side.

use super::frame::{BufferTooSmall, CHANNEL};
use super::request::Request;
use crate::auth::{Key, KeyDomain, Profile, Sealer};
use crate::carrier::stream;
use crate::encode::encode_into;
use dimsart_core::envelope::{Class, HEADER_BYTES, MAX_CONTENT_BYTES, seal};

/// Seals a host's requests for a board.
///
/// Starts with a handshake: send the [`handshake`](Self::handshake) and receive the board's challenge.
#[derive(Debug)]
pub struct RequestSealer {
    sealer: Sealer,
    is_rejected: bool,
}

impl RequestSealer {
    /// Creates a sealer without a session. `seed` as for [`Sealer::new`]: a random number.
    #[must_use]
    pub fn new(key: &Key, seed: u64) -> Self {
        let sealer = Sealer::new(key, KeyDomain::Commands, Profile::Full, CHANNEL, seed);
        Self { sealer, is_rejected: false }
    }

    /// Processes the content of a frame; returns whether it is the board's answer to a
    /// [handshake](Self::handshake).
    pub fn receive(&mut self, content: &[u8]) -> bool {
        let taken = self.sealer.take_covered(content);
        self.is_rejected |= taken.is_err();
        taken == Ok(true)
    }

    /// Returns whether an answer to the last [handshake](Self::handshake) has another key. The answer may be
    /// forged.
    #[must_use]
    pub fn is_rejected(&self) -> bool {
        self.is_rejected
    }

    /// Returns whether a session exists, so that requests can be sealed.
    #[must_use]
    pub fn has_session(&self) -> bool {
        self.sealer.has_session()
    }

    /// Ends the session after a refused request: the board may have restarted.
    pub fn forget(&mut self) {
        self.sealer.forget();
    }

    /// Returns the frame to send before the next request, if any: a hello until the board answers, or a proof
    /// until the board acknowledges one.
    ///
    /// # Errors
    /// [`BufferTooSmall`] if `out` is too small; [`MAX_FRAME_BYTES`](super::MAX_FRAME_BYTES) are enough.
    pub fn handshake<'o>(&mut self, out: &'o mut [u8]) -> Result<Option<&'o [u8]>, BufferTooSmall> {
        if !self.has_session() {
            self.sealer.forget();
        }
        self.is_rejected = false;
        let Some(content) = self.sealer.handshake() else { return Ok(None) };
        stream::encode(content, out).map(Some).ok_or(BufferTooSmall)
    }

    /// Encodes the frame of a sealed request into `out`; `None` before the board's challenge. A frame is
    /// accepted once: seal a request again to resend it.
    ///
    /// # Errors
    /// [`BufferTooSmall`] if `out` is too small; [`MAX_FRAME_BYTES`](super::MAX_FRAME_BYTES) are enough.
    pub fn encode<'o>(
        &mut self,
        request: &Request,
        id: u16,
        out: &'o mut [u8],
    ) -> Result<Option<&'o [u8]>, BufferTooSmall> {
        if !self.has_session() {
            return Ok(None);
        }
        let mut content = [0; MAX_CONTENT_BYTES];
        let room = content.get_mut(HEADER_BYTES..).ok_or(BufferTooSmall)?;
        let length = encode_into(request, room).ok_or(BufferTooSmall)?.len();
        let content = seal(Class::Request, CHANNEL, id, length, &mut content).ok_or(BufferTooSmall)?;
        let mut sealed = [0; MAX_CONTENT_BYTES];
        let sealed = self.sealer.seal(content, &mut sealed).ok_or(BufferTooSmall)?;
        stream::encode(sealed, out).map(Some).ok_or(BufferTooSmall)
    }
}
