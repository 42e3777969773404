//! An attacker without the key hears everything and sends anything to both sides of a running link.

use super::*;
use dimsart_core::envelope::seal;

/// Output of a forger to one side.
struct Forger {
    random: Pcg64Mcg,
    /// Everything ever sent, with its receiver.
    recorded: [Vec<Vec<u8>>; 2],
    profile: Profile,
}

/// Kinds of forgery, for [`Forger::forged`].
const WAYS: u32 = 10;

impl Forger {
    fn new(profile: Profile, seed: u64) -> Self {
        Self { random: Pcg64Mcg::seed_from_u64(seed), recorded: [Vec::new(), Vec::new()], profile }
    }

    fn hear(&mut self, content: &[u8], to: usize) -> Vec<Vec<u8>> {
        if self.recorded[to].len() < 5000 {
            self.recorded[to].push(content.to_vec());
        } else {
            let place = self.random.next_u32() as usize % 5000;
            self.recorded[to][place] = content.to_vec();
        }
        vec![content.to_vec()]
    }

    /// A handshake of a kind with random bytes.
    fn handshake(&mut self, kind: u8, length: usize, channel: u16) -> Vec<u8> {
        let mut buffer = [0; MAX_CONTENT_BYTES];
        buffer[3] = kind;
        self.random.fill_bytes(&mut buffer[7..7 + length]);
        seal(Class::Handshake, channel, 0, 4 + length, &mut buffer).expect("fits").to_vec()
    }

    fn any_recorded(&mut self, to: usize) -> Option<Vec<u8>> {
        let count = self.recorded[to].len();
        (count > 0).then(|| self.recorded[to][self.random.next_u32() as usize % count].clone())
    }

    /// Returns a forgery of one of the [`WAYS`] for a side and channel.
    fn forged(&mut self, way: u32, to: usize, channel: u16) -> Option<Vec<u8>> {
        Some(match way {
            0 => self.handshake(3, 8, channel),
            1 => self.handshake(4, 16, channel),
            2 => self.handshake(5, 16, channel),
            3 => self.handshake(6, 8, channel),
            4 => self.handshake(7, 0, channel),
            // Of version 8 and earlier: a hello, a challenge, a proof.
            5 => {
                let (kind, length) = [(0, 0), (1, 8), (2, 16)][self.random.next_u32() as usize % 3];
                self.handshake(kind, length, channel)
            }
            // Replayed to this side and to the other one.
            6 => self.any_recorded(to)?,
            7 => resealed(&self.any_recorded(1 - to)?, channel),
            // The newest content with a changed tag, or with the next freshness value.
            _ => {
                let mut forged = self.recorded[to].iter().rfind(|said| said[0] & 0x80 != 0)?.clone();
                let end = forged.len() - 4;
                if way == 8 {
                    self.random.fill_bytes(&mut forged[end - 3..end]);
                } else {
                    let freshness = end - self.profile.overhead();
                    forged[freshness] = forged[freshness].wrapping_add(1);
                }
                resealed(&forged, channel)
            }
        })
    }
}

/// Sets the checksum of a channel.
fn resealed(content: &[u8], channel: u16) -> Vec<u8> {
    let mut content = content.to_vec();
    let (covered, end) = content.split_last_chunk_mut().expect("whole");
    let crc = crc::Crc::<u32>::new(&crc::CRC_32_AUTOSAR);
    let mut digest = crc.digest();
    digest.update(&u32::from(channel).to_le_bytes());
    digest.update(covered);
    *end = digest.finalize().to_le_bytes();
    content
}

/// Every genuine packet is accepted in its ms, and no new association occurs.
fn assert_untouched(link: &Link, duration_ms: usize, what: &str) {
    for side in &link.sides {
        assert_eq!(side.taken.len(), duration_ms, "{what}");
        assert!(side.taken.is_sorted_by(|a, b| after(a.counter) == b.counter), "{what}");
        assert!(side.taken_ms.is_sorted_by(|a, b| a + 1 == *b), "{what}");
    }
    for (sender, receiver) in [(0, 1), (1, 0)] {
        let own = |packet: &Packet| packet.echo == link.sides[sender].echo;
        assert!(link.sides[receiver].taken.iter().all(own), "{what}: a forgery was accepted");
    }
}

/// In earlier versions two frames of 19 bytes were enough: a forged challenge to each side.
#[test]
fn two_false_challenges_do_nothing() {
    for profile in PROFILES {
        let mut link = Link::running(profile, CHANNELS, 1);
        let mut forger = Forger::new(profile, 1);
        for to in [0, 1] {
            for (kind, length) in [(1, 8), (4, 8), (4, 16)] {
                let challenge = forger.handshake(kind, length, CHANNELS[1 - to]);
                link.give(to, &challenge);
            }
        }
        link.run(200, &mut clean);
        assert_untouched(&link, 200, "two frames");
    }
}

/// Each kind of forgery alone and all together, at ten frames per second and at the line's full rate.
#[test]
fn nothing_that_is_forged_or_repeated_is_taken_delays_anything_or_has_sides_find_together_anew() {
    for profile in PROFILES {
        for channels in [CHANNELS, [0, 0]] {
            for ways in (0..WAYS).map(|way| way..way + 1).chain(std::iter::once(0..WAYS)) {
                let mut link = Link::running(profile, channels, 1);
                let mut forger = Forger::new(profile, 2);
                link.run(300, &mut |content, to| forger.hear(content, to));
                link.sides.iter_mut().for_each(Side::forget);
                for _ in 0..400 {
                    for _ in 0..8 {
                        for to in [0, 1] {
                            let way = ways.start + forger.random.next_u32() % (ways.end - ways.start);
                            let channel = link.sides[1 - to].sends_on;
                            if let Some(forged) = forger.forged(way, to, channel) {
                                link.give(to, &forged);
                            }
                        }
                    }
                    link.run(1, &mut |content, to| forger.hear(content, to));
                }
                let what = format!("{profile:?}, {channels:?}, ways {ways:?}");
                assert_untouched(&link, 400, &what);
                for side in &link.sides {
                    // Handshakes that anybody can request are sent once per ms at most and have no effect.
                    assert_eq!(side.begun, 0, "{what}");
                    assert!(side.handshakes <= 2 * 400, "{what}: {}", side.handshakes);
                }
            }
        }
    }
}

/// In earlier versions ten forged tags per second blocked a receiver of short tags permanently.
#[test]
fn ten_forged_frames_a_second_and_as_many_as_a_line_carries_keep_nothing_out() {
    for (profile, per_s, duration_s) in [
        (Profile::Short, 10, 300),
        (Profile::Full, 10, 60),
        (Profile::Short, 8000, 60),
        (Profile::Full, 8000, 10),
    ] {
        let mut link = Link::running(profile, CHANNELS, 1);
        let mut forger = Forger::new(profile, 4);
        link.run(10, &mut |content, to| forger.hear(content, to));
        link.sides.iter_mut().for_each(Side::forget);
        let duration_s = duration_s * test_requirements::length(1, 10);
        let mut tries = 0;
        for ms in 0..duration_s * 1000 {
            for _ in 0..per_s * (ms + 1) / 1000 - per_s * ms / 1000 {
                for to in [0, 1] {
                    let forged = forger.forged(8 + ms % 2, to, CHANNELS[1 - to]).expect("heard");
                    link.give(to, &forged);
                    tries += 1;
                }
            }
            link.run(1, &mut clean);
            if ms % 1000 == 0 {
                // The newest content available for forgery.
                link.run(1, &mut |content, to| {
                    forger.recorded[to].push(content.to_vec());
                    clean(content, to)
                });
            }
        }
        assert_eq!(tries, 2 * per_s * duration_s);
        let ms = duration_s * 1001;
        assert_untouched(&link, usize::try_from(ms).expect("few"), &format!("{profile:?}, {per_s} a second"));
        assert!(link.sides.iter().all(|side| side.handshakes == 0));
    }
}

/// A flood of everything before the start does not prevent a restarted side from being accepted.
#[test]
fn a_side_that_starts_anew_is_taken_again_in_a_flood() {
    for profile in PROFILES {
        for channels in [CHANNELS, [0, 0]] {
            for seed in 3..13 {
                let mut link = Link::running(profile, channels, 1);
                let mut forger = Forger::new(profile, seed);
                link.run(300, &mut |content, to| forger.hear(content, to));
                link.sides.iter_mut().for_each(Side::forget);
                let started_ms = link.now_ms;
                link.restart(1, profile, seed);
                for _ in 0..60 {
                    for to in [0, 1, 0, 1, 0, 1, 0, 1] {
                        let way = forger.random.next_u32() % WAYS;
                        let channel = link.sides[1 - to].sends_on;
                        if let Some(forged) = forger.forged(way, to, channel) {
                            link.give(to, &forged);
                        }
                    }
                    link.run(1, &mut |content, to| forger.hear(content, to));
                }
                let [stayed, started] = &link.sides;
                let (silence_ms, first_ms) =
                    (stayed.silence_ms(started_ms, link.now_ms), started.taken_ms[0] - started_ms);
                assert!(silence_ms < 12 && first_ms < 14, "{silence_ms}, {first_ms} ms, seed {seed}");
            }
        }
    }
}

/// A link that sends less often than an association lasts: a forger can cause a new association, but no loss.
#[test]
fn a_slow_link_loses_nothing_to_a_forger() {
    for profile in PROFILES {
        let mut link = Link::running(profile, CHANNELS, 1);
        let mut forger = Forger::new(profile, 5);
        let from_ms = link.now_ms;
        let mut sent = 0;
        for ms in 0..2000 {
            link.now_ms += 1;
            for to in [0, 1] {
                for way in 0..WAYS {
                    if let Some(forged) = forger.forged(way, to, CHANNELS[1 - to]) {
                        link.give(to, &forged);
                    }
                }
                link.deliver(&mut |content, to| forger.hear(content, to));
            }
            if ms % 10 == 0 {
                sent += 1;
                for from in [0, 1] {
                    let said = link.sides[from].send(link.now_ms);
                    link.put(1 - from, said);
                }
            }
        }
        for side in &link.sides {
            assert!(side.taken.len() >= sent - 1, "{} of {sent}", side.taken.len());
            assert!(side.silence_ms(from_ms, link.now_ms) <= 10, "{}", side.silence_ms(from_ms, link.now_ms));
        }
    }
}
