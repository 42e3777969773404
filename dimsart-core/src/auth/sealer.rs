//! Puts tags on contents.

use super::handshake::{Handshake, MAX_BYTES};
use super::tag::{Key, Profile};
use crate::envelope::{CRC_BYTES, TAGGED, close};

/// The sending end of a channel.
#[derive(Debug)]
pub struct Sealer {
    key: Key,
    profile: Profile,
    channel: u16,
    nonce: Option<u64>,
    freshness: u64,
    owes_proof: bool,
    handshake: [u8; MAX_BYTES],
}

impl Sealer {
    /// A sealer that the opener at the other end does not know yet.
    #[must_use]
    pub fn new(key: Key, profile: Profile, channel: u16) -> Self {
        let handshake = [0; MAX_BYTES];
        Self { key, profile, channel, nonce: None, freshness: 0, owes_proof: false, handshake }
    }

    /// The handshake to be sent now, before anything else, if there is one: a proof that is owed; a hello for as long
    /// as there is no nonce. To be asked for every 100 ms or so and after every
    /// [`take_challenge`](Self::take_challenge).
    pub fn handshake(&mut self) -> Option<&[u8]> {
        let handshake = match self.nonce {
            None => Handshake::Hello,
            Some(nonce) if core::mem::take(&mut self.owes_proof) => {
                Handshake::proof(&self.key, self.channel, nonce, self.freshness)
            }
            Some(_) => return None,
        };
        handshake.write(self.channel, &mut self.handshake)
    }

    /// Takes a content that came back from the opener's end; gives whether it was a challenge.
    pub fn take_challenge(&mut self, content: &[u8]) -> bool {
        self.take_handshake(Handshake::open(content, self.channel))
    }

    /// As [`take_challenge`](Self::take_challenge), for a content without the CRC that was right for the channel.
    pub(crate) fn take_covered(&mut self, covered: &[u8]) -> bool {
        self.take_handshake(Handshake::of_covered(covered))
    }

    fn take_handshake(&mut self, handshake: Option<Handshake>) -> bool {
        let Some(Handshake::Challenge { nonce }) = handshake else { return false };
        self.answer(nonce);
        true
    }

    /// Waits for a challenge, as in the beginning.
    pub(crate) fn forget(&mut self) {
        (self.nonce, self.owes_proof) = (None, false);
    }

    /// Uses the nonce of a challenge from now on.
    pub(super) fn answer(&mut self, nonce: u64) {
        self.nonce = Some(nonce);
        self.owes_proof = true;
    }

    pub(crate) fn has_nonce(&self) -> bool {
        self.nonce.is_some()
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
        let nonce = self.nonce?;
        let length = content.len().checked_sub(CRC_BYTES)?;
        let (covered, rest) = out.split_at_mut_checked(length)?;
        covered.copy_from_slice(content.get(..length)?);
        *covered.first_mut()? |= TAGGED;

        let freshness = self.freshness.checked_add(1)?;
        let low = freshness.to_le_bytes();
        let tag = self.key.tag(&[&self.channel.to_le_bytes(), &nonce.to_le_bytes(), &low, covered]);
        let (place, rest) = rest.split_at_mut_checked(self.profile.freshness_bytes())?;
        place.copy_from_slice(low.get(..place.len())?);
        let place = rest.get_mut(..self.profile.tag_bytes())?;
        place.copy_from_slice(tag.get(..place.len())?);

        self.freshness = freshness;
        close(self.channel, length + self.profile.overhead(), out)
    }
}
