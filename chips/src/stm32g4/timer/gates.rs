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
        let dead = u64::from(dead_time(self.registers.bits(BDTR, 0, 8))).div_ceil(self.prescaler + 1);
        let is_dead = self.counts_since_edge(channel).is_some_and(|counts| counts < dead);
        match self.reference(channel, self.phase) {
            Some(true) if !is_dead => Gate::High,
            Some(false) if !is_dead => Gate::Low,
            _ => Gate::Open,
        }
    }

    /// The next cycle in which the counter is at its top, in the middle of the time that the lower switches are closed; none
    /// while it does not count up and down.
    pub(in super::super) fn next_top(&self) -> Option<u64> {
        let is_right = self.is_counting() && self.is_up_and_down();
        is_right.then(|| self.cycle_of(self.distance(self.top())))
    }

    /// When the main output was switched on or off since this was last asked.
    pub(in super::super) fn take_switched(&mut self) -> Vec<(u64, bool)> {
        std::mem::take(&mut self.switched)
    }

    /// Counts since the reference of a channel has changed; none where it does not, with the compare value that is in effect.
    fn counts_since_edge(&self, channel: u32) -> Option<u64> {
        let period = self.period();
        let compare = self.compares.get(channel as usize).copied().map_or(0, u64::from);
        let (other, most) =
            if self.is_up_and_down() { (period - compare.min(period), self.top()) } else { (0, period) };
        let since = |edge: u64| (self.phase + period - edge % period) % period;
        (compare > 0 && compare < most).then(|| since(compare).min(since(other)))
    }
}
