//! A line with packet loss and jitter, in order.

use std::collections::VecDeque;

use dimsart_core::Packet;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

const TRANSIT_NS: u64 = 2_300_000;
/// Maximum additional delay of a packet.
const JITTER_NS: u64 = 2_000_000;
/// One packet in this number is lost.
const LOSS: u32 = 100;

pub(crate) struct Line {
    random: Pcg64Mcg,
    in_flight: VecDeque<(u64, Packet)>,
    pub(crate) sent: u64,
    pub(crate) lost: u64,
}

impl Line {
    pub(crate) fn new(seed: u64) -> Self {
        Self { random: Pcg64Mcg::seed_from_u64(seed), in_flight: VecDeque::new(), sent: 0, lost: 0 }
    }

    pub(crate) fn in_flight(&self) -> u64 {
        self.in_flight.len() as u64
    }

    pub(crate) fn send(&mut self, now_ns: u64, packet: Packet) {
        self.sent += 1;
        if self.random.next_u32().is_multiple_of(LOSS) {
            self.lost += 1;
            return;
        }
        let due_ns = now_ns + TRANSIT_NS + self.random.next_u64() % JITTER_NS;
        let last_ns = self.in_flight.back().map_or(0, |(due_ns, _)| *due_ns);
        self.in_flight.push_back((due_ns.max(last_ns), packet));
    }

    pub(crate) fn deliver(&mut self, now_ns: u64, mut deliver: impl FnMut(&Packet)) {
        while let Some((_, packet)) = self.in_flight.pop_front_if(|(due_ns, _)| *due_ns <= now_ns) {
            deliver(&packet);
        }
    }
}
