//! Both sides of a link, each with a guard.
#![expect(clippy::expect_used, clippy::indexing_slicing, reason = "in helpers of tests as in tests")]

mod attacks;
mod starts;
mod strangers;

use std::collections::VecDeque;

use dimsart_core::Packet;
use dimsart_core::envelope::{Class, MAX_CONTENT_BYTES};
use dimsart_link::auth::{AuthError, Key, KeyDomain, Profile, SESSION_HOLD_MS, SecureChannel};
use dimsart_link::carrier::can::{Assembler, frames};
use dimsart_link::carrier::can_fd;
use proptest::prelude::*;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

const KEY: &[u8; 16] = b"sixteen byte key";
/// Channels of the left side and of the right side.
const CHANNELS: [u16; 2] = [17, 0x123];
const PROFILES: [Profile; 2] = [Profile::Full, Profile::Short];
/// Timeout of a link in ticks of 1 ms, by default.
const TIMEOUT_MS: u32 = 20;

/// Counters of packets.
fn after(counter: u16) -> u16 {
    counter.checked_add(1).unwrap_or(101)
}

struct Side {
    guard: SecureChannel,
    sends_on: u16,
    /// Distinguishes its packets from the peer's.
    echo: u16,
    counter: u16,
    refused: Vec<AuthError>,
    taken: Vec<Packet>,
    taken_ms: Vec<u32>,
    handshakes: u32,
    /// Number of challenges and proofs, which start an association.
    begun: u32,
}

impl Side {
    fn new(key: &[u8; 16], profile: Profile, [sends_on, receives_from]: [u16; 2], seed: u64) -> Self {
        Self::of_line(key, KeyDomain::Link(0), profile, [sends_on, receives_from], seed)
    }

    fn of_line(
        key: &[u8; 16],
        line: KeyDomain,
        profile: Profile,
        [sends_on, receives_from]: [u16; 2],
        seed: u64,
    ) -> Self {
        let mut guard = SecureChannel::new(&Key::new(key), line, profile, seed);
        guard.set_send_channel(sends_on);
        guard.set_receive_channel(receives_from);
        Self {
            guard,
            sends_on,
            echo: u16::try_from(seed).expect("small"),
            counter: 0,
            refused: Vec::new(),
            taken: Vec::new(),
            taken_ms: Vec::new(),
            handshakes: 0,
            begun: 0,
        }
    }

    fn handshakes(&mut self, now_ms: u32) -> Vec<Vec<u8>> {
        let mut said = Vec::new();
        while let Some(handshake) = self.guard.handshake(now_ms) {
            said.push(handshake.to_vec());
        }
        self.handshakes += u32::try_from(said.len()).expect("few");
        let begins = said.iter().filter(|said| matches!(said[3], 4 | 5));
        self.begun += u32::try_from(begins.count()).expect("few");
        said
    }

    fn send(&mut self, now_ms: u32) -> Vec<Vec<u8>> {
        self.counter = after(self.counter);
        let words = (0..9).map(|word| u32::from(self.counter) + word).collect();
        let packet =
            Packet { channel: self.sends_on, counter: self.counter, echo: self.echo, content: 2, words };
        let mut sent = self.handshakes(now_ms);
        sent.extend(self.guard.seal(&packet.to_bytes(), &mut [0; MAX_CONTENT_BYTES]).map(<[u8]>::to_vec));
        sent
    }

    /// Collects its output.
    fn take(&mut self, now_ms: u32, content: &[u8], channel: u16) -> Vec<Vec<u8>> {
        match self.guard.open(now_ms, content, &mut [0; MAX_CONTENT_BYTES]) {
            Ok(Some(plain)) => {
                self.taken.push(Packet::from_bytes(plain, channel).expect("sealed content is complete"));
                self.taken_ms.push(now_ms);
            }
            Ok(None) => {}
            Err(error) => self.refused.push(error),
        }
        self.handshakes(now_ms)
    }

    /// The longest silence of this side.
    fn silence_ms(&self, from_ms: u32, to_ms: u32) -> u32 {
        let times = || [from_ms].into_iter().chain(self.taken_ms.iter().copied());
        times().zip(times().skip(1).chain([to_ms])).map(|(one, next)| next - one).max().expect("some")
    }

    fn forget(&mut self) {
        self.taken.clear();
        self.taken_ms.clear();
        self.refused.clear();
        (self.handshakes, self.begun) = (0, 0);
    }
}

/// Two sides, and the frames in transit.
struct Link {
    sides: [Side; 2],
    on_the_way: VecDeque<(u32, usize, Vec<u8>)>,
    now_ms: u32,
    delay_ms: u32,
}

/// Fate of a content on its way.
type Carrier<'c> = dyn FnMut(&[u8], usize) -> Vec<Vec<u8>> + 'c;

fn clean(content: &[u8], _: usize) -> Vec<Vec<u8>> {
    vec![content.to_vec()]
}

impl Link {
    fn new(profile: Profile, [left, right]: [u16; 2], delay_ms: u32) -> Self {
        let sides = [Side::new(KEY, profile, [left, right], 1), Side::new(KEY, profile, [right, left], 2)];
        Self { sides, on_the_way: VecDeque::new(), now_ms: 0, delay_ms }
    }

    /// A link that has run for a while.
    fn running(profile: Profile, channels: [u16; 2], delay_ms: u32) -> Self {
        let mut link = Self::new(profile, channels, delay_ms);
        link.run(10 * delay_ms + 50, &mut clean);
        link.sides.iter_mut().for_each(Side::forget);
        link
    }

    /// Runs `ms` milliseconds in which each side sends once per ms.
    fn run(&mut self, duration_ms: u32, carrier: &mut Carrier<'_>) {
        for _ in 0..duration_ms {
            self.now_ms += 1;
            for from in [0, 1] {
                let sent = self.sides[from].send(self.now_ms);
                self.put(1 - from, sent);
                self.deliver(carrier);
            }
        }
    }

    fn put(&mut self, to: usize, contents: Vec<Vec<u8>>) {
        let due_ms = self.now_ms + self.delay_ms;
        self.on_the_way.extend(contents.into_iter().map(|content| (due_ms, to, content)));
    }

    fn deliver(&mut self, carrier: &mut Carrier<'_>) {
        while let Some((_, to, content)) = self.on_the_way.pop_front_if(|(due_ms, ..)| *due_ms <= self.now_ms)
        {
            for arrived in carrier(&content, to) {
                self.give(to, &arrived);
            }
        }
    }

    /// Delivers a content to a side, whatever its origin.
    fn give(&mut self, to: usize, content: &[u8]) {
        let channel = self.sides[1 - to].sends_on;
        let said = self.sides[to].take(self.now_ms, content, channel);
        self.put(1 - to, said);
    }

    fn restart(&mut self, side: usize, profile: Profile, seed: u64) {
        let channels = [self.sides[side].sends_on, self.sides[1 - side].sends_on];
        self.sides[side] = Side::new(KEY, profile, channels, seed);
    }
}

/// Handshakes and packets with a tag, in frames of 8 bytes and in one frame of 64.
#[test]
fn can_carries_handshakes_and_tags() {
    let mut classic = Link::new(Profile::Short, CHANNELS, 0);
    let mut assemblers = [(); 2].map(|()| Assembler::authenticated());
    let mut most = 0;
    classic.run(500, &mut |content, to| {
        let channel = CHANNELS[1 - to];
        let data: Vec<_> = frames(content, channel).expect("of an accepted class").collect();
        most = most.max(data.len());
        data.iter().filter_map(|data| assemblers[to].push(data, channel).map(<[u8]>::to_vec)).collect()
    });
    assert_eq!(
        (most, assemblers.map(|assembler| assembler.dropped())),
        (10, [0, 0]),
        "one frame more than 9"
    );
    let mut fd = Link::new(Profile::Full, CHANNELS, 0);
    fd.run(500, &mut |content, _| {
        let data = can_fd::pack(content).expect("fits one frame");
        can_fd::unpack(&data).map(<[u8]>::to_vec).into_iter().collect()
    });
    for side in classic.sides.iter().chain(&fd.sides) {
        assert!(side.taken.len() >= 497, "{} taken, {:?}", side.taken.len(), side.refused);
    }
}

#[test]
fn loss_and_repetition_cost_what_they_hit_and_no_more() {
    for profile in PROFILES {
        let mut link = Link::running(profile, CHANNELS, 0);
        let mut random = Pcg64Mcg::seed_from_u64(5);
        let mut arrived = 0;
        link.run(20_000, &mut |content, _| {
            let copies = match random.next_u32() % 10 {
                0 => 0,
                1 => 2,
                _ => 1,
            };
            arrived += usize::from(copies > 0);
            vec![content.to_vec(); copies]
        });
        let taken: usize = link.sides.iter().map(|side| side.taken.len()).sum();
        assert_eq!(taken, arrived, "no handshake was needed");
    }
}

/// After any silence, contents older than the newest accepted one are refused.
#[test]
fn silence_makes_nothing_fresh_again() {
    for profile in PROFILES {
        let mut recorded = Vec::new();
        let mut link = Link::running(profile, CHANNELS, 0);
        link.run(300, &mut |content, to| {
            recorded.push((to, content.to_vec()));
            clean(content, to)
        });
        let mut at_ms = link.now_ms;
        for silence_s in [1, 31, 32, 33, 64, 100, 3600, 86_400, 2_147_483, 2_147_484, 4_294_960] {
            at_ms = at_ms.wrapping_add(silence_s * 1000);
            for (to, old) in &recorded {
                let channel = CHANNELS[1 - to];
                let before = link.sides[*to].taken.len();
                let _ = link.sides[*to].take(at_ms, old, channel);
                assert_eq!(link.sides[*to].taken.len(), before, "after {silence_s} s");
            }
            for from in [0, 1] {
                let said = link.sides[from].send(at_ms);
                assert_eq!(said.iter().filter(|said| said[0] != Class::Handshake as u8).count(), 1);
                for said in said {
                    let _ = link.sides[1 - from].take(at_ms, &said, CHANNELS[from]);
                }
                let taken = link.sides[1 - from].taken.last().expect("some");
                assert_eq!(
                    taken.counter, link.sides[from].counter,
                    "the genuine content is accepted after {silence_s} s"
                );
            }
        }
    }
}

proptest! {
    /// An attacker has recorded everything and replays it to any side at any time.
    #[test]
    fn a_side_takes_what_the_other_one_sealed_once_and_in_order(
        is_short in any::<bool>(),
        on_one_channel in any::<bool>(),
        steps in prop::collection::vec((0_u8..6, any::<prop::sample::Index>(), any::<bool>()), 1..200),
    ) {
        let profile = PROFILES[usize::from(is_short)];
        let mut link = Link::new(profile, if on_one_channel { [0, 0] } else { CHANNELS }, 0);
        let mut said: Vec<Vec<u8>> = Vec::new();
        for (action, place, is_right) in steps {
            link.now_ms += 3;
            let side = usize::from(is_right);
            if action < 3 {
                let contents = link.sides[side].send(link.now_ms);
                link.put(1 - side, contents);
                link.deliver(&mut |content, _| {
                    said.push(content.to_vec());
                    vec![content.to_vec()]
                });
            } else if !said.is_empty() {
                let content = place.get(said.as_slice()).clone();
                link.give(side, &content);
                link.deliver(&mut clean);
            }
        }
        for [sender, receiver] in [[0, 1], [1, 0]].map(|order| order.map(|side| &link.sides[side])) {
            prop_assert!(receiver.taken.is_sorted_by(|a, b| a.counter < b.counter));
            let senders = |packet: &Packet| packet.counter <= sender.counter && packet.echo == sender.echo;
            prop_assert!(receiver.taken.iter().all(senders));
        }
    }
}
