//! Why the device does not get what the scheme commands, in numbers.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use dimsart_core::Safety;

/// Most reasons of a report.
pub const MAX_REASONS: usize = 16;

/// What the [safety stage](Safety) has decided. Its numbers are those of [`Reason`](dimsart_core::Reason); a host may be older
/// than a device and not know all of them.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SafetyReport {
    /// Reason of the last tick; 0 for none.
    pub reason: u8,
    /// Every reason that ticks have had since the start, and how many.
    pub ticks: Vec<(u8, u32), MAX_REASONS>,
}

impl From<&Safety> for SafetyReport {
    fn from(safety: &Safety) -> Self {
        let counts = safety.counts().iter().filter(|(_, ticks)| *ticks > 0);
        let ticks = counts.map(|(reason, ticks)| (reason.number(), ticks)).take(MAX_REASONS).collect();
        Self { reason: safety.reason().number(), ticks }
    }
}
