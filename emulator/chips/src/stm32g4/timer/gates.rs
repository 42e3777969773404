//! Closed switches of timer 1's bridge: from the pin levels (RM0440, 28, table of output control bits) and
//! the gate driver's input polarity.

use super::{BDTR, CCER, CR2, MOE, Timer, dead_time};

/// Bits of BDTR: off states while the main output is off (`OSSI`), and while it is on (`OSSR`).
const OSSI: u32 = 10;
const OSSR: u32 = 11;

/// A gate driver between the pins and the switches. A high level closes an upper switch. An undriven pin
/// closes no switch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct GateDriver {
    /// Whether a low level closes the lower switches, instead of a high level.
    pub is_low_side_inverted: bool,
}

impl GateDriver {
    /// Whether the upper and the lower switch are closed at these levels.
    fn closes(self, [upper, lower]: [Option<bool>; 2]) -> [bool; 2] {
        [upper == Some(true), lower == Some(!self.is_low_side_inverted)]
    }
}

/// State of a half bridge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in super::super) enum Gate {
    /// The upper switch is closed.
    High,
    /// The lower switch is closed.
    Low,
    /// Both switches are open: the diodes conduct.
    Open,
}

impl Timer {
    /// State of a half bridge now, by its channel. Both switches are open for the dead time after an edge.
    pub(in super::super) fn gate(&self, channel: u32, driver: GateDriver) -> Gate {
        let dead = u64::from(dead_time(self.registers.bits(BDTR, 0, 8))).div_ceil(self.prescaler + 1);
        let is_dead = self.counts_since_edge(channel).is_some_and(|counts| counts < dead);
        let active = match self.reference(channel, self.phase).filter(|_| self.is_counting()) {
            Some(reference) if !is_dead => [reference, !reference],
            _ => [false; 2],
        };
        match driver.closes(self.levels(channel, active)) {
            [true, false] => Gate::High,
            [false, true] => Gate::Low,
            _ => Gate::Open,
        }
    }

    /// Returns the fault of a half bridge with the present registers: both switches closed at once at any
    /// time of a period, or a switch closed while the bridge is off.
    pub(in super::super) fn misuse(&self, channel: u32, driver: GateDriver) -> Option<&'static str> {
        let is_off = !self.registers.has(BDTR, MOE);
        let levels =
            [[true, false], [false, true], [false, false]].map(|active| self.levels(channel, active));
        // After switch-off, both pins first have their inactive levels.
        let is_driven = self.levels(channel, [false; 2]) != [None; 2];
        let inactive = [0, 1].map(|side| Some(self.registers.has(CCER, 4 * channel + 2 * side + 1)));
        let mut closed =
            levels.into_iter().chain(is_driven.then_some(inactive)).map(|levels| driver.closes(levels));
        if closed.clone().any(|closed| closed == [true; 2]) {
            Some("both switches are closed at once")
        } else {
            (is_off && closed.any(|closed| closed.contains(&true)))
                .then_some("a switch is closed while the bridge is off")
        }
    }

    /// Levels of a channel's two pins, from the active states of its outputs; `None` for a pin that the timer
    /// does not drive.
    fn levels(&self, channel: u32, active: [bool; 2]) -> [Option<bool>; 2] {
        let is_enabled = [0, 1].map(|side| self.registers.has(CCER, 4 * channel + 2 * side));
        let is_any = is_enabled.contains(&true);
        [(0, active[0]), (1, active[1])].map(|(side, is_active)| {
            if !self.registers.has(BDTR, MOE) {
                let idle = self.registers.has(CR2, 8 + 2 * channel + side);
                return (is_any && self.registers.has(BDTR, OSSI)).then_some(idle);
            }
            let is_inverted = self.registers.has(CCER, 4 * channel + 2 * side + 1);
            if self.registers.has(CCER, 4 * channel + 2 * side) {
                // Enabled alone, the complementary output follows the reference without inversion.
                let is_alone = side == 1 && !is_enabled[0];
                Some((if is_alone { active[0] } else { is_active }) != is_inverted)
            } else {
                (is_any && self.registers.has(BDTR, OSSR)).then_some(is_inverted)
            }
        })
    }

    /// Next cycle with the counter at its maximum, in the middle of the on time of the lower switches; `None`
    /// unless it counts up and down.
    pub(in super::super) fn next_top(&self) -> Option<u64> {
        let is_right = self.is_counting() && self.is_up_and_down();
        is_right.then(|| self.cycle_of(self.distance(self.top())))
    }

    /// Takes the changes of the main output enable since the last call.
    pub(in super::super) fn take_output_enable_changes(&mut self) -> Vec<(u64, bool)> {
        std::mem::take(&mut self.switched)
    }

    /// Counts since the last edge of a channel's reference; `None` if the reference has no edges at the
    /// effective compare value.
    fn counts_since_edge(&self, channel: u32) -> Option<u64> {
        let period = self.period();
        let compare = self.compares.get(channel as usize).copied().map_or(0, u64::from);
        let (other, most) =
            if self.is_up_and_down() { (period - compare.min(period), self.top()) } else { (0, period) };
        let since = |edge: u64| (self.phase + period - edge % period) % period;
        (compare > 0 && compare < most).then(|| since(compare).min(since(other)))
    }
}
