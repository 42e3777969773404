//! Contents forged and replayed without the key.

use dimsart_core::envelope::{Class, MAX_CONTENT_BYTES, seal};
use dimsart_link::auth::{AuthError, Key, KeyDomain, Opener, Profile, Sealer};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::below;
use test_requirements::length;

const CHANNEL: u16 = 17;
const PAYLOAD: usize = 20;

/// Both ends of an associated channel.
struct Channel {
    sealer: Sealer,
    opener: Opener,
}

impl Channel {
    fn new(profile: Profile) -> Self {
        let (key, line) = (Key::new(b"sixteen byte key"), KeyDomain::Link(0));
        let mut sealer = Sealer::new(&key, line, profile, CHANNEL, 1);
        let mut opener = Opener::new(&key, line, profile, CHANNEL, 2);
        for _ in 0..2 {
            let said = sealer.handshake().unwrap();
            assert_eq!(opener.open(said, &mut [0; MAX_CONTENT_BYTES]), Ok(None));
            assert!(sealer.receive(opener.handshake().unwrap()));
        }
        Self { sealer, opener }
    }

    fn seal(&mut self) -> Vec<u8> {
        let mut plain = [7; MAX_CONTENT_BYTES];
        let plain = seal(Class::Packet, CHANNEL, 1, PAYLOAD, &mut plain).unwrap();
        self.sealer.seal(plain, &mut [0; MAX_CONTENT_BYTES]).unwrap().to_vec()
    }

    fn open(&mut self, content: &[u8]) -> Result<(), AuthError> {
        self.opener.open(content, &mut [0; MAX_CONTENT_BYTES]).map(|_| ())
    }
}

/// A sealed content with a changed tag and a corrected CRC.
fn forge(sealed: &mut [u8], tag_bytes: usize, random: &mut Pcg64Mcg) {
    let (covered, crc) = sealed.split_last_chunk_mut().unwrap();
    let tag = covered.len() - tag_bytes;
    random.fill_bytes(&mut covered[tag..]);
    let algorithm = crc::Crc::<u32>::new(&crc::CRC_32_AUTOSAR);
    let mut digest = algorithm.digest();
    digest.update(&u32::from(CHANNEL).to_le_bytes());
    digest.update(covered);
    *crc = digest.finalize().to_le_bytes();
}

/// The next content with an unknown tag: the best possible forgery. 10^7 of them in the long run.
#[test]
fn no_forged_tag_is_taken() {
    for (profile, tag_bytes) in [(Profile::Full, 8), (Profile::Short, 7)] {
        let mut random = Pcg64Mcg::seed_from_u64(400);
        let mut channel = Channel::new(profile);
        let mut next = channel.seal();
        for attempt in 0..length(100_000, 10_000_000) {
            forge(&mut next, tag_bytes, &mut random);
            assert_eq!(channel.open(&next), Err(AuthError::Tag), "attempt {attempt}, seed 400");
        }
        let own = channel.seal();
        assert_eq!(channel.open(&own), Ok(()));
    }
}

/// Control, to show that these are real attempts: if all but two bytes of the tag are known, guesses succeed
/// as often as 16 bits allow, so each bit of the tag halves the chance.
#[test]
fn two_bytes_of_a_tag_are_guessed_as_often_as_their_bits_let_it() {
    let mut random = Pcg64Mcg::seed_from_u64(402);
    let mut channel = Channel::new(Profile::Short);
    let mut next = channel.seal();
    let mut taken = 0;
    let attempts = length(400_000, 10_000_000);
    for _ in 0..attempts {
        forge(&mut next, 2, &mut random);
        if channel.open(&next).is_ok() {
            taken += 1;
            next = channel.seal();
        }
    }
    super::assert_share(taken, attempts, 1.0 / f64::from(1 << 16));
}

/// Any recorded stretch replayed at any time between genuine contents: 10^6 replays in the long run.
#[test]
fn nothing_that_was_taken_is_taken_again() {
    for (profile, seed) in [(Profile::Full, 403), (Profile::Short, 404)] {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let mut channel = Channel::new(profile);
        let mut recorded: Vec<Vec<u8>> = Vec::new();
        let mut repeated = 0;
        while repeated < length(20_000, 1_000_000) {
            for _ in 0..1 + below(&mut random, 20) {
                let own = channel.seal();
                assert_eq!(channel.open(&own), Ok(()), "the genuine content is accepted, seed {seed}");
                if recorded.len() < 5000 {
                    recorded.push(own);
                } else {
                    let place = below(&mut random, recorded.len());
                    recorded[place] = own;
                }
            }
            let start = below(&mut random, recorded.len());
            for old in recorded[start..].iter().take(1 + below(&mut random, 50)).cloned().collect::<Vec<_>>()
            {
                assert!(channel.open(&old).is_err(), "repetition {repeated}, seed {seed}");
                repeated += 1;
            }
        }
    }
}
