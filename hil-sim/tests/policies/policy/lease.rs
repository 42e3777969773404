//! Of the lease.

use dimsart_core::{Command, TickResult};
use dimsart_link::protocol::{NO_CLIENT, Request};

use crate::moment::Moment;

pub(super) fn moves_with_it_alone(moment: &Moment<'_>) -> Option<bool> {
    (!moment.is_armed).then(|| moment.now.is_held_back())
}

pub(super) fn disarms_without_it_alone(moment: &Moment<'_>) -> Option<bool> {
    moment.is_armed.then(|| moment.now.came != TickResult::Disarmed)
}

pub(super) fn ends_by_a_fault(moment: &Moment<'_>) -> Option<bool> {
    moment.now.state.is_fault().then_some(moment.now.holder == NO_CLIENT)
}

pub(super) fn ends_by_a_stop(moment: &Moment<'_>) -> Option<bool> {
    let stop = moment.asked.iter().rposition(|asked| asked.is_taken_command(Command::Stop))?;
    let take = moment.asked.iter().rposition(crate::moment::Asked::is_taken_lease);
    take.is_none_or(|take| take < stop).then_some(moment.now.holder == NO_CLIENT)
}

pub(super) fn keeps_strangers_out(moment: &Moment<'_>) -> Option<bool> {
    // Nothing else was asked for: the holder has not let go meanwhile. Anybody may stop a device.
    let [asked] = moment.asked else { return None };
    let is_about = ![NO_CLIENT, asked.client].contains(&moment.before.holder)
        && asked.request != Request::Command(Command::Stop);
    is_about.then_some(!asked.is_taken)
}
