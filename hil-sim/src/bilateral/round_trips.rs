//! How long packets take there and back, as the first station of a rig measures it on its link.
//!
//! Delay modules lie behind the link; what they add is [`Chain::delay_ticks`](crate::bilateral::chain::Chain::delay_ticks).

use std::collections::BTreeMap;

use dimsart_core::types;

use crate::rig::{Probe, Rig};

/// Counts round trips by their length.
#[derive(Debug)]
pub struct RoundTrips {
    probe: Probe,
    ticks_by_length: BTreeMap<u32, u64>,
    /// Length last seen, and for how many ticks.
    last: (u32, u64),
}

impl Default for RoundTrips {
    fn default() -> Self {
        let probe = Probe::new(types::LINK_ROUND_TRIP.first());
        Self { probe, ticks_by_length: BTreeMap::new(), last: (0, 0) }
    }
}

impl RoundTrips {
    /// Adds the present tick.
    pub fn add(&mut self, rig: &Rig) {
        let Some(&ticks) = rig.stations().first().and_then(|station| self.probe.words(station).first())
        else {
            return;
        };
        if ticks != self.last.0 {
            *self.ticks_by_length.entry(self.last.0).or_default() += self.last.1;
            self.last = (ticks, 0);
        }
        self.last.1 += 1;
    }

    /// The median over the ticks in which it was known, ticks; none when nothing ever came back.
    #[must_use]
    pub fn median(mut self) -> Option<u32> {
        *self.ticks_by_length.entry(self.last.0).or_default() += self.last.1;
        self.ticks_by_length.remove(&0);
        let half = self.ticks_by_length.values().sum::<u64>().div_ceil(2);
        let mut sum = 0;
        self.ticks_by_length
            .into_iter()
            .find(|(_, count)| {
                sum += count;
                sum >= half
            })
            .map(|(ticks, _)| ticks)
    }
}
