//! Requests with a tag that only who has the board's key can make: the host's end.

use super::frame::{CHANNEL, NoRoom};
use super::request::Request;
use crate::auth::{Key, Line, Profile, Sealer};
use crate::carrier::stream;
use crate::encode::encode_into;
use dimsart_core::envelope::{Class, HEADER_BYTES, MAX_CONTENT_BYTES, seal};

/// Seals a host's requests for a board.
///
/// Before the first request both find together: a [`handshake`](Self::handshake) goes out, and the board's challenge
/// comes back.
#[derive(Debug)]
pub struct RequestSealer {
    sealer: Sealer,
    is_contradicted: bool,
}

impl RequestSealer {
    /// One that no board knows yet. `seed` as for [`Sealer::new`]: a random number.
    #[must_use]
    pub fn new(key: &Key, seed: u64) -> Self {
        let sealer = Sealer::new(key, Line::Commands, Profile::Full, CHANNEL, seed);
        Self { sealer, is_contradicted: false }
    }

    /// Takes the content of a frame; gives whether it was the board's answer to a [handshake](Self::handshake).
    pub fn take(&mut self, content: &[u8]) -> bool {
        let taken = self.sealer.take_covered(content);
        self.is_contradicted |= taken.is_err();
        taken == Ok(true)
    }

    /// Whether an answer to the last [handshake](Self::handshake) came from who has another key. It may be somebody
    /// else's than the board's.
    #[must_use]
    pub fn is_contradicted(&self) -> bool {
        self.is_contradicted
    }

    /// Whether the board has answered, so that requests can be sealed.
    #[must_use]
    pub fn is_answered(&self) -> bool {
        self.sealer.is_answered()
    }

    /// Finds together anew: the board did not take what was sealed, it may have been restarted.
    pub fn forget(&mut self) {
        self.sealer.forget();
    }

    /// The frame that is to be sent before the next request, if there is one: a hello for as long as the board has
    /// not answered, or a proof for as long as it has not said that it took one.
    ///
    /// # Errors
    /// [`NoRoom`] when `out` is too small; [`MAX_FRAME_BYTES`](super::MAX_FRAME_BYTES) are enough.
    pub fn handshake<'o>(&mut self, out: &'o mut [u8]) -> Result<Option<&'o [u8]>, NoRoom> {
        if !self.is_answered() {
            self.sealer.forget();
        }
        self.is_contradicted = false;
        let Some(content) = self.sealer.handshake() else { return Ok(None) };
        stream::encode(content, out).map(Some).ok_or(NoRoom)
    }

    /// Writes the frame of a sealed request to the start of `out` and gives it; none before the board's challenge. A
    /// frame is taken once: a request that is sent again is sealed again.
    ///
    /// # Errors
    /// [`NoRoom`] when `out` is too small; [`MAX_FRAME_BYTES`](super::MAX_FRAME_BYTES) are enough.
    pub fn encode<'o>(
        &mut self,
        request: &Request,
        id: u16,
        out: &'o mut [u8],
    ) -> Result<Option<&'o [u8]>, NoRoom> {
        if !self.is_answered() {
            return Ok(None);
        }
        let mut content = [0; MAX_CONTENT_BYTES];
        let room = content.get_mut(HEADER_BYTES..).ok_or(NoRoom)?;
        let length = encode_into(request, room).ok_or(NoRoom)?.len();
        let content = seal(Class::Request, CHANNEL, id, length, &mut content).ok_or(NoRoom)?;
        let mut sealed = [0; MAX_CONTENT_BYTES];
        let sealed = self.sealer.seal(content, &mut sealed).ok_or(NoRoom)?;
        stream::encode(sealed, out).map(Some).ok_or(NoRoom)
    }
}
