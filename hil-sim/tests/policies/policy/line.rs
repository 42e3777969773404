//! Of the line between the two.

use dimsart_core::TickResult;

use crate::moment::{Moment, RECEIVER, TIMEOUT_TICKS};

/// Far above what the account's sums round, J.
const NOTHING_J: f64 = 1e-9;

pub(super) fn silence_is_noticed(moment: &Moment<'_>) -> Option<bool> {
    let listens = moment.now.calls_of(RECEIVER) > 0;
    (listens && moment.is_silent()).then(|| moment.now.is_held_back())
}

pub(super) fn lost_is_silent(moment: &Moment<'_>) -> Option<bool> {
    let is_lost = |tick| matches!(tick, TickResult::LinkLost { .. });
    let is_new = is_lost(moment.now.came) && !is_lost(moment.before.came);
    is_new.then_some(moment.known.silent_ticks >= TIMEOUT_TICKS)
}

pub(super) fn is_passive(moment: &Moment<'_>) -> Option<bool> {
    // What is held, or in waves of another size, is not passive, and need not be.
    let mut ways = moment.known.energy_j.iter().zip(&moment.other.energy_j);
    let is_about = !moment.is_changed() && !moment.known.is_replayed;
    is_about.then(|| ways.all(|([_, taken_j], [brought_j, _])| *taken_j <= *brought_j + NOTHING_J))
}
