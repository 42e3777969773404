//! How long packets take over a link, told by their bytes alone: no two are alike, for they are counted.

use std::collections::VecDeque;

/// Packets that are waited for at most; older ones are taken for lost.
const MOST_AWAITED: usize = 1024;

/// Measures what goes in and comes out.
#[derive(Debug, Default)]
pub(super) struct Transit {
    awaited: VecDeque<(u64, Vec<u8>)>,
    arrived: u64,
    ticks: u64,
    shortest_ticks: Option<u64>,
}

/// Ticks from sending to arrival.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TransitTicks {
    /// On average over what arrived.
    pub mean: f64,
    /// Of the fastest packet.
    pub shortest: u64,
}

impl Transit {
    /// Notes a packet that was sent in tick `now`.
    pub(super) fn sent(&mut self, now: u64, bytes: &[u8]) {
        if self.awaited.len() == MOST_AWAITED {
            self.awaited.pop_front();
        }
        self.awaited.push_back((now, bytes.to_vec()));
    }

    /// Notes what arrived in tick `now`; what came twice or damaged does not count.
    pub(super) fn arrived(&mut self, now: u64, bytes: &[u8]) {
        let place = self.awaited.iter().position(|(_, sent)| sent == bytes);
        let Some((sent, _)) = place.and_then(|place| self.awaited.remove(place)) else { return };
        self.arrived += 1;
        let ticks = now - sent;
        self.ticks += ticks;
        self.shortest_ticks = Some(self.shortest_ticks.map_or(ticks, |shortest| shortest.min(ticks)));
    }

    /// What was measured; none while nothing has arrived.
    #[expect(clippy::cast_precision_loss, reason = "far fewer ticks than 2^53")]
    pub(super) fn ticks(&self) -> Option<TransitTicks> {
        let shortest = self.shortest_ticks?;
        Some(TransitTicks { mean: self.ticks as f64 / self.arrived as f64, shortest })
    }
}
