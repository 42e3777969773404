//! Report of the safety stage.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use dimsart_core::Safety;

/// Maximum number of reasons in a report.
pub const MAX_REASONS: usize = 16;

/// Decisions of the [safety stage](Safety). The numbers are those of [`SafetyReason`](dimsart_core::SafetyReason); an
/// older host may not know all of them.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SafetyReport {
    /// Reason of the last tick; 0: none.
    pub reason: u8,
    /// Number of ticks per reason since the start.
    pub ticks: Vec<(u8, u32), MAX_REASONS>,
}

impl From<&Safety> for SafetyReport {
    fn from(safety: &Safety) -> Self {
        let counts = safety.counts().iter().filter(|(_, ticks)| *ticks > 0);
        let ticks = counts.map(|(reason, ticks)| (reason.number(), ticks)).take(MAX_REASONS).collect();
        Self { reason: safety.reason().number(), ticks }
    }
}
