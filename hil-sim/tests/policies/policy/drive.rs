//! Of the drive's state.

use dimsart_core::{Command, DriveState, TickResult};
use dimsart_link::protocol::Request;

use crate::moment::{DELAY, Moment, SENDER, failing};

/// What a tick can lead to without a reset, by the figure of CiA 402: a state that is only passed shows as the one behind
/// it.
fn follows(before: DriveState, now: DriveState) -> bool {
    use DriveState as On;
    match before {
        // 2, 3, 4: both at once. 13, 14: a fault of a device that stands still is over with its reaction.
        On::SwitchOnDisabled => {
            matches!(now, On::SwitchOnDisabled | On::OperationEnabled | On::FaultReactionActive | On::Fault)
        }
        // 11 and 12, 13 and 14; 16: the lease is taken again.
        On::OperationEnabled | On::QuickStopActive => {
            !matches!(now, On::NotReadyToSwitchOn | On::ReadyToSwitchOn | On::SwitchedOn)
        }
        On::FaultReactionActive => matches!(now, On::FaultReactionActive | On::Fault),
        On::Fault => now == On::Fault,
        On::NotReadyToSwitchOn | On::ReadyToSwitchOn | On::SwitchedOn => false,
    }
}

pub(super) fn transitions(moment: &Moment<'_>) -> Option<bool> {
    let before = moment.before.state;
    let is_reset = moment.has_taken(Command::Reset) && before == DriveState::Fault;
    let before = if is_reset { DriveState::SwitchOnDisabled } else { before };
    Some(follows(before, moment.now.state))
}

pub(super) fn latches(moment: &Moment<'_>) -> Option<bool> {
    let Moment { before, now, .. } = moment;
    let is_latched = before.state.is_fault() && !moment.has_taken(Command::Reset);
    is_latched.then(|| now.state.is_fault() && (now.came, now.reason) == (before.came, before.reason))
}

pub(super) fn enables(moment: &Moment<'_>) -> Option<bool> {
    let moves = moment.before.state.is_fault() && moment.now.came == TickResult::Ran;
    let reset = || moment.asked.iter().position(|asked| asked.is_taken_command(Command::Reset));
    let take = || moment.asked.iter().rposition(crate::moment::Asked::is_taken_lease);
    moves.then(|| reset().zip(take()).is_some_and(|(reset, take)| reset < take))
}

pub(super) fn refuses_reset(moment: &Moment<'_>) -> Option<bool> {
    let wants = moment.asked.iter().any(|asked| asked.request == Request::Command(Command::Reset));
    let is_about = moment.before.state == DriveState::FaultReactionActive && wants;
    is_about.then(|| !moment.has_taken(Command::Reset))
}

pub(super) fn reacts_while_moving(moment: &Moment<'_>) -> Option<bool> {
    let reacts = matches!(moment.now.state, DriveState::FaultReactionActive | DriveState::QuickStopActive);
    let moves = moment.now.given_n.iter().any(|now_n| now_n.abs() > 0.0);
    moment.now.is_held_back().then_some(reacts == moves)
}

/// What no input of the device depends on.
fn only_sends(moment: &Moment<'_>) -> bool {
    moment.now.fallen.iter().all(|module| [failing(3), DELAY, SENDER].contains(module))
}

pub(super) fn held_back_for_a_reason(moment: &Moment<'_>) -> Option<bool> {
    let Moment { before, now, .. } = moment;
    let is_latched = before.state.is_fault() && !moment.has_taken(Command::Reset);
    let is_refused = moment.is_frame_bad || !now.is_running || !only_sends(moment);
    let is_silent = moment.known.silent_ticks >= crate::moment::TIMEOUT_TICKS;
    // Modules begin in the tick after a link's first packet.
    let is_silent = is_silent || matches!(before.came, TickResult::LinkDown { .. });
    let has_reason = !moment.is_armed || is_latched || is_refused || is_silent;
    (!has_reason).then(|| now.came == TickResult::Ran)
}

pub(super) fn stopped_is_still(moment: &Moment<'_>) -> Option<bool> {
    (!moment.now.is_running).then(|| moment.now.is_held_back() && moment.now.called.is_empty())
}
