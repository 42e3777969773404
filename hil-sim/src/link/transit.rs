//! Measures packet delays of a link by their bytes, which are unique as packets are counted.

use std::collections::VecDeque;

/// Maximum packets in flight; older ones count as lost.
const MAX_AWAITED: usize = 1024;

/// Measures the delay from sending to arrival.
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
    /// Mean delay of received packets.
    pub mean: f64,
    /// Minimum delay.
    pub shortest: u64,
}

impl Transit {
    /// Records a packet sent in tick `now`.
    pub(super) fn sent(&mut self, now: u64, bytes: &[u8]) {
        if self.awaited.len() == MAX_AWAITED {
            self.awaited.pop_front();
        }
        self.awaited.push_back((now, bytes.to_vec()));
    }

    /// Records a packet received in tick `now`; duplicates and damaged packets are ignored.
    pub(super) fn arrived(&mut self, now: u64, bytes: &[u8]) {
        let place = self.awaited.iter().position(|(_, sent)| sent == bytes);
        let Some((sent, _)) = place.and_then(|place| self.awaited.remove(place)) else { return };
        self.arrived += 1;
        let ticks = now - sent;
        self.ticks += ticks;
        self.shortest_ticks = Some(self.shortest_ticks.map_or(ticks, |shortest| shortest.min(ticks)));
    }

    /// Returns the delays; `None` before the first arrival.
    #[expect(clippy::cast_precision_loss, reason = "far fewer ticks than 2^53")]
    pub(super) fn ticks(&self) -> Option<TransitTicks> {
        let shortest = self.shortest_ticks?;
        Some(TransitTicks { mean: self.ticks as f64 / self.arrived as f64, shortest })
    }
}
