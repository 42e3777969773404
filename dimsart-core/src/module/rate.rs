//! Rates: a module runs in every tick, or in every n-th one.
//!
//! All n divide [`CYCLE_TICKS`]: after so many ticks the same modules run again. So who runs together with whom is known,
//! and modules that do not run in every tick are spread over the ticks that have least to do.

use crate::parameter::{Accepts, Entries, Parameter, Value};
use crate::signal::{Summary, Unit};

/// Number of the parameter `EVERY_TICKS`, which every module has beside its own ones: it runs in every tick, in every second
/// one, and so on.
pub const EVERY_TICKS: u8 = 127;

/// Ticks after which the same modules run again.
const CYCLE_TICKS: usize = 100;

/// Every how many ticks a module can run, and their names.
const PERIODS: [u8; NAMES.len()] = [1, 2, 4, 5, 10, 20, 50, 100];
const NAMES: &[&str] = &["1", "2", "4", "5", "10", "20", "50", "100"];

/// How often a module runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rate {
    /// It runs in every tick, in every second one, and so on.
    pub every_ticks: u8,
    /// Ticks before it runs next.
    pub left_ticks: u8,
}

impl Rate {
    /// Whether there are ticks in which a module of this rate and one of the other run both.
    pub(crate) fn meets(self, other: Self) -> bool {
        let (mut common, mut rest) = (self.every_ticks, other.every_ticks);
        while let Some(remainder) = common.checked_rem(rest) {
            (common, rest) = (rest, remainder);
        }
        self.left_ticks.abs_diff(other.left_ticks).is_multiple_of(common)
    }

    pub(crate) fn is_slow(self) -> bool {
        self.every_ticks > 1
    }

    /// A tick begins; whether the module runs in it.
    #[inline]
    pub(crate) fn is_due(&mut self) -> bool {
        let is_due = self.left_ticks == 0;
        self.left_ticks = if is_due { self.every_ticks } else { self.left_ticks }.wrapping_sub(1);
        is_due
    }
}

/// The parameter, as every module describes it.
pub(crate) const PARAMETER: Parameter = Parameter {
    name: "EVERY_TICKS",
    unit: Unit::Tick,
    accepts: Accepts::Choice(NAMES),
    entries: Entries::ONE,
    default: Some(Value::Choice(0)),
    is_structural: true,
    summary: Summary::new(
        "The module runs in every tick, in every second one, and so on; its outputs hold meanwhile.",
    ),
};

/// The parameter's value for a module that runs every so many ticks.
pub(crate) fn to_value(every_ticks: u8) -> Value {
    let place = (0..).zip(PERIODS).find(|(_, ticks)| *ticks == every_ticks);
    Value::Choice(place.map_or(0, |(place, _)| place))
}

/// Every how many ticks a module runs by a value that the parameter accepts.
pub(crate) fn from_value(value: Value) -> u8 {
    let place = if let Value::Choice(place) = value { place } else { 0 };
    PERIODS.get(usize::from(place)).copied().unwrap_or(1)
}

/// What the ticks of a cycle have to do beside what all of them have, from the next tick on.
pub(crate) struct Load([u32; CYCLE_TICKS]);

impl Load {
    pub(crate) const NONE: Self = Self([0; CYCLE_TICKS]);

    /// Adds what a module weighs in the ticks in which it runs.
    pub(crate) fn add(&mut self, rate: Rate, weight: u32) {
        let Rate { every_ticks, left_ticks } = rate;
        for load in self.0.iter_mut().skip(left_ticks.into()).step_by(usize::from(every_ticks).max(1)) {
            *load = load.saturating_add(weight);
        }
    }

    /// Where a module that fits there adds least to the ticks that have most to do; the first one of several such places.
    pub(crate) fn lightest(&self, every_ticks: u8, fits: impl Fn(&Rate) -> bool) -> Rate {
        let (mut best, mut least) = (Rate { every_ticks, left_ticks: 0 }, u32::MAX);
        for rate in (0..every_ticks).map(|left_ticks| Rate { every_ticks, left_ticks }).filter(fits) {
            let ticks = self.0.iter().skip(rate.left_ticks.into()).step_by(usize::from(every_ticks).max(1));
            let most = ticks.copied().max().unwrap_or(0);
            if most < least {
                (best, least) = (rate, most);
            }
        }
        best
    }
}
