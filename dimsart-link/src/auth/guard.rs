//! One side of an authenticated link between two controllers.

use super::handshake::Handshake;
use super::line::KeyDomain;
use super::opener::{AuthError, Opener, handshake, plain};
use super::sealer::Sealer;
use super::tag::{Key, Profile};
use dimsart_core::envelope::verify;

/// Time after an accepted message during which a session cannot be replaced, ms.
///
/// This time adds to the silence after a restart of the peer, so it is well below the 20 ticks after which a
/// link is lost. If messages are less frequent, a forger can trigger a new handshake, which loses no message.
pub const SESSION_HOLD_MS: u32 = 5;

/// Seals outgoing messages and opens incoming ones.
#[derive(Debug)]
pub struct SecureChannel {
    sealer: Sealer,
    opener: Opener,
    /// Time of the last accepted message.
    taken_ms: Option<u32>,
    owes_question: bool,
    hellos: Pace,
    questions: Pace,
    answers: Pace,
}

impl SecureChannel {
    /// Creates a guard without a session, for channel 0 in both directions.
    ///
    /// `seed` as for [`Sealer::new`] and [`Opener::new`]; the two sides need different seeds.
    #[must_use]
    pub fn new(key: &Key, line: KeyDomain, profile: Profile, seed: u64) -> Self {
        Self {
            sealer: Sealer::new(key, line, profile, 0, seed),
            opener: Opener::new(key, line, profile, 0, seed),
            taken_ms: None,
            owes_question: false,
            hellos: Pace(None),
            questions: Pace(None),
            answers: Pace(None),
        }
    }

    /// Sets the channel to receive on. A change starts a new handshake.
    pub fn set_receive_channel(&mut self, channel: u16) {
        if channel != self.opener.channel() {
            self.opener.listen(channel);
            self.taken_ms = None;
        }
    }

    /// Sets the channel to send on. A change starts a new handshake.
    pub fn set_send_channel(&mut self, channel: u16) {
        self.sealer.send_on(channel);
    }

    /// Returns the next handshake message to send now, on the sending channel, or `None`. Call repeatedly
    /// until `None` after every received message and before every sent one. `now_ms` is any clock that wraps
    /// at 2^32.
    pub fn handshake(&mut self, now_ms: u32) -> Option<&[u8]> {
        let Self { sealer, opener, owes_question, hellos, questions, answers, .. } = self;
        let channel = sealer.channel();
        // A challenge answers one hello; with a rate limit, a flood would suppress the peer's.
        if opener.owes_challenge() {
            return opener.challenge_on(channel);
        }
        if opener.owes_taken() && answers.allows(now_ms) {
            return opener.taken_on(channel);
        }
        if *owes_question && questions.allows(now_ms) {
            *owes_question = false;
            return opener.question_on(channel);
        }
        if sealer.owes_proof() {
            return sealer.proof();
        }
        if sealer.owes_hello() && hellos.allows(now_ms) { sealer.hello() } else { None }
    }

    /// Opens a received message into `out` and returns it; `None` for a handshake.
    ///
    /// # Errors
    /// [`AuthError`]; `out` is then invalid.
    pub fn open<'o>(
        &mut self,
        now_ms: u32,
        content: &[u8],
        out: &'o mut [u8],
    ) -> Result<Option<&'o [u8]>, AuthError> {
        let channel = self.opener.channel();
        let covered = verify(content, channel).map_err(AuthError::Envelope)?;
        let stands = self.taken_ms.is_some_and(|last| now_ms.wrapping_sub(last) < SESSION_HOLD_MS);
        match handshake(covered)? {
            None => {
                let sealed = self.opener.check(covered).inspect_err(|_| self.owes_question |= !stands)?;
                (self.taken_ms, self.owes_question) = (Some(now_ms), false);
                return plain(channel, sealed, out).map(Some);
            }
            // Reflected: this side sealed it.
            Some(Handshake::Hello { sealer }) if self.sealer.is_own(sealer) => return Err(AuthError::Tag),
            Some(Handshake::Hello { .. }) if stands => {}
            Some(said @ (Handshake::Hello { .. } | Handshake::Proof { .. })) => {
                if self.opener.hear(said)? {
                    self.taken_ms = Some(now_ms);
                }
            }
            Some(said) => {
                self.sealer.hear(said)?;
            }
        }
        Ok(None)
    }

    /// Seals a message into `out`. `None` as for [`Sealer::seal`].
    pub fn seal<'o>(&mut self, content: &[u8], out: &'o mut [u8]) -> Option<&'o [u8]> {
        self.sealer.seal(content, out)
    }

    /// Returns whether a session exists, so that messages can be sealed.
    #[must_use]
    pub fn has_session(&self) -> bool {
        self.sealer.has_session()
    }
}

/// Limits replies that do not depend on the request to one per ms.
#[derive(Debug)]
struct Pace(Option<u32>);

impl Pace {
    fn allows(&mut self, now_ms: u32) -> bool {
        self.0.replace(now_ms) != Some(now_ms)
    }
}
