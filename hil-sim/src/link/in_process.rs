//! A modelled link within one process: delay, jitter, loss, duplication, reordering.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use super::{Link, Payload};
use crate::bus::Random;

/// Parameters of the link.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct InProcessParameters {
    /// Delay in ticks. A packet with delay 0 arrives in the same tick at a controller that is stepped later,
    /// otherwise in the next tick.
    pub delay_ticks: u32,
    /// Maximum additional delay in ticks, uniformly distributed, without overtaking.
    pub jitter_ticks: u32,
    /// Share of lost packets, 0 to 1.
    pub loss: f64,
    /// Share of duplicated packets, 0 to 1.
    pub duplication: f64,
    /// Share of reordered packets, 0 to 1: they are delayed by 1 to 4 further ticks.
    pub reordering: f64,
}

/// Maximum delay of a reordered packet, ticks.
const REORDERING_TICKS: u32 = 4;

/// Random seed.
#[derive(Debug)]
pub struct InProcess {
    parameters: InProcessParameters,
    random: Random,
    /// By time of arrival.
    in_flight: VecDeque<Flight>,
    last_arrival: u64,
}

#[derive(Debug, Clone)]
struct Flight {
    arrival: u64,
    carried: Payload,
}

impl InProcess {
    /// Creates a link with a random seed.
    #[must_use]
    pub fn new(parameters: InProcessParameters, seed: u64) -> Self {
        let random = Random::new(seed);
        Self { parameters, random, in_flight: VecDeque::new(), last_arrival: 0 }
    }

    /// Returns the arrival tick of a packet sent now.
    fn arrival(&mut self, now: u64) -> u64 {
        let jitter = self.random.uniform_integer(self.parameters.jitter_ticks);
        let on_time = (now + u64::from(self.parameters.delay_ticks) + jitter).max(self.last_arrival);
        if self.random.bernoulli(self.parameters.reordering) {
            on_time + 1 + self.random.uniform_integer(REORDERING_TICKS - 1)
        } else {
            self.last_arrival = on_time;
            on_time
        }
    }

    fn take_off(&mut self, arrival: u64, carried: Payload) {
        let flight = Flight { arrival, carried };
        if self.in_flight.back().is_none_or(|last| last.arrival <= arrival) {
            self.in_flight.push_back(flight);
        } else {
            let place = self.in_flight.partition_point(|other| other.arrival <= arrival);
            self.in_flight.insert(place, flight);
        }
    }
}

impl Link for InProcess {
    fn send(&mut self, now: u64, bytes: &[u8]) {
        self.send_payload(now, bytes.into());
    }

    fn receive(&mut self, now: u64, deliver: &mut dyn FnMut(&[u8])) {
        self.receive_payload(now, &mut |carried| deliver(&carried.into_bytes()));
    }

    fn send_payload(&mut self, now: u64, carried: Payload) {
        if self.random.bernoulli(self.parameters.loss) {
            return;
        }
        let arrival = self.arrival(now);
        if self.random.bernoulli(self.parameters.duplication) {
            self.take_off(arrival, carried.clone());
            let again = self.arrival(now);
            self.take_off(again, carried);
        } else {
            self.take_off(arrival, carried);
        }
    }

    fn receive_payload(&mut self, now: u64, deliver: &mut dyn FnMut(Payload)) {
        while let Some(flight) = self.in_flight.pop_front_if(|flight| flight.arrival <= now) {
            deliver(flight.carried);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sends packets numbered by their tick and returns (arrival, packet) pairs.
    fn run(parameters: InProcessParameters, ticks: u64) -> Vec<(u64, u64)> {
        let mut link = InProcess::new(parameters, 7);
        let mut arrived = Vec::new();
        for now in 0..ticks {
            link.send(now, &now.to_le_bytes());
            link.receive(now, &mut |bytes| {
                arrived.push((now, u64::from_le_bytes(bytes.try_into().unwrap())));
            });
        }
        arrived
    }

    #[test]
    fn a_clean_link_delays_by_exactly_its_ticks() {
        let arrived = run(InProcessParameters { delay_ticks: 5, ..Default::default() }, 100);
        assert_eq!(arrived.len(), 95);
        assert!(arrived.iter().all(|(arrival, packet)| arrival - packet == 5));
    }

    #[test]
    fn jitter_stays_in_its_range_and_keeps_the_order() {
        let arrived = run(InProcessParameters { jitter_ticks: 7, ..Default::default() }, 10_000);
        assert!(arrived.iter().all(|(arrival, packet)| (0..=7).contains(&(arrival - packet))));
        assert!(arrived.is_sorted_by(|a, b| a.1 < b.1));
        assert!(arrived.iter().any(|(arrival, packet)| arrival != packet));
    }

    #[test]
    fn loss_duplication_and_reordering_happen_as_often_as_asked() {
        let ticks = 100_000;
        let count = |parameters| run(parameters, ticks).len() as f64 / ticks as f64;
        let near = |found: f64, wanted: f64| (found - wanted).abs() < 0.006;
        assert!(near(count(InProcessParameters { loss: 0.1, ..Default::default() }), 0.9));
        assert!(near(count(InProcessParameters { duplication: 0.2, ..Default::default() }), 1.2));
        let arrived = run(InProcessParameters { reordering: 0.3, ..Default::default() }, ticks);
        let late = arrived.iter().filter(|(arrival, packet)| arrival > packet).count();
        assert!(near(late as f64 / ticks as f64, 0.3));
        assert!(!arrived.is_sorted_by(|a, b| a.1 < b.1), "nothing was overtaken");
    }

    #[test]
    fn the_same_seed_gives_the_same_run() {
        let parameters = InProcessParameters {
            delay_ticks: 2,
            jitter_ticks: 3,
            loss: 0.2,
            duplication: 0.1,
            reordering: 0.1,
        };
        assert_eq!(run(parameters, 1000), run(parameters, 1000));
    }
}
