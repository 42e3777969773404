//! What only who has the key can make, and nobody can use twice.
#![expect(clippy::expect_used, reason = "in helpers of tests as in tests")]

use dimsart_core::auth::{AuthError, Key, LOCKOUT_MS, LOCKOUT_TAGS, Opener, Profile, Sealer};
use dimsart_core::envelope::{Class, MAX_CONTENT_BYTES, seal};
use proptest::prelude::*;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

const CHANNEL: u16 = 17;
const KEY: [u8; 16] = *b"sixteen byte key";

/// Both ends of a channel, and all that was ever sealed.
struct Channel {
    sealer: Sealer,
    opener: Opener,
    now_ms: u32,
    sent: u8,
}

impl Channel {
    fn new(profile: Profile) -> Self {
        let key = || Key::new(&KEY);
        let sealer = Sealer::new(key(), profile, CHANNEL);
        let opener = Opener::new(key(), profile, CHANNEL, 1);
        let mut channel = Self { sealer, opener, now_ms: 0, sent: 0 };
        channel.find_together();
        channel
    }

    /// What the two loops of the ends do all the time.
    fn find_together(&mut self) {
        for _ in 0..3 {
            self.now_ms += 100;
            if let Some(hello) = self.sealer.handshake().map(<[u8]>::to_vec) {
                let _ = self.open(&hello);
            }
            if let Some(challenge) = self.opener.challenge(self.now_ms).map(<[u8]>::to_vec) {
                assert!(self.sealer.take_challenge(&challenge));
            }
        }
    }

    fn seal(&mut self) -> (Vec<u8>, Vec<u8>) {
        self.sent = self.sent.wrapping_add(1);
        let plain = content(self.sent);
        let mut out = [0; MAX_CONTENT_BYTES];
        let sealed = self.sealer.seal(&plain, &mut out).expect("challenged").to_vec();
        (plain, sealed)
    }

    fn open(&mut self, content: &[u8]) -> Result<Option<Vec<u8>>, AuthError> {
        let mut out = [0; MAX_CONTENT_BYTES];
        Ok(self.opener.open(self.now_ms, content, &mut out)?.map(<[u8]>::to_vec))
    }

    fn passes(&mut self) -> bool {
        let (plain, sealed) = self.seal();
        self.open(&sealed) == Ok(Some(plain))
    }
}

fn content(number: u8) -> Vec<u8> {
    let mut buffer = [number; MAX_CONTENT_BYTES];
    seal(Class::Request, CHANNEL, u16::from(number), 20, &mut buffer).expect("fits").to_vec()
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
    assert_eq!(PROFILES.map(Profile::overhead), [12, 4]);
}

#[test]
fn nothing_is_taken_twice_or_out_of_order() {
    for profile in PROFILES {
        let mut channel = Channel::new(profile);
        let recorded: Vec<_> = (0..200).map(|_| channel.seal().1).collect();
        assert!(channel.open(&recorded[100]).is_ok());
        for old in &recorded[..=100] {
            channel.now_ms += LOCKOUT_MS;
            assert!(channel.open(old).is_err());
        }
        assert!(channel.open(&recorded[101]).is_ok(), "what is newer still is taken");
    }
}

#[test]
fn what_was_recorded_before_a_start_of_either_end_is_refused_after_it() {
    for profile in PROFILES {
        let mut channel = Channel::new(profile);
        let recorded: Vec<_> = (0..50).map(|_| channel.seal().1).collect();
        channel.opener = Opener::new(Key::new(&KEY), profile, CHANNEL, 2);
        for old in &recorded {
            channel.now_ms += LOCKOUT_MS;
            assert_eq!(channel.open(old), Err(AuthError::Tag), "an opener that nothing was proven to");
        }
        channel.find_together();
        for old in &recorded {
            channel.now_ms += LOCKOUT_MS;
            assert!(channel.open(old).is_err());
        }
        assert!(channel.passes());

        channel.sealer = Sealer::new(Key::new(&KEY), profile, CHANNEL);
        channel.find_together();
        assert!(channel.passes(), "the sealer's new life is taken");
        for old in &recorded {
            channel.now_ms += LOCKOUT_MS;
            assert!(channel.open(old).is_err());
        }
    }
}

#[test]
fn a_reflected_content_is_refused() {
    for profile in PROFILES {
        let (mut there, mut back) = (Channel::new(profile), Channel::new(profile));
        back.opener = Opener::new(Key::new(&KEY), profile, CHANNEL, 99);
        back.find_together();
        let sealed = there.seal().1;
        assert!(back.open(&sealed).is_err());
    }
}

#[test]
fn another_key_another_channel_and_no_key_are_refused() {
    for profile in PROFILES {
        let mut channel = Channel::new(profile);
        assert_eq!(channel.open(&content(1)), Err(AuthError::NoTag));
        let mut other = Opener::new(Key::new(&KEY), profile, CHANNEL + 1, 1);
        let sealed = channel.seal().1;
        assert!(matches!(other.open(0, &sealed, &mut [0; 256]), Err(AuthError::Envelope(_))));
        let mut stranger = Sealer::new(Key::new(b"another key of16"), profile, CHANNEL);
        let challenge = Opener::new(Key::new(&KEY), profile, CHANNEL, 1).challenge(0).expect("new").to_vec();
        assert!(stranger.take_challenge(&challenge));
        let proof = stranger.handshake().expect("owed").to_vec();
        channel.opener = Opener::new(Key::new(&KEY), profile, CHANNEL, 1);
        assert_eq!(channel.open(&proof), Err(AuthError::Tag));
        let forged = stranger.seal(&content(1), &mut [0; 256]).expect("challenged").to_vec();
        assert_eq!(channel.open(&forged), Err(AuthError::Tag));
    }
}

#[test]
fn a_false_hello_or_a_repetition_interrupts_nobody() {
    for profile in PROFILES {
        let mut channel = Channel::new(profile);
        let hello = Sealer::new(Key::new(&[0; 16]), profile, CHANNEL).handshake().expect("new").to_vec();
        for step in 0..500 {
            channel.now_ms += 1;
            assert_eq!(channel.open(&hello), Ok(None));
            let (plain, sealed) = channel.seal();
            assert_eq!(channel.open(&sealed), Ok(Some(plain)), "step {step}");
            assert_eq!(channel.open(&sealed), Err(AuthError::NotFresh));
        }
    }
}

#[test]
fn a_false_challenge_is_mended_by_the_next_true_one() {
    let mut channel = Channel::new(Profile::Full);
    let false_one =
        Opener::new(Key::new(&[0; 16]), Profile::Full, CHANNEL, 5).challenge(0).expect("new").to_vec();
    assert!(channel.sealer.take_challenge(&false_one));
    assert!(!channel.passes());
    channel.find_together();
    assert!(channel.passes());
}

#[test]
fn forged_tags_are_refused_and_lock_a_short_opener() {
    let mut random = Pcg64Mcg::seed_from_u64(3);
    for profile in PROFILES {
        let mut channel = Channel::new(profile);
        let wrong = |channel: &mut Channel, random: &mut Pcg64Mcg| {
            let mut buffer = [0; MAX_CONTENT_BYTES];
            random.fill_bytes(&mut buffer[3..60]);
            let forged = seal(Class::Request, CHANNEL, 7, 40, &mut buffer).expect("fits").to_vec();
            // As a sealer would have marked it.
            let mut marked = [0; MAX_CONTENT_BYTES];
            marked[..forged.len()].copy_from_slice(&forged);
            marked[0] |= 0x80;
            let covered = forged.len() - 4;
            let crc = crc::Crc::<u32>::new(&crc::CRC_32_AUTOSAR);
            let mut digest = crc.digest();
            digest.update(&u32::from(CHANNEL).to_le_bytes());
            digest.update(&marked[..covered]);
            marked[covered..covered + 4].copy_from_slice(&digest.finalize().to_le_bytes());
            channel.open(&marked[..forged.len()])
        };
        let refusals: Vec<_> =
            (0..u32::from(LOCKOUT_TAGS) * 5).map(|_| wrong(&mut channel, &mut random)).collect();
        assert!(refusals.iter().all(Result::is_err), "{refusals:?}");
        let is_locked = refusals.contains(&Err(AuthError::LockedOut));
        assert_eq!(is_locked, profile == Profile::Short);
        assert_eq!(channel.opener.lockouts(), u32::from(is_locked));
        assert_ne!(channel.passes(), is_locked);
        channel.now_ms += LOCKOUT_MS;
        assert!(channel.passes(), "the lock-out ends");
    }
}

/// At most so many tries a second get as far as a tag.
#[test]
fn a_short_opener_looks_at_ten_wrong_tags_a_second() {
    let mut channel = Channel::new(Profile::Short);
    let (_, mut forged) = Channel::new(Profile::Short).seal();
    let last = forged.len() - 5;
    forged[last] ^= 1;
    let crc = crc::Crc::<u32>::new(&crc::CRC_32_AUTOSAR);
    let mut digest = crc.digest();
    digest.update(&u32::from(CHANNEL).to_le_bytes());
    digest.update(&forged[..=last]);
    forged[last + 1..].copy_from_slice(&digest.finalize().to_le_bytes());
    let seconds = 100;
    let mut looked_at = 0;
    for _ in 0..seconds * 8000 / 8 {
        channel.now_ms += u32::from(looked_at % 8 == 0);
        channel.now_ms += 1;
        looked_at += u32::from(channel.open(&forged) == Err(AuthError::Tag));
    }
    assert!(looked_at <= (channel.now_ms / LOCKOUT_MS + 1) * u32::from(LOCKOUT_TAGS), "{looked_at}");
    assert!(looked_at > 0);
}

proptest! {
    /// Whatever an opener is given, in whatever order: it gives out what was sealed, each at most once, in order.
    #[test]
    fn only_what_was_sealed_comes_out_once_and_in_order(
        short in any::<bool>(),
        steps in prop::collection::vec((0_u8..5, 0_usize..64, any::<u8>()), 1..300),
    ) {
        let mut channel = Channel::new(PROFILES[usize::from(short)]);
        let mut recorded: Vec<(Vec<u8>, Vec<u8>)> = Vec::new();
        let mut newest = None;
        for (action, place, byte) in steps {
            channel.now_ms += u32::from(byte);
            let (sent, damaged) = match action {
                0 | 1 => {
                    recorded.push(channel.seal());
                    (recorded.last().expect("pushed").1.clone(), false)
                }
                2 if !recorded.is_empty() => (recorded[place % recorded.len()].1.clone(), false),
                3 if !recorded.is_empty() => {
                    let mut bytes = recorded[place % recorded.len()].1.clone();
                    let length = bytes.len();
                    bytes[place % length] ^= byte.max(1);
                    (bytes, true)
                }
                _ => {
                    if let Some(challenge) = channel.opener.challenge(channel.now_ms).map(<[u8]>::to_vec) {
                        channel.sealer.take_challenge(&challenge);
                    }
                    let Some(handshake) = channel.sealer.handshake().map(<[u8]>::to_vec) else { continue };
                    (handshake, false)
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
