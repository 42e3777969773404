//! Rates: a module runs every n ticks.
//!
//! All n divide [`CYCLE_TICKS`], after which the pattern repeats. So the modules that run in the same tick
//! are known, and modules with n above 1 are spread over the ticks with the least load.

use crate::parameter::{Parameter, ParameterShape, ParameterType, Value};
use crate::signal::{Summary, Unit};

/// Number of the parameter `EVERY_TICKS`, which every module has: the module's period in ticks.
pub const EVERY_TICKS: u8 = 127;

/// Period of the whole pattern in ticks.
const CYCLE_TICKS: usize = 100;

/// Allowed periods of a module in ticks, and their names.
const PERIODS: [u8; NAMES.len()] = [1, 2, 4, 5, 10, 20, 50, 100];
const NAMES: &[&str] = &["1", "2", "4", "5", "10", "20", "50", "100"];

/// Period and phase of a module.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rate {
    /// Period in ticks.
    pub every_ticks: u8,
    /// Ticks until the next run.
    pub ticks_until_run: u8,
}

impl Rate {
    /// Returns whether there are ticks in which both modules run.
    pub(crate) fn meets(self, other: Self) -> bool {
        let (mut common, mut rest) = (self.every_ticks, other.every_ticks);
        while let Some(remainder) = common.checked_rem(rest) {
            (common, rest) = (rest, remainder);
        }
        self.ticks_until_run.abs_diff(other.ticks_until_run).is_multiple_of(common)
    }

    pub(crate) fn is_slow(self) -> bool {
        self.every_ticks > 1
    }

    /// Starts a tick; returns whether the module runs in it.
    #[inline]
    pub(crate) fn is_due(&mut self) -> bool {
        let is_due = self.ticks_until_run == 0;
        self.ticks_until_run = if is_due { self.every_ticks } else { self.ticks_until_run }.wrapping_sub(1);
        is_due
    }
}

/// Description of the parameter.
pub(crate) const PARAMETER: Parameter = Parameter {
    name: "EVERY_TICKS",
    unit: Unit::Tick,
    accepts: ParameterType::Choice(NAMES),
    entries: ParameterShape::ONE,
    default: Some(Value::Choice(0)),
    is_structural: true,
    summary: Summary::new("Period of the module in ticks; its outputs hold their values in between."),
};

/// Converts a period to the parameter's value.
pub(crate) fn to_value(every_ticks: u8) -> Value {
    let place = (0..).zip(PERIODS).find(|(_, ticks)| *ticks == every_ticks);
    Value::Choice(place.map_or(0, |(place, _)| place))
}

/// Converts the parameter's value to a period.
pub(crate) fn from_value(value: Value) -> u8 {
    let place = if let Value::Choice(place) = value { place } else { 0 };
    PERIODS.get(usize::from(place)).copied().unwrap_or(1)
}

/// Load of the ticks in a cycle by modules that do not run in every tick, from the next tick on.
pub(crate) struct Load([u32; CYCLE_TICKS]);

impl Load {
    pub(crate) const NONE: Self = Self([0; CYCLE_TICKS]);

    /// Adds a module's cost to its ticks.
    pub(crate) fn add(&mut self, rate: Rate, weight: u32) {
        let Rate { every_ticks, ticks_until_run } = rate;
        for load in self.0.iter_mut().skip(ticks_until_run.into()).step_by(usize::from(every_ticks).max(1)) {
            *load = load.saturating_add(weight);
        }
    }

    /// Returns the phase with the lowest maximum load among those that fit; the first of several.
    pub(crate) fn lightest(&self, every_ticks: u8, fits: impl Fn(&Rate) -> bool) -> Rate {
        let (mut best, mut least) = (Rate { every_ticks, ticks_until_run: 0 }, u32::MAX);
        for rate in
            (0..every_ticks).map(|left_ticks| Rate { every_ticks, ticks_until_run: left_ticks }).filter(fits)
        {
            let ticks =
                self.0.iter().skip(rate.ticks_until_run.into()).step_by(usize::from(every_ticks).max(1));
            let most = ticks.copied().max().unwrap_or(0);
            if most < least {
                (best, least) = (rate, most);
            }
        }
        best
    }
}
