//! Takes off tags that are right, once.

use super::handshake::{Handshake, MAX_BYTES};
use super::lockout::Lockout;
use super::tag::{Key, Profile, is_same};
use crate::envelope::{Class, EnvelopeError, TAGGED, close, parse, verify};

/// Time between two challenges, `ms`.
pub const CHALLENGE_MS: u32 = 100;

/// So many contents in a row that are not fresh are no repetitions: more was lost than freshness can tell.
const DOUBTFUL: u8 = 3;

/// Why a content was refused. Nothing has changed for what else comes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum AuthError {
    /// No whole, undamaged content of the channel, or no room for it.
    Envelope(EnvelopeError),
    /// A content without a tag.
    NoTag,
    /// Not newer than what was taken already: a repetition. Its tag was not looked at.
    NotFresh,
    /// A wrong tag: forged, of another key, or of an end that has to find together with this one first.
    Tag,
    /// Too many wrong tags: nothing is looked at for a while.
    LockedOut,
}

impl core::fmt::Display for AuthError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Envelope(_) => "damaged, or of another channel",
            Self::NoTag => "not authenticated: the other side has no key",
            Self::NotFresh => "a repetition of what was sent before",
            Self::Tag => "the tag is wrong: forged, or the two sides have different keys",
            Self::LockedOut => "too many wrong tags: locked out for a second",
        })
    }
}

impl core::error::Error for AuthError {}

/// The receiving end of a channel.
#[derive(Debug)]
pub struct Opener {
    key: Key,
    profile: Profile,
    channel: u16,
    /// What nonces are made of.
    seed: u64,
    challenges: u32,
    session: Option<Session>,
    /// Nonce of a challenge that has not been answered yet.
    pending: Option<u64>,
    challenged_ms: Option<u32>,
    /// Contents that were not fresh since the last one that was taken.
    stale: u8,
    lockout: Lockout,
    handshake: [u8; MAX_BYTES],
}

/// What has been proven.
#[derive(Debug, Clone, Copy)]
struct Session {
    nonce: u64,
    newest: u64,
}

impl Opener {
    /// An opener that has taken nothing yet.
    ///
    /// `seed` must be another one at every start of this end, for as long as the key is in use: a random number, or a
    /// counter that is kept. What was sent to an earlier life with the same seed could be used again.
    #[must_use]
    pub fn new(key: Key, profile: Profile, channel: u16, seed: u64) -> Self {
        let mut opener = Self {
            key,
            profile,
            channel,
            seed,
            challenges: 0,
            session: None,
            pending: None,
            challenged_ms: None,
            stale: 0,
            lockout: Lockout::default(),
            handshake: [0; MAX_BYTES],
        };
        opener.doubt();
        opener
    }

    /// The challenge to be sent now, if there is one. `now_ms` is any clock that wraps at 2^32.
    pub fn challenge(&mut self, now_ms: u32) -> Option<&[u8]> {
        self.challenge_on(self.channel, now_ms)
    }

    /// As [`challenge`](Self::challenge), for a sealer that listens to another channel.
    pub(super) fn challenge_on(&mut self, channel: u16, now_ms: u32) -> Option<&[u8]> {
        let nonce = self.pending?;
        if self.challenged_ms.is_some_and(|last| now_ms.wrapping_sub(last) < CHALLENGE_MS) {
            return None;
        }
        self.challenged_ms = Some(now_ms);
        Handshake::Challenge { nonce }.write(channel, &mut self.handshake)
    }

    /// Whether a challenge is this opener's own.
    pub(super) fn is_own(&self, nonce: u64) -> bool {
        self.pending == Some(nonce) || self.session.is_some_and(|session| session.nonce == nonce)
    }

    pub(super) fn channel(&self) -> u16 {
        self.channel
    }

    /// Listens to a channel. What was proven for another one is worth nothing there.
    pub(super) fn listen(&mut self, channel: u16) {
        if channel != self.channel {
            (self.channel, self.session) = (channel, None);
            self.doubt();
        }
    }

    /// How often wrong tags have led to a [lock-out](super::LOCKOUT_MS).
    #[must_use]
    pub fn lockouts(&self) -> u32 {
        self.lockout.count()
    }

    /// Takes a content; writes the one that was given to the sealer at the other end to `out` and gives it. None for
    /// a handshake.
    ///
    /// # Errors
    /// [`AuthError`]; what is in `out` then is of no use.
    pub fn open<'o>(
        &mut self,
        now_ms: u32,
        content: &[u8],
        out: &'o mut [u8],
    ) -> Result<Option<&'o [u8]>, AuthError> {
        let covered = verify(content, self.channel).map_err(AuthError::Envelope)?;
        let Some(sealed) = self.open_covered(now_ms, covered)? else { return Ok(None) };
        plain(self.channel, sealed, out).map(Some)
    }

    /// As [`open`](Self::open), for a content without the CRC that was right for the channel. What it gives has
    /// neither CRC nor freshness nor tag, and its class is that of a tagged content.
    pub(crate) fn open_covered<'c>(
        &mut self,
        now_ms: u32,
        covered: &'c [u8],
    ) -> Result<Option<&'c [u8]>, AuthError> {
        if covered.first().is_some_and(|class| class & TAGGED == 0) {
            return self.shake_hands(covered).map(|()| None);
        }
        if self.profile == Profile::Short && self.lockout.is_locked(now_ms) {
            return Err(AuthError::LockedOut);
        }
        let sealed = self.check(covered).inspect_err(|error| match error {
            // Every line repeats something now and then.
            AuthError::NotFresh if self.stale < DOUBTFUL => self.stale += 1,
            _ => {
                self.doubt();
                // Without a session no tag was compared, so none was tried.
                let is_compared = *error == AuthError::Tag && self.session.is_some();
                if is_compared && self.profile == Profile::Short {
                    self.lockout.count_wrong(now_ms);
                }
            }
        })?;
        self.stale = 0;
        Ok(Some(sealed))
    }

    /// The content without freshness and tag, if these are right.
    fn check<'c>(&mut self, covered: &'c [u8]) -> Result<&'c [u8], AuthError> {
        let bytes = EnvelopeError::Length { bytes: covered.len() };
        let session = self.session.as_mut().ok_or(AuthError::Tag)?;
        let length = covered.len().checked_sub(self.profile.overhead());
        let (sealed, trailer) =
            length.and_then(|length| covered.split_at_checked(length)).ok_or(AuthError::Envelope(bytes))?;
        let (low, tag) =
            trailer.split_at_checked(self.profile.freshness_bytes()).ok_or(AuthError::Envelope(bytes))?;
        let freshness = self.profile.freshness(low, session.newest).ok_or(AuthError::NotFresh)?;
        let parts: [&[u8]; 4] =
            [&self.channel.to_le_bytes(), &session.nonce.to_le_bytes(), &freshness.to_le_bytes(), sealed];
        let right = self.key.tag(&parts);
        if !is_same(tag, right.get(..tag.len()).unwrap_or_default()) {
            return Err(AuthError::Tag);
        }
        session.newest = freshness;
        Ok(sealed)
    }

    fn shake_hands(&mut self, covered: &[u8]) -> Result<(), AuthError> {
        let found = parse(covered).map_err(AuthError::Envelope)?;
        if found.class != Class::Handshake {
            return Err(AuthError::NoTag);
        }
        match Handshake::read(found.payload) {
            Some(Handshake::Hello) => self.doubt(),
            Some(proof @ Handshake::Proof { .. }) => {
                let Some(nonce) = self.pending else { return Ok(()) };
                let newest = proof.proves(&self.key, self.channel, nonce).ok_or(AuthError::Tag)?;
                self.session = Some(Session { nonce, newest });
                self.pending = None;
            }
            Some(Handshake::Challenge { .. }) | None => {}
        }
        Ok(())
    }

    /// The other end may have started anew, or lost more than freshness can tell.
    fn doubt(&mut self) {
        if self.pending.is_none() {
            self.challenges = self.challenges.wrapping_add(1);
            let parts: [&[u8]; 2] = [&self.seed.to_le_bytes(), &self.challenges.to_le_bytes()];
            self.pending = Some(u64::from_le_bytes(self.key.tag(&parts)));
        }
    }
}

/// The content as it was before it was tagged.
fn plain<'o>(channel: u16, sealed: &[u8], out: &'o mut [u8]) -> Result<&'o [u8], AuthError> {
    let length = sealed.len();
    let no_room = AuthError::Envelope(EnvelopeError::Length { bytes: length });
    out.get_mut(..length).ok_or(no_room)?.copy_from_slice(sealed);
    if let Some(class) = out.first_mut() {
        *class &= !TAGGED;
    }
    close(channel, length, out).ok_or(no_room)
}
