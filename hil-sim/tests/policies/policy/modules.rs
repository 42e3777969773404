//! Of modules that fail.

use crate::faulty_pair::{Fault, Wrong};
use dimsart_core::{FaultCause, KindId};

use crate::moment::{DELAY, Moment, NAMES, SENDER, failing};

pub(super) fn bad_frame(moment: &Moment<'_>) -> Option<bool> {
    let now = moment.now;
    moment.is_frame_bad.then(|| now.is_held_back() && now.called.is_empty() && !now.has_sent)
}

pub(super) fn bad_write(moment: &Moment<'_>) -> Option<bool> {
    let mut wrong = moment.wrong.iter().filter_map(|Wrong { fault, axis, .. }| match fault {
        Fault::Writes(place, _) if *axis < moment.now.given_n.len() => Some(failing(*place)),
        _ => None,
    });
    let module = wrong.find(|module| moment.now.calls_of(*module) > 0)?;
    Some(moment.now.fallen.contains(&module))
}

pub(super) fn too_long(moment: &Moment<'_>) -> Option<bool> {
    let mut slow = moment.wrong.iter().filter_map(|wrong| match wrong.fault {
        Fault::TakesLonger(name, percent) if percent >= 30 => Some(name),
        _ => None,
    });
    let is_slow = |name: &&str| moment.now.called.iter().any(|called| name_of(called.kind) == *name);
    let name = slow.find(is_slow).filter(|_| moment.spare_cycles == 0)?;
    Some(moment.now.fallen.iter().any(|fallen| name_of(fallen.kind) == name))
}

fn name_of(kind: KindId) -> &'static str {
    NAMES.into_iter().find(|name| KindId::from_name(name) == kind).unwrap_or_default()
}

pub(super) fn stays_out(moment: &Moment<'_>) -> Option<bool> {
    let out = &moment.before.fallen;
    (!out.is_empty() && !moment.has_commanded()).then(|| {
        out.iter().all(|module| moment.now.calls_of(*module) == 0 && moment.now.fallen.contains(module))
    })
}

pub(super) fn sends_nothing(moment: &Moment<'_>) -> Option<bool> {
    // Who took too long has sent what is right, once more.
    let is_out = moment.now.fallen.contains(&SENDER) && moment.now.calls_of(SENDER) == 0;
    is_out.then_some(!moment.now.has_sent)
}

pub(super) fn blamed_rightly(moment: &Moment<'_>) -> Option<bool> {
    let fault = moment.now.module_fault.filter(|_| moment.before.module_fault.is_none())?;
    let is_cause = |wrong: &Wrong| match (fault.cause, wrong.fault) {
        (FaultCause::TimeExceeded { .. }, Fault::TakesLonger(name, _)) => name_of(fault.module.kind) == name,
        (FaultCause::InvalidOutput { .. }, Fault::Writes(place, _)) => fault.module == failing(place),
        _ => false,
    };
    // Gains at the end of their range make waves without bound.
    let has_grown = matches!(fault.cause, FaultCause::InvalidOutput { .. }) && moment.is_changed();
    Some(has_grown || moment.wrong.iter().any(is_cause))
}

pub(super) fn fallen_driver(moment: &Moment<'_>) -> Option<bool> {
    let is_driver = |module| ![failing(3), DELAY, SENDER].contains(module);
    let is_out = moment.now.fallen.iter().any(is_driver) && !moment.known.is_changed;
    is_out.then(|| moment.now.is_held_back())
}
