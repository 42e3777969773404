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
        self.ticks += now - sent;
    }

    /// The average, ticks; none while nothing has arrived.
    #[expect(clippy::cast_precision_loss, reason = "far fewer ticks than 2^53")]
    pub(super) fn mean_ticks(&self) -> Option<f64> {
        (self.arrived > 0).then(|| self.ticks as f64 / self.arrived as f64)
    }
}
