//! What a tick and its calls took, as an image that measures says it.

use serde::{Deserialize, Serialize};

/// Counts of a board's counter that runs of one thing took, reading the counter included.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct CyclesReport {
    /// Runs that were measured; the counts are 0 as long as it is.
    pub runs: u32,
    /// Of the shortest run.
    pub least: u32,
    /// Of a run on average, rounded down.
    pub mean: u32,
    /// Of the longest run.
    pub greatest: u32,
    /// What the counter counts: 0 for cycles of the processor; otherwise the time of an emulator, of which 1024
    /// instructions take this many counts.
    pub per_1024_instructions: u32,
}
