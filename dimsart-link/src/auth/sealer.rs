//! Adds tags to messages.

use super::handshake::{Handshake, MAX_BYTES};
use super::keys::{LineKeys, Nonces, Statement};
use super::line::KeyDomain;
use super::opener::AuthError;
use super::tag::{ContentKey, Key, Profile, TAG_BYTES, is_same};
use dimsart_core::envelope::{AUTHENTICATED_FLAG, CRC_BYTES, append_crc};

/// The sending end of a channel.
#[derive(Debug)]
pub struct Sealer {
    keys: LineKeys,
    profile: Profile,
    channel: u16,
    /// Seed of the nonces.
    seed: u64,
    hellos: u32,
    /// Nonce of the next session.
    nonce: u64,
    session: Option<Session>,
    owes_hello: bool,
    owes_proof: bool,
    handshake: [u8; MAX_BYTES],
}

/// A session that an opener requested.
#[derive(Debug)]
struct Session {
    key: ContentKey,
    nonces: Nonces,
    freshness: u64,
    /// Whether the opener acknowledged the session.
    is_taken: bool,
}

impl Sealer {
    /// Creates a sealer without a session.
    ///
    /// `seed` must differ at every start of this end while the key is in use: a random number, or a stored
    /// counter. With a repeated seed, a challenge to an earlier start could be replayed.
    #[must_use]
    pub fn new(key: &Key, line: KeyDomain, profile: Profile, channel: u16, seed: u64) -> Self {
        let keys = LineKeys::new(key, line);
        let nonce = keys.sealer_nonce(seed, 0);
        let handshake = [0; MAX_BYTES];
        let (session, owes_hello, owes_proof) = (None, true, false);
        Self { keys, profile, channel, seed, hellos: 0, nonce, session, owes_hello, owes_proof, handshake }
    }

    /// Returns the handshake to send before the next message, if any: a hello for each message that could not
    /// be sealed, or a proof until the opener acknowledges one. Call before every [`seal`](Self::seal) and
    /// after every [`receive`](Self::receive).
    pub fn handshake(&mut self) -> Option<&[u8]> {
        if self.owes_proof { self.proof() } else { self.hello() }
    }

    pub(super) fn hello(&mut self) -> Option<&[u8]> {
        let is_owed = core::mem::take(&mut self.owes_hello);
        let hello = is_owed.then_some(Handshake::Hello { sealer: self.nonce })?;
        hello.write(self.channel, &mut self.handshake)
    }

    pub(super) fn proof(&mut self) -> Option<&[u8]> {
        let session = self.session.as_ref().filter(|_| core::mem::take(&mut self.owes_proof))?;
        let tag = self.keys.tag(Statement::Proof, self.channel, session.nonces);
        Handshake::Proof { sealer: session.nonces.sealer, tag }.write(self.channel, &mut self.handshake)
    }

    /// Processes a message from the opener; returns whether it is an authentic answer to this sealer's
    /// handshake.
    pub fn receive(&mut self, content: &[u8]) -> bool {
        let said = Handshake::open(content, self.channel);
        said.is_some_and(|said| self.hear(said) == Ok(true))
    }

    /// Like [`receive`](Self::receive), for a content without its (valid) CRC.
    ///
    /// # Errors
    /// [`AuthError::Tag`] for an answer with another key.
    pub(crate) fn take_covered(&mut self, covered: &[u8]) -> Result<bool, AuthError> {
        Handshake::of_covered(covered).map_or(Ok(false), |said| self.hear(said))
    }

    /// Processes an opener's message; returns whether it is an answer.
    pub(super) fn hear(&mut self, handshake: Handshake) -> Result<bool, AuthError> {
        match handshake {
            Handshake::Challenge { opener, tag } => self.answer(opener, tag)?,
            Handshake::SessionAccepted { tag } => {
                let session = self.session.as_mut().ok_or(AuthError::Tag)?;
                if !session.is_taken {
                    let right = self.keys.tag(Statement::SessionAccepted, self.channel, session.nonces);
                    session.is_taken = is_same(&tag, &right).then_some(true).ok_or(AuthError::Tag)?;
                    self.owes_proof = false;
                }
            }
            _ => {
                // Unauthenticated: answered without changing state.
                self.owes_hello |= handshake == Handshake::HelloRequest;
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Starts the session of a challenge, if it answers this sealer's hello.
    fn answer(&mut self, opener: u64, tag: [u8; TAG_BYTES]) -> Result<(), AuthError> {
        if self.session.as_ref().is_some_and(|session| session.nonces.opener == opener) {
            // A repeated challenge with the same nonces.
            return Ok(());
        }
        let nonces = Nonces { sealer: self.nonce, opener };
        if !is_same(&tag, &self.keys.tag(Statement::Challenge, self.channel, nonces)) {
            return Err(AuthError::Tag);
        }
        let key = self.keys.contents(self.channel, nonces);
        self.session = Some(Session { key, nonces, freshness: 0, is_taken: false });
        (self.owes_hello, self.owes_proof) = (false, true);
        self.hellos = self.hellos.wrapping_add(1);
        self.nonce = self.keys.sealer_nonce(self.seed, self.hellos);
        Ok(())
    }

    /// Ends the session; starts again with a hello.
    pub(crate) fn forget(&mut self) {
        (self.session, self.owes_hello, self.owes_proof) = (None, true, false);
    }

    /// Returns whether this sealer uses a nonce in its hellos or proofs.
    pub(super) fn is_own(&self, nonce: u64) -> bool {
        self.nonce == nonce || self.session.as_ref().is_some_and(|session| session.nonces.sealer == nonce)
    }

    pub(super) fn owes_hello(&self) -> bool {
        self.owes_hello
    }

    pub(super) fn owes_proof(&self) -> bool {
        self.owes_proof
    }

    pub(crate) fn has_session(&self) -> bool {
        self.session.is_some()
    }

    pub(super) fn channel(&self) -> u16 {
        self.channel
    }

    /// Sets the channel to send on. A change ends the session.
    pub(super) fn send_on(&mut self, channel: u16) {
        if channel != self.channel {
            self.channel = channel;
            self.forget();
        }
    }

    /// Seals a message into `out` and returns it. `None` without a session, for an invalid content, or if the
    /// result does not fit `out` or an envelope; it is [`Profile::overhead`] longer.
    pub fn seal<'o>(&mut self, content: &[u8], out: &'o mut [u8]) -> Option<&'o [u8]> {
        let Some(session) = &mut self.session else {
            self.owes_hello = true;
            return None;
        };
        self.owes_proof = !session.is_taken;
        let length = content.len().checked_sub(CRC_BYTES)?;
        let (covered, rest) = out.split_at_mut_checked(length)?;
        covered.copy_from_slice(content.get(..length)?);
        *covered.first_mut()? |= AUTHENTICATED_FLAG;

        let freshness = session.freshness.checked_add(1)?;
        let tag = session.key.tag(self.channel, freshness, covered);
        let (place, rest) = rest.split_at_mut_checked(self.profile.freshness_bytes())?;
        place.copy_from_slice(freshness.to_le_bytes().get(..place.len())?);
        let place = rest.get_mut(..self.profile.tag_bytes())?;
        place.copy_from_slice(tag.get(..place.len())?);

        session.freshness = freshness;
        append_crc(self.channel, length + self.profile.overhead(), out)
    }
}
