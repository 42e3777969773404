//! One direction of a network path: rate, delay, burst losses, with or without reordering.
//!
//! Burst losses after Gilbert (1960) and Elliott (1963): the path is good or bad; it can change before each datagram,
//! and loses a share of the datagrams while bad. Bursts last `1/burst_exit_probability` datagrams on average; the path is bad for
//! `burst_entry_probability/(burst_entry_probability + burst_exit_probability)` of the time.

use std::collections::VecDeque;

use super::delay::{Delay, Delays};
use super::line::SerialLine;
use super::random::Random;
use super::traffic::{BusyInterval, Timeline};

const BITS_PER_BYTE: u32 = 8;

/// Parameters of a path.
#[derive(Debug, Clone, PartialEq)]
pub struct DatagramParameters {
    /// Bit rate of the bottleneck, `bit/s`.
    pub bits_per_s: u32,
    /// Header of each datagram, bytes.
    pub header_bytes: usize,
    /// Queue size of the bottleneck, bytes.
    pub queue_bytes: usize,
    /// Delay after the bottleneck.
    pub delay: Delay,
    /// Probability per datagram that a burst starts, 0 to 1.
    pub burst_entry_probability: f64,
    /// Probability per datagram that a burst ends, 0 to 1.
    pub burst_exit_probability: f64,
    /// Share of datagrams lost in a burst, 0 to 1.
    pub burst_loss: f64,
    /// Whether datagrams can overtake each other; otherwise they keep their order.
    pub overtaking: bool,
}

/// One direction.
#[derive(Debug)]
pub struct DatagramPath {
    parameters: DatagramParameters,
    line: SerialLine,
    random: Random,
    delays: Delays,
    is_bad: bool,
    /// By time of arrival, `ns`.
    in_flight: VecDeque<(u64, Vec<u8>)>,
    last_arrival_ns: u64,
    lost: u64,
    longest_ns: u64,
    timeline: Timeline,
}

impl DatagramPath {
    /// Creates a path with a random seed.
    #[must_use]
    pub fn new(parameters: DatagramParameters, seed: u64) -> Self {
        Self {
            line: SerialLine::new(parameters.bits_per_s, BITS_PER_BYTE, parameters.queue_bytes),
            random: Random::new(seed),
            delays: Delays::new(parameters.delay.clone()),
            parameters,
            is_bad: false,
            in_flight: VecDeque::new(),
            last_arrival_ns: 0,
            lost: 0,
            longest_ns: 0,
            timeline: Timeline::default(),
        }
    }

    /// Sends a datagram. Returns false if the queue is full.
    pub fn send(&mut self, now_ns: u64, bytes: &[u8]) -> bool {
        let length = bytes.len() + self.parameters.header_bytes;
        let Some(start_ns) = self.line.take(now_ns, length) else { return false };
        let out_ns = start_ns + self.line.lasts_ns(length);
        // Every datagram draws equally many random numbers.
        let is_in_burst = self.is_lost_in_burst();
        let delay_ns = self.delays.next_ns(&mut self.random).filter(|_| !is_in_burst);
        let is_error = delay_ns.is_none();
        self.timeline.add(BusyInterval {
            start_ns,
            end_ns: out_ns,
            sender: 0,
            label: String::new(),
            is_error,
        });
        let Some(delay_ns) = delay_ns else {
            self.lost += 1;
            return true;
        };
        let mut arrival_ns = out_ns + delay_ns;
        if !self.parameters.overtaking {
            arrival_ns = arrival_ns.max(self.last_arrival_ns);
            self.last_arrival_ns = arrival_ns;
        }
        self.longest_ns = self.longest_ns.max(arrival_ns - now_ns);
        let place = self.in_flight.partition_point(|(other_ns, _)| *other_ns <= arrival_ns);
        self.in_flight.insert(place, (arrival_ns, bytes.to_vec()));
        true
    }

    fn is_lost_in_burst(&mut self) -> bool {
        let change = if self.is_bad {
            self.parameters.burst_exit_probability
        } else {
            self.parameters.burst_entry_probability
        };
        self.is_bad ^= self.random.bernoulli(change);
        self.is_bad && self.random.bernoulli(self.parameters.burst_loss)
    }

    /// Passes datagrams that have arrived by `now_ns` to `deliver`, with their arrival in `ns`.
    pub fn receive(&mut self, now_ns: u64, mut deliver: impl FnMut(u64, &[u8])) {
        while let Some((arrival_ns, bytes)) =
            self.in_flight.pop_front_if(|(arrival_ns, _)| *arrival_ns <= now_ns)
        {
            deliver(arrival_ns, &bytes);
        }
    }

    /// Returns the number of lost datagrams.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// Returns the busy time of the bottleneck, `ns`.
    #[must_use]
    pub fn busy_ns(&self) -> u64 {
        self.line.busy_ns()
    }

    /// Returns the maximum time from sending to arrival, `ns`.
    #[must_use]
    pub fn longest_ns(&self) -> u64 {
        self.longest_ns
    }

    /// Returns the busy intervals of the bottleneck.
    #[must_use]
    pub fn timeline(&self) -> &Timeline {
        &self.timeline
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn clean() -> DatagramParameters {
        DatagramParameters {
            bits_per_s: 1_000_000,
            header_bytes: 28,
            queue_bytes: 1000,
            delay: Delay::Constant(0.01),
            burst_entry_probability: 0.0,
            burst_exit_probability: 1.0,
            burst_loss: 1.0,
            overtaking: false,
        }
    }

    /// Sends numbered 8-byte datagrams every millisecond and returns (arrival in ns, number).
    fn run(parameters: DatagramParameters, count: u64) -> Vec<(u64, u64)> {
        let mut path = DatagramPath::new(parameters, 21);
        for number in 0..count {
            path.send(number * 1_000_000, &number.to_le_bytes());
        }
        let mut arrived = Vec::new();
        path.receive(u64::MAX, |arrival_ns, bytes| {
            arrived.push((arrival_ns, u64::from_le_bytes(bytes.try_into().unwrap())));
        });
        arrived
    }

    #[test]
    fn a_datagram_takes_its_bits_and_the_delay() {
        let arrived = run(clean(), 100);
        let lasts_ns = 36 * 8 * 1000 + 10_000_000;
        assert!(
            arrived.iter().zip(0..).all(|(found, number)| *found == (number * 1_000_000 + lasts_ns, number))
        );
    }

    #[test]
    fn a_narrow_path_fills_up_and_refuses_what_has_no_room() {
        // 36 bytes at 144 kbit/s take 2 ms: in the long run, every second one is dropped.
        let arrived = run(DatagramParameters { bits_per_s: 144_000, queue_bytes: 360, ..clean() }, 1000);
        assert!((500..=510).contains(&arrived.len()), "{}", arrived.len());
        let longest_ns =
            arrived.iter().map(|(arrival_ns, number)| arrival_ns - number * 1_000_000).max().unwrap();
        assert_eq!(longest_ns, 30_000_000, "ten datagrams of 2 ms and the delay");
    }

    #[test]
    fn losses_come_in_bursts_of_the_length_asked_for() {
        let count = 200_000;
        let arrived = run(
            DatagramParameters { burst_entry_probability: 0.002, burst_exit_probability: 0.1, ..clean() },
            count,
        );
        let gaps: Vec<u64> =
            arrived.windows(2).map(|pair| pair[1].1 - pair[0].1 - 1).filter(|gap| *gap > 0).collect();
        let lost = 1.0 - arrived.len() as f64 / count as f64;
        let length = gaps.iter().sum::<u64>() as f64 / gaps.len() as f64;
        // p/(p + r), within four standard errors: bursts are (2 - r)/r as far apart as single losses.
        let share = 0.002 / 0.102;
        let error = (share * (1.0 - share) * (2.0 - 0.1) / 0.1 / count as f64).sqrt();
        assert!((lost - share).abs() < 4.0 * error, "{lost} for {share}");
        assert!((length - 10.0).abs() < 4.0 * 90.0_f64.sqrt() / (gaps.len() as f64).sqrt(), "{length}");
    }

    #[test]
    fn a_spread_of_delays_changes_the_order_only_where_overtaking_is_allowed() {
        let delay = Delay::Uniform { min_s: 0.01, width_s: 0.005 };
        let kept = run(DatagramParameters { delay: delay.clone(), ..clean() }, 1000);
        assert!(kept.is_sorted_by_key(|(_, number)| *number) && kept.len() == 1000);
        let free = run(DatagramParameters { delay, overtaking: true, ..clean() }, 1000);
        assert!(free.is_sorted_by_key(|(arrival_ns, _)| *arrival_ns));
        assert!(!free.is_sorted_by_key(|(_, number)| *number) && free.len() == 1000);
    }
}
