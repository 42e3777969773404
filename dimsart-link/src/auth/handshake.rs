//! Encoding of handshake messages.

use super::tag::TAG_BYTES;
use dimsart_core::envelope::{CRC_BYTES, Class, HEADER_BYTES, parse, seal, verify};

/// Longest handshake.
pub(super) const MAX_BYTES: usize = HEADER_BYTES + KIND_BYTES + 8 + TAG_BYTES + CRC_BYTES;

// 0 to 2 were used up to version 8 of the protocol.
const HELLO: u8 = 3;
const CHALLENGE: u8 = 4;
const PROOF: u8 = 5;
const TAKEN: u8 = 6;
const QUESTION: u8 = 7;
/// A kind and zeros: whole words, as classic CAN requires.
const KIND_BYTES: usize = 4;

/// A handshake message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Handshake {
    /// From a sealer: its nonce.
    Hello { sealer: u64 },
    /// From an opener, replying to a hello: its nonce.
    Challenge { opener: u64, tag: [u8; TAG_BYTES] },
    /// From a sealer, replying to a challenge: its nonce again, so that an opener need not store hellos.
    Proof { sealer: u64, tag: [u8; TAG_BYTES] },
    /// From an opener, replying to a proof.
    SessionAccepted { tag: [u8; TAG_BYTES] },
    /// From an opener that cannot open a message: requests a hello.
    HelloRequest,
    /// Of an unknown version.
    Unknown,
}

impl Handshake {
    /// Decodes the handshake in a content of a channel, if it is one.
    pub(super) fn open(content: &[u8], channel: u16) -> Option<Self> {
        Self::of_covered(verify(content, channel).ok()?)
    }

    /// Decodes the handshake in a content without its (valid) CRC.
    pub(super) fn of_covered(covered: &[u8]) -> Option<Self> {
        let found = parse(covered).ok().filter(|found| found.class == Class::Handshake)?;
        Some(Self::read(found.payload))
    }

    /// Decodes the payload of an envelope.
    pub(super) fn read(payload: &[u8]) -> Self {
        Self::of_this_version(payload).unwrap_or(Self::Unknown)
    }

    fn of_this_version(payload: &[u8]) -> Option<Self> {
        let (&[kind, 0, 0, 0], rest) = payload.split_first_chunk::<KIND_BYTES>()? else { return None };
        let nonce_and_tag = || {
            let (nonce, tag) = rest.split_first_chunk()?;
            Some((u64::from_le_bytes(*nonce), tag.try_into().ok()?))
        };
        match kind {
            HELLO => Some(Self::Hello { sealer: u64::from_le_bytes(rest.try_into().ok()?) }),
            CHALLENGE => nonce_and_tag().map(|(opener, tag)| Self::Challenge { opener, tag }),
            PROOF => nonce_and_tag().map(|(sealer, tag)| Self::Proof { sealer, tag }),
            TAKEN => Some(Self::SessionAccepted { tag: rest.try_into().ok()? }),
            QUESTION => rest.is_empty().then_some(Self::HelloRequest),
            _ => None,
        }
    }

    /// Encodes the content for a channel.
    pub(super) fn write(self, channel: u16, out: &mut [u8]) -> Option<&[u8]> {
        let payload = out.get_mut(HEADER_BYTES..)?;
        let (place, rest) = payload.split_first_chunk_mut::<KIND_BYTES>()?;
        let (kind, length) = match self {
            Self::Hello { sealer } => {
                *rest.first_chunk_mut()? = sealer.to_le_bytes();
                (HELLO, 8)
            }
            Self::Challenge { opener: nonce, tag } | Self::Proof { sealer: nonce, tag } => {
                let (place, rest) = rest.split_first_chunk_mut()?;
                *place = nonce.to_le_bytes();
                *rest.first_chunk_mut()? = tag;
                (if matches!(self, Self::Proof { .. }) { PROOF } else { CHALLENGE }, 8 + TAG_BYTES)
            }
            Self::SessionAccepted { tag } => {
                *rest.first_chunk_mut()? = tag;
                (TAKEN, TAG_BYTES)
            }
            Self::HelloRequest => (QUESTION, 0),
            Self::Unknown => return None,
        };
        *place = u32::from(kind).to_le_bytes();
        seal(Class::Handshake, channel, 0, KIND_BYTES + length, out)
    }
}
