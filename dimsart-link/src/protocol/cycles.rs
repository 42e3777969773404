//! Execution times of a tick and its calls, from an image that measures them.

use serde::{Deserialize, Serialize};

/// Execution times in counts of a board's counter, including the time to read the counter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct CyclesReport {
    /// Measured runs; if 0, the counts are 0.
    pub runs: u32,
    /// Shortest run.
    pub min: u32,
    /// Mean run, rounded down.
    pub mean: u32,
    /// Longest run.
    pub max: u32,
    /// Unit of the counts: 0 for processor cycles; otherwise an emulator's time, with this many counts per
    /// 1024 instructions.
    pub per_1024_instructions: u32,
}
