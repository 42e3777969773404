//! Contents that only the key holder can create, and that are accepted once at most.
#![expect(clippy::expect_used, reason = "in helpers of tests as in tests")]

mod handshakes;

use dimsart_core::envelope::{Class, MAX_CONTENT_BYTES, seal};
use dimsart_link::auth::{AuthError, Key, KeyDomain, Opener, Profile, Sealer};
use proptest::prelude::*;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

const CHANNEL: u16 = 17;
const KEY: [u8; 16] = *b"sixteen byte key";
const LINE: KeyDomain = KeyDomain::Link(0);

/// Both ends of a channel, and all contents ever sealed.
struct Channel {
    sealer: Sealer,
    opener: Opener,
    sent: u8,
}

fn sealer(profile: Profile, seed: u64) -> Sealer {
    Sealer::new(&Key::new(&KEY), LINE, profile, CHANNEL, seed)
}

fn opener(profile: Profile, seed: u64) -> Opener {
    Opener::new(&Key::new(&KEY), LINE, profile, CHANNEL, seed)
}

impl Channel {
    fn new(profile: Profile) -> Self {
        Self::of(sealer(profile, 1), opener(profile, 2))
    }

    fn of(sealer: Sealer, opener: Opener) -> Self {
        let mut channel = Self { sealer, opener, sent: 0 };
        channel.find_together();
        channel
    }

    /// Runs the loops of both ends: the sealer sends a hello in place of content that it cannot seal.
    fn find_together(&mut self) {
        for _ in 0..2 {
            self.passes();
            while let Some(handshake) = self.sealer.handshake().map(<[u8]>::to_vec) {
                let _ = self.open(&handshake);
            }
            while let Some(handshake) = self.opener.handshake().map(<[u8]>::to_vec) {
                self.sealer.receive(&handshake);
            }
        }
    }

    fn try_to_seal(&mut self) -> Option<(Vec<u8>, Vec<u8>)> {
        self.sent = self.sent.wrapping_add(1);
        let plain = content(self.sent);
        let mut out = [0; MAX_CONTENT_BYTES];
        let sealed = self.sealer.seal(&plain, &mut out)?.to_vec();
        Some((plain, sealed))
    }

    fn seal(&mut self) -> (Vec<u8>, Vec<u8>) {
        self.try_to_seal().expect("challenged")
    }

    fn open(&mut self, content: &[u8]) -> Result<Option<Vec<u8>>, AuthError> {
        let mut out = [0; MAX_CONTENT_BYTES];
        Ok(self.opener.open(content, &mut out)?.map(<[u8]>::to_vec))
    }

    fn passes(&mut self) -> bool {
        self.try_to_seal().is_some_and(|(plain, sealed)| self.open(&sealed) == Ok(Some(plain)))
    }
}

fn content(number: u8) -> Vec<u8> {
    let mut buffer = [number; MAX_CONTENT_BYTES];
    seal(Class::Request, CHANNEL, u16::from(number), 20, &mut buffer).expect("fits").to_vec()
}

/// Sets the correct checksum of a changed content.
fn close(content: &mut [u8], channel: u16) {
    let (covered, end) = content.split_last_chunk_mut().expect("long");
    let crc = crc::Crc::<u32>::new(&crc::CRC_32_AUTOSAR);
    let mut digest = crc.digest();
    digest.update(&u32::from(channel).to_le_bytes());
    digest.update(covered);
    *end = digest.finalize().to_le_bytes();
}

const PROFILES: [Profile; 2] = [Profile::Full, Profile::Short];

#[test]
fn contents_come_out_as_they_went_in_and_grow_by_the_stated_bytes() {
    for profile in PROFILES {
        let mut channel = Channel::new(profile);
        for _ in 0..1000 {
            let (plain, sealed) = channel.seal();
            assert_eq!(sealed.len(), plain.len() + profile.overhead());
            assert_eq!(channel.open(&sealed), Ok(Some(plain)));
        }
    }
    assert_eq!(PROFILES.map(Profile::overhead), [12, 8]);
}

#[test]
fn nothing_is_taken_twice_or_out_of_order() {
    for profile in PROFILES {
        let mut channel = Channel::new(profile);
        let recorded: Vec<_> = (0..200).map(|_| channel.seal().1).collect();
        assert!(channel.open(&recorded[100]).is_ok());
        for old in &recorded[..=100] {
            assert!(channel.open(old).is_err());
        }
        assert!(channel.open(&recorded[101]).is_ok(), "a newer content is accepted");
    }
}

#[test]
fn what_was_recorded_before_a_start_of_either_end_is_refused_after_it() {
    for profile in PROFILES {
        let mut channel = Channel::new(profile);
        let recorded: Vec<_> = (0..50).map(|_| channel.seal().1).collect();
        channel.opener = opener(profile, 3);
        for old in &recorded {
            assert_eq!(channel.open(old), Err(AuthError::Tag), "an opener without an association");
        }
        // As a guard requests it, or after a refusal.
        channel.sealer = sealer(profile, 4);
        channel.find_together();
        for old in &recorded {
            assert!(channel.open(old).is_err());
        }
        assert!(channel.passes());

        channel.sealer = sealer(profile, 5);
        channel.find_together();
        assert!(channel.passes(), "the restarted sealer is accepted");
        for old in &recorded {
            assert!(channel.open(old).is_err());
        }
    }
}

/// Content made with another key or on another line has a wrong tag and is refused; ends of different lines
/// do not associate.
#[test]
fn nothing_of_another_key_or_line_is_taken() {
    for profile in PROFILES {
        let ends = |key: &[u8; 16], line| {
            let key = Key::new(key);
            let sealer = Sealer::new(&key, line, profile, CHANNEL, 1);
            Channel::of(sealer, Opener::new(&key, line, profile, CHANNEL, 2))
        };
        let others = [
            (b"another key of16", LINE, "key"),
            (&KEY, KeyDomain::Link(1), "link"),
            (&KEY, KeyDomain::Commands, "kind of line"),
        ];
        for (key, line, what) in others {
            let (mut channel, mut other) = (ends(&KEY, LINE), ends(key, line));
            assert!(channel.passes() && other.passes());
            let sealed = other.seal().1;
            assert_eq!(channel.open(&sealed), Err(AuthError::Tag), "another {what}");
            assert!(channel.passes(), "and has no effect");
            for (one, two) in [(channel.sealer, other.opener), (other.sealer, channel.opener)] {
                let mut strangers = Channel::of(one, two);
                assert!(!strangers.passes(), "another {what}");
                strangers.sealer = Sealer::new(&Key::new(key), line, profile, CHANNEL, 3);
                strangers.opener = opener(profile, 4);
                strangers.find_together();
                assert!(!strangers.passes(), "another {what}");
            }
        }
    }
}

/// Two associations of one line, one per direction.
#[test]
fn what_was_sealed_for_one_association_is_refused_in_another() {
    for profile in PROFILES {
        let mut there = Channel::of(sealer(profile, 1), opener(profile, 2));
        let mut back = Channel::of(sealer(profile, 2), opener(profile, 1));
        let sealed = there.seal().1;
        assert_eq!(back.open(&sealed), Err(AuthError::Tag));
        assert!(there.open(&sealed).is_ok());
    }
}

#[test]
fn another_channel_and_no_key_are_refused() {
    for profile in PROFILES {
        let mut channel = Channel::new(profile);
        assert_eq!(channel.open(&content(1)), Err(AuthError::NoTag));
        let mut other = Opener::new(&Key::new(&KEY), LINE, profile, CHANNEL + 1, 2);
        let mut sealed = channel.seal().1;
        assert!(matches!(other.open(&sealed, &mut [0; 256]), Err(AuthError::Envelope(_))));
        // Only its checksum is correct, which anybody can compute.
        close(&mut sealed, CHANNEL + 1);
        assert_eq!(other.open(&sealed, &mut [0; 256]), Err(AuthError::Tag));
    }
}

/// Every bit of every tag counts, of contents and of handshakes.
#[test]
fn a_tag_with_one_wrong_bit_is_wrong() {
    for (profile, tag_bytes) in [(Profile::Full, 8), (Profile::Short, 7)] {
        let mut channel = Channel::new(profile);
        let flipped = |content: &[u8], bit: usize, tag_bytes: usize| {
            let mut forged = content.to_vec();
            let tag = forged.len() - 4 - tag_bytes;
            forged[tag + bit / 8] ^= 1 << (bit % 8);
            close(&mut forged, CHANNEL);
            forged
        };
        let (plain, sealed) = channel.seal();
        for bit in 0..8 * tag_bytes {
            assert_eq!(channel.open(&flipped(&sealed, bit, tag_bytes)), Err(AuthError::Tag), "bit {bit}");
        }
        assert_eq!(channel.open(&sealed), Ok(Some(plain)));

        let mut fresh = Channel { sealer: sealer(profile, 3), opener: opener(profile, 4), sent: 0 };
        let hello = fresh.sealer.handshake().expect("new").to_vec();
        assert_eq!(fresh.open(&hello), Ok(None));
        let challenge = fresh.opener.handshake().expect("greeted").to_vec();
        for bit in 0..64 {
            assert!(!fresh.sealer.receive(&flipped(&challenge, bit, 8)), "bit {bit}");
            assert_eq!(fresh.try_to_seal(), None);
        }
        assert!(fresh.sealer.receive(&challenge));
        let proof = fresh.sealer.handshake().expect("challenged").to_vec();
        for bit in 0..64 {
            assert_eq!(fresh.open(&flipped(&proof, bit, 8)), Err(AuthError::Tag), "bit {bit}");
        }
        assert_eq!(fresh.open(&proof), Ok(None));
        let taken = fresh.opener.handshake().expect("proven").to_vec();
        for bit in 0..64 {
            assert!(!fresh.sealer.receive(&flipped(&taken, bit, 8)), "bit {bit}");
            assert!(fresh.passes());
            assert!(fresh.sealer.handshake().is_some(), "it continues the handshake");
        }
        assert!(fresh.sealer.receive(&taken));
        assert!(fresh.passes());
        assert_eq!(fresh.sealer.handshake(), None);
    }
}

proptest! {
    /// Whatever an opener receives in whatever order, it outputs sealed contents only, each at most once, in
    /// order.
    #[test]
    fn only_what_was_sealed_comes_out_once_and_in_order(
        short in any::<bool>(),
        steps in prop::collection::vec((0_u8..6, 0_usize..64, any::<u8>()), 1..300),
    ) {
        let mut channel = Channel::new(PROFILES[usize::from(short)]);
        let mut recorded: Vec<(Vec<u8>, Vec<u8>)> = Vec::new();
        let mut handshakes: Vec<Vec<u8>> = Vec::new();
        let mut newest = None;
        for (action, place, byte) in steps {
            let (sent, damaged) = match action {
                0 | 1 => {
                    recorded.push(channel.seal());
                    (recorded.last().expect("pushed").1.clone(), false)
                }
                2 if !recorded.is_empty() => (recorded[place % recorded.len()].1.clone(), false),
                3 if !recorded.is_empty() => {
                    let mut bytes = recorded[place % recorded.len()].1.clone();
                    let length = bytes.len();
                    bytes[place % (length - 4)] ^= byte.max(1);
                    close(&mut bytes, CHANNEL);
                    (bytes, true)
                }
                4 if !handshakes.is_empty() => {
                    let old = handshakes[place % handshakes.len()].clone();
                    channel.sealer.receive(&old);
                    (old, false)
                }
                _ => {
                    handshakes.extend(channel.opener.handshake().map(<[u8]>::to_vec));
                    handshakes.extend(channel.sealer.handshake().map(<[u8]>::to_vec));
                    // A challenge, which anybody can request.
                    let mut question = [0; MAX_CONTENT_BYTES];
                    question[3] = 7;
                    let question = seal(Class::Handshake, CHANNEL, 0, 4, &mut question).expect("fits");
                    channel.sealer.receive(question);
                    continue;
                }
            };
            if let Ok(Some(opened)) = channel.open(&sent) {
                prop_assert!(!damaged);
                let place = recorded.iter().position(|(plain, sealed)| *plain == opened && *sealed == sent);
                prop_assert!(place.is_some() && place > newest, "{place:?} after {newest:?}");
                newest = place;
            }
        }
    }
}
