//! What the packets of another process show of it: that it was restarted, or that it ticks at another rate.

use super::Side;
use crate::rig::{Rig, Station};
use crate::scenario::Scenario;

/// Share by which the rate of packets differs where sample periods do; clocks differ by far less.
const OTHER_RATE: f64 = 0.1;

/// Looks at the only station of a rig.
#[derive(Debug)]
pub(super) struct Peer {
    restarts: u32,
    restarts_s: Vec<f64>,
}

impl Peer {
    pub(super) fn new(rig: &Rig) -> Self {
        Self { restarts: restarts(rig), restarts_s: Vec::new() }
    }

    pub(super) fn look(&mut self, rig: &Rig) {
        let restarts = restarts(rig);
        if restarts != self.restarts {
            self.restarts = restarts;
            self.restarts_s.push(rig.time_s());
        }
    }

    /// In words, with the peer of `side`.
    pub(super) fn warnings(&self, rig: &Rig, scenario: &Scenario, side: Side) -> Vec<String> {
        let other = side.other().name();
        let restarts = self.restarts_s.iter().map(|time_s| {
            format!(
                "the {other} was restarted at {time_s:.3} s: figures are of two runs; start both sides again"
            )
        });
        let per_tick = rig.stations().first().and_then(|station| station.packets_per_tick(0));
        let expected = 1.0 / f64::from(scenario.link.every_ticks.unwrap_or(1));
        let is_other = |per_tick: &f64| (per_tick / expected - 1.0).abs() > OTHER_RATE;
        let rate = per_tick.filter(is_other).map(|per_tick| {
            let [found, expected] = [per_tick, expected].map(|share| share / scenario.sample_period_s);
            format!(
                "the {other} sends {found:.0} packets a second, {expected:.0} are expected: give both sides the same \
                 sample_period_s and link.every_ticks"
            )
        });
        restarts.chain(rate).collect()
    }
}

fn restarts(rig: &Rig) -> u32 {
    rig.stations().first().map_or(0, Station::restarts)
}
