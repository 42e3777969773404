//! Checks that only read from a board.

use std::io::{Read, Write};

use boards::BOARDS;
use dimsart_core::SafetyReason;
use dimsart_core::stamp::UNSTAMPED_SUFFIX;
use dimsart_link::protocol::{NO_CLIENT, PROTOCOL_VERSION};
use dimsart_link::{EventKind, StartCause};

use super::at_rest::{self, Looks};
use super::{BoardEnvironment, Check, observe_ticks};
use crate::connect::{
    ConnectError, Device, Events, Faults, StatusReport, StoredSchemesReport, TickTimingReport,
};

/// Time to watch ticks, `s`.
const WATCHED_S: f64 = 1.0;

/// Examines a board for about a second, without a lease, motion or changes. `name` is the expected board.
///
/// # Errors
/// [`ConnectError`] if the device stops answering.
pub fn examine<S: Read + Write>(
    device: &mut Device<S>,
    around: &impl BoardEnvironment,
    name: Option<&str>,
) -> Result<Vec<Check>, ConnectError> {
    let begun_s = around.now_s();
    device.ticks()?;
    let answer_ms = 1e3 * (around.now_s() - begun_s);
    let mut checks = vec![
        Check::new("answers", true, format!("answer in {answer_ms:.1} ms"), "an answer", ""),
        protocol(device.identity().protocol_version),
        board(&device.identity().device, name),
    ];
    let before = device.status_report()?;
    checks.push(stamp(&device.identity().image, before.timing.as_ref()));
    checks.push(start(&device.events()?));
    checks.push(scheme(before.schemes.as_ref()));
    let mut looks = Looks::begin(device)?;
    checks.extend(observe_ticks(device, around, WATCHED_S)?.0);
    looks.look(device)?;
    let after = device.status_report()?;
    // A missing peer is not a fault here.
    let is_wrong = |reason: &SafetyReason| reason.is_fault() && *reason != SafetyReason::LinkDown;
    let reason = device.reason()?.filter(is_wrong).is_some();
    checks.push(faults(&device.faults()?, reason));
    let holder = [&before, &after].into_iter().find_map(holder);
    let info = BOARDS.iter().find(|board| board.name == device.identity().device);
    checks.extend(at_rest::checks(&looks, info, holder));
    Ok(checks)
}

fn protocol(theirs: u16) -> Check {
    Check::new(
        "protocol",
        theirs == PROTOCOL_VERSION,
        theirs.to_string(),
        format!("{PROTOCOL_VERSION}, the version of this program"),
        "use the `dimsart` of the image's version, or flash an image of this version",
    )
}

fn board(found: &str, wanted: Option<&str>) -> Check {
    match wanted {
        Some(wanted) => Check::new(
            "board",
            found == wanted,
            found,
            wanted,
            "give the port of the expected board, or flash the image of the expected board",
        ),
        None => Check::new("board", true, found, "a board name", ""),
    }
}

/// The client with the lease.
fn holder(status: &StatusReport) -> Option<u8> {
    status.lease.map(|lease| lease.holder).filter(|holder| *holder != NO_CLIENT)
}

fn stamp(image: &str, timing: Option<&TickTimingReport>) -> Check {
    let name = "image";
    let limit = timing.and_then(|timing| timing.limit_cycles);
    let is_unstamped = image.ends_with(UNSTAMPED_SUFFIX);
    if !is_unstamped && limit.is_none() {
        return Check::not_run(
            name,
            format!("{image}: no stamp and no tick limit, as on a simulated controller"),
        );
    }
    let limit = limit.map_or(String::new(), |limit| format!(", tick limit {limit} cycles"));
    Check::new(
        name,
        !is_unstamped,
        format!("{image}{limit}"),
        "an image stamped with module costs",
        "stamp the image with `dimsart stamp IMAGE`, or flash a stamped image with `cargo xtask flash BOARD`",
    )
}

fn start(events: &Events) -> Check {
    let name = "start";
    let is = |what: u8, kind: EventKind| what == kind as u8;
    let Some(place) = events.0.iter().rposition(|event| is(event.what, EventKind::Started)) else {
        return Check::not_run(
            name,
            "no start event in the log: the device stores no events, or newer events overwrote the start",
        );
    };
    let (before, last) = events.0.split_at(place);
    let Some(started) = last.first() else { return Check::not_run(name, "the device stores no events") };
    let stop = before
        .last()
        .filter(|event| is(event.what, EventKind::Panic) || is(event.what, EventKind::Exception));
    let found = match stop {
        Some(stop) => format!("{} after a {} in tick {}", started.text, stop.name, stop.tick),
        None => started.text.clone(),
    };
    Check::new(
        name,
        stop.is_none() && started.detail != StartCause::Watchdog as u32,
        found,
        "start by power-on, reset pin or flashing",
        "read the board's log (`cargo xtask flash BOARD`) and run `events`; see events 128 to 133 in docs/faults.md",
    )
}

fn scheme(kept: Option<&StoredSchemesReport>) -> Check {
    let name = "scheme";
    let Some(kept) = kept else { return Check::not_run(name, "the device stores no schemes") };
    let next = match (kept.origin, kept.trial) {
        ("none", _) => "no scheme matches this device: run `faults`",
        (_, "waits") => "restart the board to start the scheme on trial, or run `rollback`",
        (_, "tried") => "run `confirm` to keep the scheme on trial, or `rollback`",
        _ => "`save` a matching scheme, restart the board and `confirm` the scheme",
    };
    Check::new(
        name,
        kept.origin != "none" && kept.reason.is_none() && kept.trial == "none",
        kept.to_string().replace('\n', "; "),
        "the saved or built-in scheme, no scheme on trial",
        next,
    )
}

fn faults(faults: &Faults, has_fault: bool) -> Check {
    let mut found = vec![faults.state.clone()];
    found.extend(faults.cut_out.clone());
    found.extend(faults.findings.iter().filter(|finding| finding.is_fault).map(ToString::to_string));
    if let Some(first) = &faults.first_fault {
        found.push(format!("first fault in tick {}: {}", first.tick, first.reason));
    }
    Check::new(
        "faults",
        !has_fault && faults.faults == 0 && faults.cut_out.is_none(),
        found.join("; "),
        "no active fault",
        "look up the fault's number in docs/faults.md and correct the fault",
    )
}
