//! Of what is counted and logged.

use dimsart_core::{Command, SafetyReason, TickResult};
use dimsart_link::EventKind;

use crate::moment::Moment;

/// Number of the tick as events have it.
fn tick_of(ticks: u64) -> u32 {
    u32::try_from(ticks % (1 << 32)).unwrap()
}

/// Whether a tick came to what the one before did not, or to a fault behind a reset.
fn is_new(moment: &Moment<'_>) -> bool {
    let [before, now] = [moment.before, moment.now].map(|seen| seen.came.reason());
    now != before || now.is_fault() && moment.has_taken(Command::Reset)
}

pub(super) fn reason_is_logged(moment: &Moment<'_>) -> Option<bool> {
    let (number, tick) = (moment.now.came.reason().number(), tick_of(moment.now.ticks));
    is_new(moment).then(|| moment.now.events.iter().any(|event| (event.what, event.tick) == (number, tick)))
}

pub(super) fn nothing_else_is_logged(moment: &Moment<'_>) -> Option<bool> {
    let now = moment.now;
    let reset = EventKind::Reset as u8;
    let changed = EventKind::SchemeChange as u8;
    let cut_out = EventKind::ModuleIsolated as u8;
    let count = |command| moment.asked.iter().filter(|asked| asked.is_taken_command(command)).count();
    let logged = |what: u8| now.events.iter().filter(|event| event.what == what).count();
    let is_about_this_tick = |what: u8| {
        what == now.came.reason().number() && is_new(moment) || what == cut_out && !now.fallen.is_empty()
    };
    (!now.events.is_empty()).then(|| {
        logged(reset) == count(Command::Reset)
            && logged(changed) == count(Command::Commit)
            && now
                .events
                .iter()
                .filter(|event| ![reset, changed].contains(&event.what))
                .all(|event| event.tick == tick_of(now.ticks) && is_about_this_tick(event.what))
    })
}

pub(super) fn counters_rise(moment: &Moment<'_>) -> Option<bool> {
    let Moment { before, now, .. } = moment;
    let refused = u32::from(moment.is_frame_bad);
    let new_events = u32::try_from(now.events.len()).unwrap();
    Some(
        now.ticks == before.ticks + 1
            && now.refused_ticks == before.refused_ticks + refused
            && now.last_event == before.last_event + new_events,
    )
}

pub(super) fn counted_once(moment: &Moment<'_>) -> Option<bool> {
    let Moment { before, now, .. } = moment;
    let is_right = |(reason, ticks): (SafetyReason, u32)| {
        let more = ticks.checked_sub(before.counts.tick_count(reason));
        if reason.is_limit() {
            matches!(more, Some(0 | 1))
        } else {
            more == Some((reason == now.reason).into())
        }
    };
    let tells_why = now.came == TickResult::Ran || now.reason == now.came.reason();
    Some(tells_why && now.counts.iter().all(is_right))
}
