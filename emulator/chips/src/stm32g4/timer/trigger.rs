//! Trigger outputs of timer 1, which start ADC conversions (RM0440, 28.3.29 and the fields MMS and MMS2 of
//! `TIM1_CR2`).

use super::{CCMR1, CEN, CHANNELS, CR1, CR2, Timer};

/// A trigger output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in super::super) enum Output {
    Trgo,
    Trgo2,
}

/// An edge of a trigger output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in super::super) struct Edge {
    pub(in super::super) output: Output,
    pub(in super::super) at: u64,
    pub(in super::super) is_rising: bool,
}

/// Source of a trigger output: a code of MMS or MMS2. Both fields have the same codes up to 7.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Select(u32);

impl Select {
    pub(super) const RESET: Self = Self(0);
    pub(super) const ENABLE: Self = Self(1);
    pub(super) const UPDATE: Self = Self(2);

    /// The channel whose reference is the source.
    fn channel(self) -> Option<u32> {
        self.0.checked_sub(4).filter(|channel| *channel < CHANNELS)
    }
}

impl Timer {
    /// Sources of TRGO and TRGO2.
    pub(super) fn selects(&self) -> [Select; 2] {
        let low = self.registers.bits(CR2, 4, 3);
        let high = self.registers.bits(CR2, 25, 1);
        [Select(high << 3 | low), Select(self.registers.bits(CR2, 20, 4))]
    }

    /// Returns a description of an output's source if it is not modelled.
    pub(in super::super) fn unknown_trigger(&self, output: Output) -> Option<String> {
        let [first, second] = self.selects();
        let (select, field) = match output {
            Output::Trgo => (first, "MMS"),
            Output::Trgo2 => (second, "MMS2"),
        };
        let is_known = match select.channel() {
            Some(channel) => self.reference(channel, self.phase).is_some(),
            None => matches!(select, Select::RESET | Select::ENABLE | Select::UPDATE),
        };
        (!is_known).then(|| format!("TIM1_CR2.{field} is {}: trigger source not modelled", select.0))
    }

    /// Reference signal of a channel (`OCxREF`) at a position in the period; `None` in a mode that is not
    /// modelled. Counting up, it is active below the compare value; counting down, also at the compare value
    /// (28.3.10 to 28.3.13).
    pub(super) fn reference(&self, channel: u32, phase: u64) -> Option<bool> {
        let place = CCMR1 + channel / 2 * 4;
        let first = channel % 2 * 8;
        let is_input = self.registers.bits(place, first, 2) != 0;
        let has_more = self.registers.has(place, 16 + first);
        if is_input || has_more {
            return None;
        }
        let compare = self.compares.get(channel as usize).copied().map_or(0, u64::from);
        let is_below = if self.is_up_and_down() {
            phase < compare || phase >= (2 * self.top()).saturating_sub(compare)
        } else {
            phase < compare
        };
        match self.registers.bits(place, first + 4, 3) {
            4 => Some(false),
            5 => Some(true),
            6 => Some(is_below),
            7 => Some(!is_below),
            _ => None,
        }
    }

    /// Counts until a reference that is a trigger source can change; `None` without such a source.
    pub(super) fn counts_to_edge(&self) -> Option<u64> {
        if !self.has_gates {
            return None;
        }
        let compares = self.selects().into_iter().filter_map(|select| {
            self.compares.get(select.channel()? as usize).map(|compare| u64::from(*compare))
        });
        let period = self.period();
        let distances = compares.flat_map(|compare| {
            let ways = [Some(compare), self.is_up_and_down().then(|| period.saturating_sub(compare))];
            ways.into_iter().flatten().map(|target| self.distance(target)).min()
        });
        distances.min()
    }

    /// Updates the outputs whose source is a level.
    pub(super) fn see_levels(&mut self, at: u64) {
        if !self.has_gates {
            return;
        }
        let selects = self.selects();
        for (place, (select, output)) in selects.into_iter().zip([Output::Trgo, Output::Trgo2]).enumerate() {
            let is_high = match select.channel() {
                Some(channel) => self.reference(channel, self.phase).unwrap_or(false),
                None => select == Select::ENABLE && self.registers.has(CR1, CEN),
            };
            if let Some(was_high) = self.levels.get_mut(place)
                && std::mem::replace(was_high, is_high) != is_high
            {
                self.edges.push(Edge { output, at, is_rising: is_high });
            }
        }
    }

    /// Pulses the outputs whose source is one of these events, for one cycle.
    pub(super) fn pulse(&mut self, events: &[Select], at: u64) {
        if !self.has_gates {
            return;
        }
        for (select, output) in self.selects().into_iter().zip([Output::Trgo, Output::Trgo2]) {
            if events.contains(&select) {
                self.edges.push(Edge { output, at, is_rising: true });
                self.edges.push(Edge { output, at: at + 1, is_rising: false });
            }
        }
    }

    /// Takes the edges of the outputs since the last call, in order.
    pub(in super::super) fn take_edges(&mut self) -> Vec<Edge> {
        std::mem::take(&mut self.edges)
    }
}
