//! Verifies and removes tags; accepts each message once.

use super::handshake::{Handshake, MAX_BYTES};
use super::keys::{LineKeys, Nonces, Statement};
use super::line::KeyDomain;
use super::tag::{ContentKey, Key, Profile, is_same};
use dimsart_core::envelope::{AUTHENTICATED_FLAG, Class, EnvelopeError, append_crc, parse, verify};

/// Reasons why a message was rejected. The session is unchanged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum AuthError {
    /// Incomplete, corrupt or for another channel, or `out` is too small.
    Envelope(EnvelopeError),
    /// The message has no tag.
    NoTag,
    /// Not newer than the last accepted message: a replay. The tag was not checked.
    Replay,
    /// Invalid tag: forged, sealed with another key, or without a session with this end.
    Tag,
}

impl core::fmt::Display for AuthError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Envelope(_) => "message corrupt, or for another channel",
            Self::NoTag => "message not authenticated: the peer has no key",
            Self::Replay => "replay of an earlier message",
            Self::Tag => "invalid tag: message forged, or the two sides have different keys",
        })
    }
}

impl core::error::Error for AuthError {}

/// The receiving end of a channel.
#[derive(Debug)]
pub struct Opener {
    keys: LineKeys,
    profile: Profile,
    channel: u16,
    /// Seed of the nonces.
    seed: u64,
    challenges: u32,
    /// Nonce of the next session.
    nonce: u64,
    session: Option<Session>,
    /// Nonce of a sealer whose hello is not answered yet.
    greeted_by: Option<u64>,
    /// Whether an accepted proof is not acknowledged yet.
    owes_taken: bool,
    handshake: [u8; MAX_BYTES],
}

/// An accepted session.
#[derive(Debug)]
struct Session {
    key: ContentKey,
    nonces: Nonces,
    newest: u64,
}

impl Opener {
    /// Creates an opener without a session.
    ///
    /// `seed` must differ at every start of this end while the key is in use: a random number, or a stored
    /// counter. With a repeated seed, messages from an earlier start could be replayed.
    #[must_use]
    pub fn new(key: &Key, line: KeyDomain, profile: Profile, channel: u16, seed: u64) -> Self {
        let keys = LineKeys::new(key, line);
        let nonce = keys.opener_nonce(seed, 0);
        let (session, greeted_by, owes_taken) = (None, None, false);
        let (challenges, handshake) = (0, [0; MAX_BYTES]);
        Self { keys, profile, channel, seed, challenges, nonce, session, greeted_by, owes_taken, handshake }
    }

    /// Returns the handshake to send back now, if any. Call after every [`open`](Self::open).
    pub fn handshake(&mut self) -> Option<&[u8]> {
        if self.owes_challenge() { self.challenge_on(self.channel) } else { self.taken_on(self.channel) }
    }

    /// Returns the answer to a hello, for a sealer that receives on `channel`.
    pub(super) fn challenge_on(&mut self, channel: u16) -> Option<&[u8]> {
        let nonces = Nonces { sealer: self.greeted_by.take()?, opener: self.nonce };
        let tag = self.keys.tag(Statement::Challenge, self.channel, nonces);
        Handshake::Challenge { opener: self.nonce, tag }.write(channel, &mut self.handshake)
    }

    /// Returns the answer to a proof.
    pub(super) fn taken_on(&mut self, channel: u16) -> Option<&[u8]> {
        let session = self.session.as_ref().filter(|_| core::mem::take(&mut self.owes_taken))?;
        let tag = self.keys.tag(Statement::SessionAccepted, self.channel, session.nonces);
        Handshake::SessionAccepted { tag }.write(channel, &mut self.handshake)
    }

    /// Requests a hello from the sealer that receives on `channel`.
    pub(super) fn question_on(&mut self, channel: u16) -> Option<&[u8]> {
        Handshake::HelloRequest.write(channel, &mut self.handshake)
    }

    pub(super) fn owes_challenge(&self) -> bool {
        self.greeted_by.is_some()
    }

    pub(super) fn owes_taken(&self) -> bool {
        self.owes_taken
    }

    pub(crate) fn handshake_is_pending(&self) -> bool {
        self.owes_challenge() || self.owes_taken
    }

    pub(super) fn channel(&self) -> u16 {
        self.channel
    }

    /// Sets the channel to receive on. A change ends the session.
    pub(super) fn listen(&mut self, channel: u16) {
        if channel != self.channel {
            (self.channel, self.session, self.greeted_by, self.owes_taken) = (channel, None, None, false);
        }
    }

    /// Opens a message into `out` and returns it; `None` for a handshake.
    ///
    /// # Errors
    /// [`AuthError`]; `out` is then invalid.
    pub fn open<'o>(&mut self, content: &[u8], out: &'o mut [u8]) -> Result<Option<&'o [u8]>, AuthError> {
        let covered = verify(content, self.channel).map_err(AuthError::Envelope)?;
        let Some(sealed) = self.open_covered(covered)? else { return Ok(None) };
        plain(self.channel, sealed, out).map(Some)
    }

    /// Like [`open`](Self::open), for a content without its (valid) CRC. The result has no CRC, freshness or
    /// tag, but keeps the class of a tagged content.
    pub(crate) fn open_covered<'c>(&mut self, covered: &'c [u8]) -> Result<Option<&'c [u8]>, AuthError> {
        match handshake(covered)? {
            None => self.check(covered).map(Some),
            Some(handshake) => self.hear(handshake).map(|_| None),
        }
    }

    /// Checks freshness and tag, and removes them.
    pub(super) fn check<'c>(&mut self, covered: &'c [u8]) -> Result<&'c [u8], AuthError> {
        let bytes = EnvelopeError::Length { bytes: covered.len() };
        let session = self.session.as_mut().ok_or(AuthError::Tag)?;
        let length = covered.len().checked_sub(self.profile.overhead());
        let (sealed, trailer) =
            length.and_then(|length| covered.split_at_checked(length)).ok_or(AuthError::Envelope(bytes))?;
        let (low, tag) =
            trailer.split_at_checked(self.profile.freshness_bytes()).ok_or(AuthError::Envelope(bytes))?;
        let freshness = self.profile.freshness(low, session.newest).ok_or(AuthError::Replay)?;
        let right = session.key.tag(self.channel, freshness, sealed);
        if !is_same(tag, right.get(..tag.len()).unwrap_or_default()) {
            return Err(AuthError::Tag);
        }
        session.newest = freshness;
        Ok(sealed)
    }

    /// Processes a sealer's message; returns whether it starts a session.
    pub(super) fn hear(&mut self, handshake: Handshake) -> Result<bool, AuthError> {
        let known = self.session.as_ref().map(|session| session.nonces.sealer);
        match handshake {
            // A delayed hello of the current session is ignored.
            Handshake::Hello { sealer } if known != Some(sealer) => self.greeted_by = Some(sealer),
            // The acknowledgement was lost.
            Handshake::Proof { sealer, .. } if known == Some(sealer) => self.owes_taken = true,
            Handshake::Proof { sealer, tag } => {
                let nonces = Nonces { sealer, opener: self.nonce };
                if !is_same(&tag, &self.keys.tag(Statement::Proof, self.channel, nonces)) {
                    return Err(AuthError::Tag);
                }
                let key = self.keys.contents(self.channel, nonces);
                self.session = Some(Session { key, nonces, newest: 0 });
                self.owes_taken = true;
                self.challenges = self.challenges.wrapping_add(1);
                self.nonce = self.keys.opener_nonce(self.seed, self.challenges);
                return Ok(true);
            }
            _ => {}
        }
        Ok(false)
    }
}

/// Decodes the handshake in a content, if it is one; `None` for a tagged content.
pub(super) fn handshake(covered: &[u8]) -> Result<Option<Handshake>, AuthError> {
    if covered.first().is_none_or(|class| class & AUTHENTICATED_FLAG != 0) {
        return Ok(None);
    }
    let found = parse(covered).map_err(AuthError::Envelope)?;
    if found.class != Class::Handshake {
        return Err(AuthError::NoTag);
    }
    Ok(Some(Handshake::read(found.payload)))
}

/// Restores the content without the tag.
pub(super) fn plain<'o>(channel: u16, sealed: &[u8], out: &'o mut [u8]) -> Result<&'o [u8], AuthError> {
    let length = sealed.len();
    let no_room = AuthError::Envelope(EnvelopeError::Length { bytes: length });
    out.get_mut(..length).ok_or(no_room)?.copy_from_slice(sealed);
    if let Some(class) = out.first_mut() {
        *class &= !AUTHENTICATED_FLAG;
    }
    append_crc(channel, length, out).ok_or(no_room)
}
