//! One side of a link between two that have the same key.

use super::handshake::Handshake;
use super::line::Line;
use super::opener::{AuthError, Opener, handshake, plain};
use super::sealer::Sealer;
use super::tag::{Key, Profile};
use dimsart_core::envelope::verify;

/// For so long after something that was taken, an association stands, whoever asks for a new one, `ms`.
///
/// It is a part of the silence that a start of the other side makes, and so well below the 20 ticks after which a link
/// is lost. Where contents come less often, a forger can have both sides find together anew; that loses nothing.
pub const STANDS_MS: u32 = 5;

/// Seals what leaves and opens what comes.
#[derive(Debug)]
pub struct Guard {
    sealer: Sealer,
    opener: Opener,
    /// When something was taken last.
    taken_ms: Option<u32>,
    owes_question: bool,
    hellos: Pace,
    questions: Pace,
    answers: Pace,
}

impl Guard {
    /// A guard that the other side does not know yet, for what it sends and what it listens to on channel 0.
    ///
    /// `seed` as for [`Sealer::new`] and [`Opener::new`]; the two sides need different ones.
    #[must_use]
    pub fn new(key: &Key, line: Line, profile: Profile, seed: u64) -> Self {
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

    /// The channel that is listened to from now on. On another one than before both sides find together anew.
    pub fn listen(&mut self, channel: u16) {
        if channel != self.opener.channel() {
            self.opener.listen(channel);
            self.taken_ms = None;
        }
    }

    /// The channel that is sent on from now on. On another one than before both sides find together anew.
    pub fn send_on(&mut self, channel: u16) {
        self.sealer.send_on(channel);
    }

    /// The next handshake to be sent now, on the channel that is sent on; none when there is no more. To be asked
    /// for, until there is none, after every content that came and before every one that is sent. `now_ms` is any
    /// clock that wraps at 2^32.
    pub fn handshake(&mut self, now_ms: u32) -> Option<&[u8]> {
        let Self { sealer, opener, owes_question, hellos, questions, answers, .. } = self;
        let channel = sealer.channel();
        // Of one hello and no other: were they rationed, a flood would take the other side's.
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
        let channel = self.opener.channel();
        let covered = verify(content, channel).map_err(AuthError::Envelope)?;
        let stands = self.taken_ms.is_some_and(|last| now_ms.wrapping_sub(last) < STANDS_MS);
        match handshake(covered)? {
            None => {
                let sealed = self.opener.check(covered).inspect_err(|_| self.owes_question |= !stands)?;
                (self.taken_ms, self.owes_question) = (Some(now_ms), false);
                return plain(channel, sealed, out).map(Some);
            }
            // What this side seals would come back, too.
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

    /// The content with freshness and tag, in `out`. None as for [`Sealer::seal`].
    pub fn seal<'o>(&mut self, content: &[u8], out: &'o mut [u8]) -> Option<&'o [u8]> {
        self.sealer.seal(content, out)
    }

    /// Whether the other side has answered, so that contents can be sealed.
    #[must_use]
    pub fn is_answered(&self) -> bool {
        self.sealer.is_answered()
    }
}

/// Lets something be said once a ms: what is the same for everybody that has asked for it.
#[derive(Debug)]
struct Pace(Option<u32>);

impl Pace {
    fn allows(&mut self, now_ms: u32) -> bool {
        self.0.replace(now_ms) != Some(now_ms)
    }
}
