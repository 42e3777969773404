//! Of what the device gets.

use crate::faulty_pair::LIMITS;
use dimsart_core::{SafetyReason, TickResult};

use crate::moment::Moment;

/// In a tick of a millisecond, N.
const STEP_N: f32 = LIMITS.rate_per_s * 1e-3;

/// Forces before, now and as commanded, axis by axis, N.
fn forces_n<'a>(moment: &'a Moment<'_>) -> impl Iterator<Item = [f32; 3]> + 'a {
    let given = moment.before.given_n.iter().zip(&moment.now.given_n).zip(&moment.now.commanded_n);
    given.map(|((before_n, now_n), commanded_n)| [*before_n, *now_n, *commanded_n])
}

/// The nearest to a force that range and rate allow.
fn nearest_n(before_n: f32, wanted_n: f32) -> f32 {
    let (low_n, high_n) = ((before_n - STEP_N).max(LIMITS.min), (before_n + STEP_N).min(LIMITS.max));
    if wanted_n < low_n {
        low_n
    } else if wanted_n > high_n {
        high_n
    } else {
        wanted_n
    }
}

pub(super) fn in_range(moment: &Moment<'_>) -> Option<bool> {
    Some(moment.now.given_n.iter().all(|now_n| (LIMITS.min..=LIMITS.max).contains(now_n)))
}

pub(super) fn within_rate(moment: &Moment<'_>) -> Option<bool> {
    // Rounding in f32: the sum of the last value and the step.
    let rounding_n = |before_n: f32, now_n: f32| f32::EPSILON * (before_n.abs() + now_n.abs());
    let is_within =
        |[before_n, now_n, _]: [f32; 3]| (now_n - before_n).abs() <= STEP_N + rounding_n(before_n, now_n);
    Some(forces_n(moment).all(is_within))
}

pub(super) fn as_commanded(moment: &Moment<'_>) -> Option<bool> {
    let is_free = moment.now.came == TickResult::Ran && moment.now.reason == SafetyReason::None;
    is_free.then(|| forces_n(moment).all(|[_, now_n, commanded_n]| now_n.to_bits() == commanded_n.to_bits()))
}

pub(super) fn nearest(moment: &Moment<'_>) -> Option<bool> {
    let is_limited = moment.now.came == TickResult::Ran && moment.now.reason.is_limit();
    let is_nearest = |[before_n, now_n, commanded_n]: [f32; 3]| {
        now_n.to_bits() == nearest_n(before_n, commanded_n).to_bits()
    };
    let is_cut = |[_, now_n, commanded_n]: [f32; 3]| now_n.to_bits() != commanded_n.to_bits();
    is_limited.then(|| forces_n(moment).all(is_nearest) && forces_n(moment).any(is_cut))
}

pub(super) fn to_zero(moment: &Moment<'_>) -> Option<bool> {
    let is_on_its_way =
        |(before_n, now_n): (&f32, &f32)| now_n.to_bits() == nearest_n(*before_n, 0.0).to_bits();
    moment
        .now
        .is_held_back()
        .then(|| moment.before.given_n.iter().zip(&moment.now.given_n).all(is_on_its_way))
}
