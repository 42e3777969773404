//! Counts packets that arrive at a controller: superseded packets, and the sender's rate and restarts.

use dimsart_core::{Packet, START_COUNTERS, counter_distance, is_newer};

/// Counters of all links.
#[derive(Debug, Default)]
pub(super) struct Arrivals {
    links: Vec<Arrival>,
    superseded: u32,
    restarts: u32,
}

/// Counters of one link.
#[derive(Debug, Default)]
struct Arrival {
    link: usize,
    /// Last packet of the present tick.
    last: Option<Packet>,
    /// Counter of the newest packet, its tick, and the number of packets sent since the first one.
    newest: u16,
    newest_tick: u64,
    sent: u64,
    first_tick: u64,
}

impl Arrivals {
    pub(super) fn begin_tick(&mut self) {
        self.links.iter_mut().for_each(|arrival| arrival.last = None);
    }

    /// Counts an accepted packet. A packet equal to the previous one is a duplicate and supersedes none.
    pub(super) fn add(&mut self, tick: u64, link: usize, packet: Packet) {
        let place = self.links.iter().position(|arrival| arrival.link == link).unwrap_or_else(|| {
            let (newest, first_tick) = (packet.counter, tick);
            self.links.push(Arrival { link, newest, newest_tick: tick, first_tick, ..Arrival::default() });
            self.links.len() - 1
        });
        let Some(arrival) = self.links.get_mut(place) else { return };
        self.superseded += u32::from(arrival.last.as_ref().is_some_and(|last| *last != packet));
        let counter = packet.counter;
        let has_restarted = counter <= START_COUNTERS && arrival.newest >= counter + START_COUNTERS;
        // Counting starts with the first tick; the handshake may be older.
        if has_restarted || tick == 0 {
            self.restarts += u32::from(has_restarted);
            (arrival.newest, arrival.sent, arrival.first_tick) = (counter, 0, tick);
        }
        if is_newer(counter, arrival.newest) {
            arrival.sent += u64::from(counter_distance(counter, arrival.newest));
            (arrival.newest, arrival.newest_tick) = (counter, tick);
        }
        arrival.last = Some(packet);
    }

    pub(super) const fn superseded(&self) -> u32 {
        self.superseded
    }

    pub(super) const fn restarts(&self) -> u32 {
        self.restarts
    }

    /// Returns the packets per tick of a link's sender, including lost packets; `None` after too few packets.
    pub(super) fn packets_per_tick(&self, link: usize) -> Option<f64> {
        let arrival = self.links.iter().find(|arrival| arrival.link == link)?;
        let ticks = arrival.newest_tick - arrival.first_tick;
        #[expect(clippy::cast_precision_loss, reason = "far fewer ticks than 2^53")]
        let share = arrival.sent as f64 / ticks.max(1) as f64;
        (ticks > u64::from(START_COUNTERS)).then_some(share)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn packets(arrivals: &mut Arrivals, ticks: std::ops::Range<u64>, counters: impl Iterator<Item = u16>) {
        for (tick, counter) in ticks.zip(counters) {
            arrivals.begin_tick();
            arrivals.add(tick, 0, Packet { counter, ..Packet::default() });
        }
    }

    #[test]
    fn a_sender_is_known_by_its_counters() {
        let mut arrivals = Arrivals::default();
        // Counter wrap-around, with every third packet lost.
        packets(&mut arrivals, 1..1001, (64_000..=u16::MAX).chain(101..5000));
        assert_eq!(
            (arrivals.packets_per_tick(0), arrivals.restarts(), arrivals.superseded()),
            (Some(1.0), 0, 0)
        );
        packets(&mut arrivals, 1001..2001, (65_001..=u16::MAX).step_by(3).chain((101..5000).step_by(3)));
        assert!(arrivals.packets_per_tick(0).is_some_and(|share| (share - 2.0).abs() < 0.01));
        // A restart at twice the rate; two reordered packets are no restart.
        packets(&mut arrivals, 3000..3400, [1, 3, 2].into_iter().chain((5..).step_by(2)));
        assert_eq!(arrivals.restarts(), 1);
        assert!(arrivals.packets_per_tick(0).is_some_and(|share| (share - 2.0).abs() < 0.02));
        let two = [7, 8, 8].map(|counter| Packet { counter, ..Packet::default() });
        arrivals.begin_tick();
        two.into_iter().for_each(|packet| arrivals.add(3400, 1, packet));
        assert_eq!(arrivals.superseded(), 1, "a duplicate supersedes none");
    }
}
