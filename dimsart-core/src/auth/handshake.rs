//! The bytes of a handshake.

use super::tag::{FULL_TAG_BYTES, Key, is_same};
use crate::envelope::{CRC_BYTES, Class, HEADER_BYTES, parse, seal, verify};

/// Longest handshake.
pub(super) const MAX_BYTES: usize = HEADER_BYTES + KIND_BYTES + 8 + FULL_TAG_BYTES + CRC_BYTES;

const HELLO: u8 = 0;
const CHALLENGE: u8 = 1;
const PROOF: u8 = 2;
/// A kind and zeros: a payload of whole words, which classic CAN carries as well.
const KIND_BYTES: usize = 4;

/// What one end tells the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Handshake {
    Hello,
    Challenge { nonce: u64 },
    Proof { freshness: u64, tag: [u8; FULL_TAG_BYTES] },
}

impl Handshake {
    /// The handshake in a content of a channel, if it is one.
    pub(super) fn open(content: &[u8], channel: u16) -> Option<Self> {
        Self::of_covered(verify(content, channel).ok()?)
    }

    /// The handshake in a content whose CRC was right and taken off.
    pub(super) fn of_covered(covered: &[u8]) -> Option<Self> {
        let found = parse(covered).ok().filter(|found| found.class == Class::Handshake)?;
        Self::read(found.payload)
    }

    /// Reads the payload of an envelope.
    pub(super) fn read(payload: &[u8]) -> Option<Self> {
        match payload {
            [HELLO, 0, 0, 0] => Some(Self::Hello),
            [CHALLENGE, 0, 0, 0, nonce @ ..] => {
                Some(Self::Challenge { nonce: u64::from_le_bytes(nonce.try_into().ok()?) })
            }
            [PROOF, 0, 0, 0, rest @ ..] => {
                let (freshness, tag) = rest.split_first_chunk::<8>()?;
                Some(Self::Proof { freshness: u64::from_le_bytes(*freshness), tag: tag.try_into().ok()? })
            }
            _ => None,
        }
    }

    /// The content of a channel.
    pub(super) fn write(self, channel: u16, out: &mut [u8]) -> Option<&[u8]> {
        let payload = out.get_mut(HEADER_BYTES..)?;
        let (place, rest) = payload.split_first_chunk_mut::<KIND_BYTES>()?;
        let (kind, length) = match self {
            Self::Hello => (HELLO, 0),
            Self::Challenge { nonce } => {
                *rest.first_chunk_mut()? = nonce.to_le_bytes();
                (CHALLENGE, 8)
            }
            Self::Proof { freshness, tag } => {
                let (place, rest) = rest.split_first_chunk_mut()?;
                *place = freshness.to_le_bytes();
                *rest.first_chunk_mut()? = tag;
                (PROOF, 8 + FULL_TAG_BYTES)
            }
        };
        *place = u32::from(kind).to_le_bytes();
        seal(Class::Handshake, channel, 0, KIND_BYTES + length, out)
    }

    /// Says where a sealer is.
    pub(super) fn proof(key: &Key, channel: u16, nonce: u64, freshness: u64) -> Self {
        let parts: [&[u8]; 4] =
            [&channel.to_le_bytes(), &nonce.to_le_bytes(), &freshness.to_le_bytes(), &[PROOF]];
        Self::Proof { freshness, tag: key.tag(&parts) }
    }

    /// Whether a proof was made for this nonce by who has the key.
    pub(super) fn proves(self, key: &Key, channel: u16, nonce: u64) -> Option<u64> {
        let Self::Proof { freshness, tag } = self else { return None };
        let Self::Proof { tag: right, .. } = Self::proof(key, channel, nonce, freshness) else { return None };
        is_same(&tag, &right).then_some(freshness)
    }
}
