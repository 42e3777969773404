//! One side of a link between two that have the same key.

use super::handshake::Handshake;
use super::opener::{AuthError, CHALLENGE_MS, Opener};
use super::sealer::Sealer;
use super::tag::{Key, Profile};

/// Seals what leaves and opens what comes.
///
/// A challenge of its own that comes back is not answered: what it sealed with that nonce could be sent back too.
#[derive(Debug)]
pub struct Guard {
    sealer: Sealer,
    opener: Opener,
    hello_ms: Option<u32>,
}

impl Guard {
    /// A guard that the other side does not know yet, for what it sends and what it listens to on channel 0.
    ///
    /// `seed` as for [`Opener::new`]; the two sides need different ones.
    #[must_use]
    pub fn new(key: &Key, profile: Profile, seed: u64) -> Self {
        Self {
            sealer: Sealer::new(key.clone(), profile, 0),
            opener: Opener::new(key.clone(), profile, 0, seed),
            hello_ms: None,
        }
    }

    /// The channel that is listened to from now on. On another one than before both sides find together anew.
    pub fn listen(&mut self, channel: u16) {
        self.opener.listen(channel);
    }

    /// The channel that is sent on from now on. On another one than before both sides find together anew.
    pub fn send_on(&mut self, channel: u16) {
        self.sealer.send_on(channel);
    }

    /// The next handshake to be sent now, on the channel that is sent on; none when there is no more. To be asked
    /// for, until there is none, before every content and every [`CHALLENGE_MS`]. `now_ms` is any clock that wraps at
    /// 2^32.
    pub fn handshake(&mut self, now_ms: u32) -> Option<&[u8]> {
        let Self { sealer, opener, hello_ms } = self;
        if let Some(challenge) = opener.challenge_on(sealer.channel(), now_ms) {
            return Some(challenge);
        }
        if !sealer.has_nonce() {
            if hello_ms.is_some_and(|last| now_ms.wrapping_sub(last) < CHALLENGE_MS) {
                return None;
            }
            *hello_ms = Some(now_ms);
        }
        sealer.handshake()
    }

    /// Takes a content that came in; gives the one that was given to the guard on the other side, in `out`. None for
    /// a handshake.
    ///
    /// # Errors
    /// [`AuthError`]; what is in `out` then is of no use.
    pub fn take<'o>(
        &mut self,
        now_ms: u32,
        content: &[u8],
        out: &'o mut [u8],
    ) -> Result<Option<&'o [u8]>, AuthError> {
        match Handshake::open(content, self.opener.channel()) {
            Some(Handshake::Challenge { nonce }) if self.opener.is_own(nonce) => Ok(None),
            Some(Handshake::Challenge { nonce }) => {
                self.sealer.answer(nonce);
                Ok(None)
            }
            _ => self.opener.open(now_ms, content, out),
        }
    }

    /// The content with freshness and tag, in `out`. None as for [`Sealer::seal`].
    pub fn seal<'o>(&mut self, content: &[u8], out: &'o mut [u8]) -> Option<&'o [u8]> {
        self.sealer.seal(content, out)
    }

    /// Whether the other side has said which nonce it takes, so that contents can be sealed.
    #[must_use]
    pub fn is_answered(&self) -> bool {
        self.sealer.has_nonce()
    }

    /// How often wrong tags have led to a [lock-out](super::LOCKOUT_MS).
    #[must_use]
    pub fn lockouts(&self) -> u32 {
        self.opener.lockouts()
    }
}
