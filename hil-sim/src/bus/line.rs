//! A line with a bit rate and a queue; surplus bytes are refused.

use super::time::bits_to_ns;

/// One direction of a line.
#[derive(Debug, Clone)]
pub(super) struct SerialLine {
    bits_per_s: u32,
    bits_per_byte: u32,
    queue_bytes: usize,
    free_ns: u64,
    busy_ns: u64,
    longest_ns: u64,
}

impl SerialLine {
    pub(super) fn new(bits_per_s: u32, bits_per_byte: u32, queue_bytes: usize) -> Self {
        Self { bits_per_s, bits_per_byte, queue_bytes, free_ns: 0, busy_ns: 0, longest_ns: 0 }
    }

    /// Transmission time of bytes, `ns`.
    pub(super) fn lasts_ns(&self, bytes: usize) -> u64 {
        bits_to_ns(u64::from(self.bits_per_byte) * bytes as u64, self.bits_per_s)
    }

    /// Queues bytes and returns their start time; `None` if the queue is full.
    pub(super) fn take(&mut self, now_ns: u64, bytes: usize) -> Option<u64> {
        let start_ns = self.free_ns.max(now_ns);
        let end_ns = start_ns + self.lasts_ns(bytes);
        if end_ns - now_ns > self.lasts_ns(self.queue_bytes) {
            return None;
        }
        self.busy_ns += end_ns - start_ns;
        self.free_ns = end_ns;
        self.longest_ns = self.longest_ns.max(end_ns - now_ns);
        Some(start_ns)
    }

    /// Returns the maximum time from queueing to end of transmission, `ns`.
    pub(super) fn longest_ns(&self) -> u64 {
        self.longest_ns
    }

    pub(super) fn busy_ns(&self) -> u64 {
        self.busy_ns
    }
}
