//! Which switches of the bridge behind timer 1 are closed.

use super::{BDTR, CCER, CHANNELS, MOE, Timer, dead_time};

/// A half bridge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in super::super) enum Gate {
    /// The upper switch is closed.
    High,
    /// The lower one is.
    Low,
    /// None is: its diodes lead.
    Open,
}

impl Timer {
    /// A half bridge now, by its channel. For a dead time after an edge none of its switches is closed.
    pub(in super::super) fn gate(&self, channel: u32) -> Gate {
        let is_driven = self.registers.has(CCER, 4 * channel) && self.registers.has(CCER, 4 * channel + 2);
        if channel >= CHANNELS || !is_driven || !self.registers.has(BDTR, MOE) || !self.is_counting() {
            return Gate::Open;
        }
        let dead = u64::from(dead_time(self.registers.bits(BDTR, 0, 8))) / (self.prescaler + 1);
        let before = (self.phase + self.period() - dead % self.period()) % self.period();
        match (self.reference(channel, before), self.reference(channel, self.phase)) {
            (Some(true), Some(true)) => Gate::High,
            (Some(false), Some(false)) => Gate::Low,
            _ => Gate::Open,
        }
    }
}
