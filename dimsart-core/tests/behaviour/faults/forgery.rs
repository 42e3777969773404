//! Contents forged and repeated by who has no key.

use dimsart_core::auth::{AuthError, Key, LOCKOUT_MS, LOCKOUT_TAGS, Opener, Profile, Sealer};
use dimsart_core::envelope::{Class, MAX_CONTENT_BYTES, seal};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::{below, length};

const CHANNEL: u16 = 17;
const PAYLOAD: usize = 20;

/// Both ends of a channel that have found together.
struct Channel {
    sealer: Sealer,
    opener: Opener,
    now_ms: u32,
}

impl Channel {
    fn new(profile: Profile) -> Self {
        let key = || Key::new(b"sixteen byte key");
        let mut sealer = Sealer::new(key(), profile, CHANNEL);
        let mut opener = Opener::new(key(), profile, CHANNEL, 1);
        let challenge = opener.challenge(0).unwrap().to_vec();
        assert!(sealer.take_challenge(&challenge));
        let proof = sealer.handshake().unwrap().to_vec();
        assert_eq!(opener.open(0, &proof, &mut [0; MAX_CONTENT_BYTES]), Ok(None));
        Self { sealer, opener, now_ms: 0 }
    }

    fn seal(&mut self) -> Vec<u8> {
        let mut plain = [7; MAX_CONTENT_BYTES];
        let plain = seal(Class::Packet, CHANNEL, 1, PAYLOAD, &mut plain).unwrap();
        self.sealer.seal(plain, &mut [0; MAX_CONTENT_BYTES]).unwrap().to_vec()
    }

    fn open(&mut self, content: &[u8]) -> Result<(), AuthError> {
        self.opener.open(self.now_ms, content, &mut [0; MAX_CONTENT_BYTES]).map(|_| ())
    }
}

/// A sealed content with other bits in its tag, and a CRC that is right again.
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

/// The next content, whose tag alone is not known: the best that there is to forge. 10^7 of them in the long run.
#[test]
fn no_forged_tag_of_64_bits_is_taken() {
    let mut random = Pcg64Mcg::seed_from_u64(400);
    let mut channel = Channel::new(Profile::Full);
    let mut next = channel.seal();
    for attempt in 0..length(100_000, 10_000_000) {
        forge(&mut next, 8, &mut random);
        assert_eq!(channel.open(&next), Err(AuthError::Tag), "attempt {attempt}, seed 400");
    }
    let own = channel.seal();
    assert_eq!(channel.open(&own), Ok(()));
}

/// 8000 frames a second, as fast as a CAN bus carries them: ten a second are looked at, and those are refused. 10^7 of
/// them in the long run.
#[test]
fn a_flood_of_forged_tags_of_24_bits_has_ten_tries_a_second() {
    let mut random = Pcg64Mcg::seed_from_u64(401);
    let mut channel = Channel::new(Profile::Short);
    let mut next = channel.seal();
    let (mut tried, mut attempts) = (0_u64, 0_u64);
    let total = length(100_000, 10_000_000);
    while attempts < total {
        channel.now_ms += 1;
        for _ in 0..8 {
            forge(&mut next, 3, &mut random);
            let refused = channel.open(&next).unwrap_err();
            tried += u64::from(refused == AuthError::Tag);
            assert!(matches!(refused, AuthError::Tag | AuthError::LockedOut), "seed 401: {refused}");
            attempts += 1;
        }
    }
    let seconds = u64::from(channel.now_ms / LOCKOUT_MS) + 1;
    println!("{tried} of {attempts} looked at in {seconds} s");
    assert!(tried <= seconds * u64::from(LOCKOUT_TAGS), "{tried} in {seconds} s");
    assert!(
        tried >= (seconds - 1) * u64::from(LOCKOUT_TAGS) - u64::from(LOCKOUT_TAGS),
        "{tried} in {seconds} s"
    );
}

/// The control, which shows that these are tries: with all the time there is, they come through as often as 24 bits
/// let them, 6e-8. In the long run alone, and then some of 10^8.
#[test]
fn with_all_the_time_there_is_tags_of_24_bits_are_guessed() {
    let mut random = Pcg64Mcg::seed_from_u64(402);
    let mut channel = Channel::new(Profile::Short);
    let mut next = channel.seal();
    let mut taken = 0;
    let attempts = length(10_000, 100_000_000);
    for _ in 0..attempts {
        channel.now_ms = channel.now_ms.wrapping_add(LOCKOUT_MS);
        forge(&mut next, 3, &mut random);
        if channel.open(&next).is_ok() {
            taken += 1;
            next = channel.seal();
        }
    }
    super::assert_share(taken, attempts, 1.0 / f64::from(1 << 24));
}

/// Any stretch of what was taken and recorded, given again at any time, between contents of its own: 10^6 repetitions in the
/// long run. A tag of 24 bits takes what is more than 128 old for forged, which locks it for a while.
#[test]
fn nothing_that_was_taken_is_taken_again() {
    for (profile, seed) in [(Profile::Full, 403), (Profile::Short, 404)] {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let mut channel = Channel::new(profile);
        let mut recorded: Vec<Vec<u8>> = Vec::new();
        let (mut repeated, mut passed) = (0, 0);
        while repeated < length(20_000, 1_000_000) {
            for _ in 0..1 + below(&mut random, 20) {
                channel.now_ms = channel.now_ms.wrapping_add(1);
                let own = channel.seal();
                let is_taken = channel.open(&own).is_ok();
                assert!(is_taken || profile == Profile::Short, "its own content is taken, seed {seed}");
                passed += u64::from(is_taken);
                if !is_taken {
                    // Locked out; what was not taken yet may be, once.
                    channel.now_ms = channel.now_ms.wrapping_add(LOCKOUT_MS);
                } else if recorded.len() < 5000 {
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
        assert!(passed > 100, "{passed}");
    }
}
