//! Both sides of a link, each with a guard.
#![expect(clippy::expect_used, clippy::indexing_slicing, reason = "in helpers of tests as in tests")]

use std::collections::VecDeque;

use dimsart_core::Packet;
use dimsart_core::auth::{AuthError, CHALLENGE_MS, Guard, Key, Profile};
use dimsart_core::carrier::can::{Assembler, frames};
use dimsart_core::carrier::can_fd;
use dimsart_core::envelope::MAX_CONTENT_BYTES;
use proptest::prelude::*;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

const KEY: &[u8; 16] = b"sixteen byte key";
/// Of what the left side sends, and of what the right one does.
const CHANNELS: [u16; 2] = [17, 0x123];

/// Carries a content to the other side.
type Carrier<'c> = dyn FnMut(&[u8], u16) -> Vec<Vec<u8>> + 'c;

struct Side {
    guard: Guard,
    sends_on: u16,
    /// Tells its packets from the other side's.
    echo: u16,
    counter: u16,
    refused: Vec<AuthError>,
    taken: Vec<Packet>,
}

impl Side {
    fn new(key: &[u8; 16], profile: Profile, [sends_on, listens_to]: [u16; 2], seed: u64) -> Self {
        let mut guard = Guard::new(&Key::new(key), profile, seed);
        guard.send_on(sends_on);
        guard.listen(listens_to);
        let echo = u16::try_from(seed).expect("small");
        Self { guard, sends_on, echo, counter: 0, refused: Vec::new(), taken: Vec::new() }
    }

    fn send(&mut self, now_ms: u32) -> Vec<Vec<u8>> {
        self.counter += 1;
        let words = (0..9).map(|word| u32::from(self.counter) + word).collect();
        let packet =
            Packet { channel: self.sends_on, counter: self.counter, echo: self.echo, content: 2, words };
        let mut sent = Vec::new();
        while let Some(handshake) = self.guard.handshake(now_ms) {
            sent.push(handshake.to_vec());
        }
        sent.extend(self.guard.seal(&packet.to_bytes(), &mut [0; MAX_CONTENT_BYTES]).map(<[u8]>::to_vec));
        sent
    }

    fn take(&mut self, now_ms: u32, content: &[u8], channel: u16) {
        match self.guard.take(now_ms, content, &mut [0; MAX_CONTENT_BYTES]) {
            Ok(Some(plain)) => {
                self.taken.push(Packet::from_bytes(plain, channel).expect("what was sealed is whole"));
            }
            Ok(None) => {}
            Err(error) => self.refused.push(error),
        }
    }
}

fn sides(profile: Profile, channels: [u16; 2]) -> [Side; 2] {
    let [left, right] = channels;
    [Side::new(KEY, profile, [left, right], 1), Side::new(KEY, profile, [right, left], 2)]
}

/// So many ms in which each side sends once a ms, from `now_ms`.
fn run(sides: &mut [Side; 2], now_ms: &mut u32, duration_ms: u32, carrier: &mut Carrier<'_>) {
    for _ in 0..duration_ms {
        *now_ms += 1;
        for (from, to) in [(0, 1), (1, 0)] {
            let channel = sides[from].sends_on;
            for content in sides[from].send(*now_ms) {
                for arrived in carrier(&content, channel) {
                    sides[to].take(*now_ms, &arrived, channel);
                }
            }
        }
    }
}

fn clean(content: &[u8], _: u16) -> Vec<Vec<u8>> {
    vec![content.to_vec()]
}

#[test]
fn both_sides_find_together_in_three_ms_and_lose_nothing_from_then_on() {
    for profile in [Profile::Full, Profile::Short] {
        for channels in [CHANNELS, [0, 0]] {
            let mut sides = sides(profile, channels);
            run(&mut sides, &mut 0, 1000, &mut clean);
            for side in &sides {
                assert!(side.taken.len() >= 997, "{} taken", side.taken.len());
                assert!(side.taken.is_sorted_by(|a, b| a.counter + 1 == b.counter));
                assert!(side.refused.len() <= 2, "{:?}", side.refused);
            }
        }
    }
}

/// Handshakes and packets with a tag in frames of 8 bytes, and in one frame of 64.
#[test]
fn can_carries_handshakes_and_tags() {
    let mut classic = sides(Profile::Short, CHANNELS);
    let mut assemblers = [(); 2].map(|()| Assembler::authenticated());
    let mut most = 0;
    run(&mut classic, &mut 0, 500, &mut |content, channel| {
        let assembler = &mut assemblers[usize::from(channel == CHANNELS[0])];
        let data: Vec<_> = frames(content, channel).expect("of a class that it carries").collect();
        most = most.max(data.len());
        data.iter().filter_map(|data| assembler.take(data, channel).map(<[u8]>::to_vec)).collect()
    });
    assert_eq!(
        (most, assemblers.map(|assembler| assembler.dropped())),
        (10, [0, 0]),
        "one frame more than 9"
    );
    let mut fd = sides(Profile::Full, CHANNELS);
    run(&mut fd, &mut 0, 500, &mut |content, _| {
        let data = can_fd::pack(content).expect("fits one frame");
        can_fd::unpack(&data).map(<[u8]>::to_vec).into_iter().collect()
    });
    for side in classic.iter().chain(&fd) {
        assert!(side.taken.len() >= 497, "{} taken, {:?}", side.taken.len(), side.refused);
    }
}

#[test]
fn loss_and_repetition_cost_what_they_hit_and_no_more() {
    for profile in [Profile::Full, Profile::Short] {
        let mut sides = sides(profile, CHANNELS);
        let mut random = Pcg64Mcg::seed_from_u64(5);
        let mut arrived = 0;
        let mut now_ms = 0;
        run(&mut sides, &mut now_ms, 1000, &mut clean);
        let before: usize = sides.iter().map(|side| side.taken.len()).sum();
        run(&mut sides, &mut now_ms, 20_000, &mut |content, _| {
            let copies = match random.next_u32() % 10 {
                0 => 0,
                1 => 2,
                _ => 1,
            };
            arrived += usize::from(copies > 0);
            vec![content.to_vec(); copies]
        });
        let after: usize = sides.iter().map(|side| side.taken.len()).sum();
        assert_eq!(after - before, arrived, "no handshake was needed");
    }
}

/// Everything that a side says comes back to it, and nothing else.
#[test]
fn a_mirror_is_no_other_side() {
    for profile in [Profile::Full, Profile::Short] {
        let [mut side, _] = sides(profile, [0, 0]);
        let mut sent = 0;
        for now_ms in 0..10 * CHALLENGE_MS {
            for content in side.send(now_ms) {
                sent += 1;
                side.take(now_ms, &content, 0);
            }
        }
        assert!(sent >= 10 && side.taken.is_empty(), "{} of {sent} taken", side.taken.len());
        assert!(!side.guard.is_answered());
    }
}

#[test]
fn another_key_on_the_other_side_is_refused() {
    let [left, right] = CHANNELS;
    let stranger = Side::new(b"another key of16", Profile::Full, [right, left], 2);
    let mut sides = [Side::new(KEY, Profile::Full, CHANNELS, 1), stranger];
    run(&mut sides, &mut 0, 500, &mut clean);
    for side in &sides {
        assert!(side.taken.is_empty());
        assert!(side.refused.len() > 400 && side.refused.iter().all(|error| *error == AuthError::Tag));
    }
}

#[test]
fn a_side_that_starts_anew_or_changes_its_channel_is_taken_again() {
    let mut sides = sides(Profile::Full, CHANNELS);
    let mut now_ms = 0;
    run(&mut sides, &mut now_ms, 100, &mut clean);
    let [left, right] = CHANNELS;
    sides[1] = Side::new(KEY, Profile::Full, [right, left], 3);
    let before = sides[0].taken.len();
    run(&mut sides, &mut now_ms, 2 * CHALLENGE_MS, &mut clean);
    assert!(sides[0].taken.len() >= before + 100 && sides[1].taken.len() >= 100);

    sides[0].guard.send_on(99);
    sides[0].sends_on = 99;
    sides[1].guard.listen(99);
    sides[1].taken.clear();
    run(&mut sides, &mut now_ms, 2 * CHALLENGE_MS, &mut clean);
    assert!(sides[1].taken.len() >= 100, "{} taken, {:?}", sides[1].taken.len(), sides[1].refused);
}

/// What comes of the other side before both have found together is no try of a tag, however long that takes.
#[test]
fn a_side_that_starts_anew_far_away_is_not_locked_out() {
    for profile in [Profile::Full, Profile::Short] {
        for delay_ms in [6, 50, 300] {
            let mut sides = sides(profile, CHANNELS);
            let mut on_the_way = VecDeque::new();
            let mut now_ms = 0;
            for start in 0..3 {
                for _ in 0..5 * delay_ms + CHALLENGE_MS {
                    now_ms += 1;
                    for (from, to) in [(0, 1), (1, 0)] {
                        let sent = sides[from].send(now_ms);
                        on_the_way.extend(sent.into_iter().map(|content| (now_ms + delay_ms, to, content)));
                    }
                    while let Some((_, to, content)) =
                        on_the_way.pop_front_if(|(due_ms, ..)| *due_ms <= now_ms)
                    {
                        sides[to].take(now_ms, &content, CHANNELS[1 - to]);
                    }
                }
                for side in &sides {
                    let what = format!("{profile:?}, {delay_ms} ms, start {start}");
                    assert_eq!(side.guard.lockouts(), 0, "{what}");
                    assert!(side.taken.len() >= 50, "{what}: {} taken", side.taken.len());
                }
                let [left, right] = CHANNELS;
                sides[1] = Side::new(KEY, profile, [right, left], 3 + start);
                sides[0].taken.clear();
            }
        }
    }
}

proptest! {
    /// Somebody has all that was ever said and gives it to whom they like, whenever they like.
    #[test]
    fn a_side_takes_what_the_other_one_sealed_once_and_in_order(
        is_short in any::<bool>(),
        on_one_channel in any::<bool>(),
        steps in prop::collection::vec((0_u8..6, any::<prop::sample::Index>(), any::<bool>()), 1..200),
    ) {
        let profile = if is_short { Profile::Short } else { Profile::Full };
        let mut sides = sides(profile, if on_one_channel { [0, 0] } else { CHANNELS });
        let mut said: Vec<(Vec<u8>, u16)> = Vec::new();
        let mut now_ms = 0;
        for (action, place, is_right) in steps {
            now_ms += 20;
            let side = usize::from(is_right);
            if action < 3 {
                let channel = sides[side].sends_on;
                let contents = sides[side].send(now_ms);
                for content in &contents {
                    sides[1 - side].take(now_ms, content, channel);
                }
                said.extend(contents.into_iter().map(|content| (content, channel)));
            } else if !said.is_empty() {
                let (content, channel) = place.get(&said);
                sides[side].take(now_ms, content, *channel);
            }
        }
        for [sender, receiver] in [[0, 1], [1, 0]].map(|order| order.map(|side| &sides[side])) {
            prop_assert!(receiver.taken.is_sorted_by(|a, b| a.counter < b.counter));
            let senders = |packet: &Packet| packet.counter <= sender.counter && packet.echo == sender.echo;
            prop_assert!(receiver.taken.iter().all(senders));
        }
    }
}
