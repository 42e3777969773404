//! Two sides with different clocks, each ticked by its own.

use std::collections::VecDeque;

use dimsart_core::{Packet, TickResult};

use crate::common::Bench;
use crate::common::way::Ends;
use test_requirements::length;

/// Maximum difference of two cheap oscillators: 500 ppm fast and 500 ppm slow.
const PERIODS_NS: [u64; 2] = [999_500, 1_000_500];
const TRANSIT_NS: u64 = 2_300_000;

/// One side: its controller, its next tick, and the packets in transit to it.
struct Side {
    controller: Bench,
    next_ns: u64,
    arriving: VecDeque<(u64, Packet)>,
    ticks_without: u64,
}

impl Side {
    fn new() -> Self {
        let controller = Ends::end("COMM_RXMOD TIMEOUT_TICKS 20");
        Self { controller, next_ns: 0, arriving: VecDeque::new(), ticks_without: 0 }
    }

    /// Runs a tick, in which the link must not be lost; returns the packet to the peer.
    fn tick(&mut self) -> Packet {
        while let Some((_, packet)) = self.arriving.pop_front_if(|(due_ns, _)| *due_ns <= self.next_ns) {
            self.controller.dimsart.receive(0, &packet.to_bytes()).unwrap();
        }
        let (tick, _) = self.controller.try_tick(&crate::common::words(&[1.0]));
        assert_eq!(tick, TickResult::Ran, "after {} ns", self.next_ns);
        self.ticks_without += u64::from(self.count("LINK_AGE") > 0);
        self.controller.dimsart.take_outgoing(0).unwrap()
    }

    fn count(&self, name: &str) -> u32 {
        self.controller.bits(name)[0]
    }
}

/// An hour in the long run: 3600 packets more are sent one way than received, and counters wrap 54 times.
#[test]
fn clocks_500_ppm_fast_and_slow_lose_no_link() {
    let duration_ns = 1_000_000_000 * length(300, 3600);
    let mut sides = [Side::new(), Side::new()];
    loop {
        let at = usize::from(sides[0].next_ns > sides[1].next_ns);
        let now_ns = sides[at].next_ns;
        if now_ns >= duration_ns {
            break;
        }
        let packet = sides[at].tick();
        sides[at].next_ns += PERIODS_NS[at];
        sides[1 - at].arriving.push_back((now_ns + TRANSIT_NS, packet));
        if now_ns > 10 * TRANSIT_NS {
            let round_trip = sides[at].count("LINK_ROUND_TRIP");
            assert!((4..=8).contains(&round_trip), "{round_trip} ticks after {now_ns} ns");
        }
    }
    let [fast, slow] = sides;
    let more = duration_ns / PERIODS_NS[0] - duration_ns / PERIODS_NS[1];
    println!(
        "{more} packets too many; the slow side lost {}, the fast one {}",
        slow.count("LINK_LOST"),
        fast.count("LINK_LOST")
    );
    // The slow side counts the excess packets; the fast side misses as many.
    assert!(u64::from(slow.count("LINK_LOST")).abs_diff(more) <= 2);
    assert!(fast.ticks_without.abs_diff(more) <= 5);
    assert_eq!(fast.count("LINK_LOST"), 0);
    assert!(slow.ticks_without <= 5);
}
