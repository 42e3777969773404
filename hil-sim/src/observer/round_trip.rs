//! Round trip, measured by the first station of a rig on its link.
//!
//! Delay modules are added.

use core::ops::ControlFlow;
use std::collections::BTreeMap;

use dimsart_core::types;

use super::Observer;
use crate::link::TransitTicks;
use crate::outcome::Outcome;
use crate::rig::{Probe, Rig};

/// Delays of schemes and link in addition to the measurement.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ways {
    /// Delay modules, ticks; `None` if a scheme is unknown.
    pub(crate) delay_ticks: Option<u32>,
    /// Play-out at the receivers, in the order of the connections, ticks.
    pub(crate) playout_ticks: [u32; 2],
    /// Whether packets are sent less often than every tick: an echo waits for the next packet, the wave does not.
    pub(crate) waits: bool,
    /// Configured delay of the link, ticks.
    pub(crate) planned_ticks: u32,
    /// Whether both ends of the connections are in this process.
    pub(crate) has_both_ends: bool,
}

/// Counts round trips by their length.
#[derive(Debug)]
pub(crate) struct RoundTrips {
    probe: Probe,
    ticks_by_length: BTreeMap<u32, u64>,
    /// Last length, and its duration in ticks.
    last: (u32, u64),
    ways: Ways,
}

impl Observer for RoundTrips {
    fn observe(&mut self, rig: &Rig) -> ControlFlow<()> {
        let first = rig.stations().first();
        if let Some(&ticks) = first.and_then(|station| self.probe.words(station).first()) {
            if ticks != self.last.0 {
                *self.ticks_by_length.entry(self.last.0).or_default() += self.last.1;
                self.last = (ticks, 0);
            }
            self.last.1 += 1;
        }
        ControlFlow::Continue(())
    }

    fn report(&mut self, rig: &Rig, outcome: &mut Outcome) {
        let link_ticks = self.median().map(|echo_ticks| self.there_and_back_ticks(rig, echo_ticks));
        let ticks = link_ticks.zip(self.ways.delay_ticks).map(|(link, delay)| link.saturating_add(delay));
        outcome.round_trip_ticks = ticks;
    }
}

impl RoundTrips {
    pub(crate) fn new(ways: Ways) -> Self {
        let probe = Probe::new(types::LINK_ROUND_TRIP.first());
        Self { probe, ticks_by_length: BTreeMap::new(), last: (0, 0), ways }
    }

    /// Returns the wave's round trip on the link in ticks, for a median echo of `echo_ticks`.
    fn there_and_back_ticks(&self, rig: &Rig, echo_ticks: u32) -> u32 {
        let Ways { playout_ticks, waits, planned_ticks, has_both_ends, .. } = self.ways;
        // Play-out is relative to the fastest packet.
        let is_played_out = playout_ticks.iter().any(|ticks| *ticks > 0);
        if !has_both_ends || !(waits || is_played_out) {
            return echo_ticks;
        }
        let ways = rig.transit_ticks().zip(playout_ticks).map(|(transit, playout_ticks)| {
            let TransitTicks { mean, shortest } = transit?;
            #[expect(clippy::cast_precision_loss, reason = "far fewer ticks than 2^53")]
            Some(if playout_ticks > 0 { shortest as f64 } else { mean })
        });
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a cast saturates")]
        let measured = ways.sum::<Option<f64>>().map(|ticks| ticks.round() as u32);
        measured.unwrap_or(planned_ticks)
    }

    /// Returns the median, ticks; `None` without a reply.
    fn median(&mut self) -> Option<u32> {
        let mut ticks_by_length = core::mem::take(&mut self.ticks_by_length);
        *ticks_by_length.entry(self.last.0).or_default() += self.last.1;
        ticks_by_length.remove(&0);
        let half = ticks_by_length.values().sum::<u64>().div_ceil(2);
        let mut sum = 0;
        ticks_by_length
            .into_iter()
            .find(|(_, count)| {
                sum += count;
                sum >= half
            })
            .map(|(ticks, _)| ticks)
    }
}
