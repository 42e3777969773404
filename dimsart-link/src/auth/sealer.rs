//! Puts tags on contents.

use super::handshake::{Handshake, MAX_BYTES};
use super::keys::{LineKeys, Nonces, Statement};
use super::line::Line;
use super::opener::AuthError;
use super::tag::{ContentKey, Key, Profile, TAG_BYTES, is_same};
use dimsart_core::envelope::{CRC_BYTES, TAGGED, close};

/// The sending end of a channel.
#[derive(Debug)]
pub struct Sealer {
    keys: LineKeys,
    profile: Profile,
    channel: u16,
    /// What nonces are made of.
    seed: u64,
    hellos: u32,
    /// Of the next association.
    nonce: u64,
    session: Option<Session>,
    owes_hello: bool,
    owes_proof: bool,
    handshake: [u8; MAX_BYTES],
}

/// An association that an opener has asked for, and no one else.
#[derive(Debug)]
struct Session {
    key: ContentKey,
    nonces: Nonces,
    freshness: u64,
    /// Whether the opener has said that it takes what is sealed so.
    is_taken: bool,
}

impl Sealer {
    /// A sealer that the opener at the other end does not know yet.
    ///
    /// `seed` must be another one at every start of this end, for as long as the key is in use: a random number, or a
    /// counter that is kept. A challenge to an earlier life with the same seed could be given to this one.
    #[must_use]
    pub fn new(key: &Key, line: Line, profile: Profile, channel: u16, seed: u64) -> Self {
        let keys = LineKeys::new(key, line);
        let nonce = keys.sealer_nonce(seed, 0);
        let handshake = [0; MAX_BYTES];
        let (session, owes_hello, owes_proof) = (None, true, false);
        Self { keys, profile, channel, seed, hellos: 0, nonce, session, owes_hello, owes_proof, handshake }
    }

    /// The handshake to be sent now, before anything else, if there is one: a hello, in place of each content that
    /// could not be sealed; a proof, before each one until the opener has said that it took one. To be asked for
    /// before every [`seal`](Self::seal) and after every [`take`](Self::take).
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

    /// Takes a content that came back from the opener's end; gives whether it was an answer to what this sealer has
    /// said, from who has the key.
    pub fn take(&mut self, content: &[u8]) -> bool {
        let said = Handshake::open(content, self.channel);
        said.is_some_and(|said| self.hear(said) == Ok(true))
    }

    /// As [`take`](Self::take), for a content without the CRC that was right for the channel.
    ///
    /// # Errors
    /// [`AuthError::Tag`] for an answer from who has another key.
    pub(crate) fn take_covered(&mut self, covered: &[u8]) -> Result<bool, AuthError> {
        Handshake::of_covered(covered).map_or(Ok(false), |said| self.hear(said))
    }

    /// Hears what an opener says; gives whether it was an answer.
    pub(super) fn hear(&mut self, handshake: Handshake) -> Result<bool, AuthError> {
        match handshake {
            Handshake::Challenge { opener, tag } => self.answer(opener, tag)?,
            Handshake::Taken { tag } => {
                let session = self.session.as_mut().ok_or(AuthError::Tag)?;
                if !session.is_taken {
                    let right = self.keys.tag(Statement::Taken, self.channel, session.nonces);
                    session.is_taken = is_same(&tag, &right).then_some(true).ok_or(AuthError::Tag)?;
                    self.owes_proof = false;
                }
            }
            _ => {
                // Anybody's: it is answered and changes nothing.
                self.owes_hello |= handshake == Handshake::Question;
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Seals for the association of a challenge from now on, if it answers this sealer's hello.
    fn answer(&mut self, opener: u64, tag: [u8; TAG_BYTES]) -> Result<(), AuthError> {
        if self.session.as_ref().is_some_and(|session| session.nonces.opener == opener) {
            // It has answered an earlier hello with the same nonces, too.
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

    /// Says hello, as in the beginning.
    pub(crate) fn forget(&mut self) {
        (self.session, self.owes_hello, self.owes_proof) = (None, true, false);
    }

    /// Whether a nonce is in this sealer's hellos or proofs.
    pub(super) fn is_own(&self, nonce: u64) -> bool {
        self.nonce == nonce || self.session.as_ref().is_some_and(|session| session.nonces.sealer == nonce)
    }

    pub(super) fn owes_hello(&self) -> bool {
        self.owes_hello
    }

    pub(super) fn owes_proof(&self) -> bool {
        self.owes_proof
    }

    pub(crate) fn is_answered(&self) -> bool {
        self.session.is_some()
    }

    pub(super) fn channel(&self) -> u16 {
        self.channel
    }

    /// Seals for a channel. Who listens to it has not challenged this sealer yet.
    pub(super) fn send_on(&mut self, channel: u16) {
        if channel != self.channel {
            self.channel = channel;
            self.forget();
        }
    }

    /// Writes the content with freshness and tag to the start of `out`, and gives it. None before the first
    /// challenge, for a content that is none, and when it does not fit `out` or an envelope: it is
    /// [`Profile::overhead`] longer.
    pub fn seal<'o>(&mut self, content: &[u8], out: &'o mut [u8]) -> Option<&'o [u8]> {
        let Some(session) = &mut self.session else {
            self.owes_hello = true;
            return None;
        };
        self.owes_proof = !session.is_taken;
        let length = content.len().checked_sub(CRC_BYTES)?;
        let (covered, rest) = out.split_at_mut_checked(length)?;
        covered.copy_from_slice(content.get(..length)?);
        *covered.first_mut()? |= TAGGED;

        let freshness = session.freshness.checked_add(1)?;
        let tag = session.key.tag(self.channel, freshness, covered);
        let (place, rest) = rest.split_at_mut_checked(self.profile.freshness_bytes())?;
        place.copy_from_slice(freshness.to_le_bytes().get(..place.len())?);
        let place = rest.get_mut(..self.profile.tag_bytes())?;
        place.copy_from_slice(tag.get(..place.len())?);

        session.freshness = freshness;
        close(self.channel, length + self.profile.overhead(), out)
    }
}
