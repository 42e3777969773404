//! A scheme is saved while the board ticks, tried and confirmed over two restarts.

use std::io::{Read, Write};

use dimsart_link::protocol::{Refusal, StoreError};

use super::ticks::wait;
use super::{Check, Surroundings};
use crate::connect::{ConnectError, Device, KeptReport};

const NAME: &str = "save, restart, confirm";
const EXPECTED: &str = "on trial after one restart, saved after the next";
const NEXT: &str = "`show` and `events` say what became of it; flash that does not hold what is written is worn out or protected";
/// Longest time until a board answers behind a restart, `s`.
const START_S: f64 = 5.0;

/// Keeps the scheme as it is, tries it and confirms it. A board whose processor stands still while flash is written has its
/// scheme stopped for it. How many ticks came late meanwhile is a check of its own.
///
/// # Errors
/// [`ConnectError`] when the device does not answer.
pub fn save_and_restart<S: Read + Write>(
    device: &mut Device<S>,
    around: &mut impl Surroundings,
) -> Result<Vec<Check>, ConnectError> {
    if !around.can_restart() {
        return Ok(vec![Check::not_run(NAME, "nothing is given that starts the board over")]);
    }
    if device.kept()?.is_none() {
        return Ok(vec![Check::not_run(NAME, "the device keeps no schemes")]);
    }
    let before = device.timing()?;
    let (saved, was_stopped) = write(device, Device::save)?;
    let after = device.timing()?;
    let mut checks = Vec::new();
    if let (Some(before), Some(after)) = (before, after) {
        let (late, overruns) =
            (after.late.saturating_sub(before.late), after.overruns.saturating_sub(before.overruns));
        let found = format!("{late} ticks late, {overruns} overran");
        checks.push(match was_stopped {
            // It says itself that it will not, and nothing moves.
            true => Check::not_run(
                "ticks in time while saving",
                format!("{found}, with the scheme stopped: the board stands still while it writes"),
            ),
            false => Check::new(
                "ticks in time while saving",
                late + overruns == 0,
                found,
                "none late, none overran",
                "the flash's banks: option bit DBANK has to be 1, so that one is read while the other is written",
            ),
        });
    }
    checks.push(tried(device, around, &saved)?);
    Ok(checks)
}

fn tried<S: Read + Write>(
    device: &mut Device<S>,
    around: &mut impl Surroundings,
    saved: &KeptReport,
) -> Result<Check, ConnectError> {
    let wrong = |found: String| Check::new(NAME, false, found, EXPECTED, NEXT);
    if saved.trial != "waits" {
        return Ok(wrong(format!("after `save`: {saved}")));
    }
    for (number, wanted) in [(1, "trial"), (2, "saved")] {
        let begun_s = around.now_s();
        if let Err(error) = around.restart() {
            return Ok(wrong(format!("restart {number}: {error}")));
        }
        loop {
            wait(device, around, 0.1)?;
            match device.ticks() {
                Ok(_) => break,
                Err(error) if around.now_s() - begun_s > START_S => return Err(error),
                Err(_) => {}
            }
        }
        let kept = device.kept()?;
        let origin = kept.as_ref().map_or("nothing", |kept| kept.origin);
        if origin != wanted {
            return Ok(wrong(format!(
                "restart {number}: {}",
                kept.map_or(String::new(), |kept| kept.to_string())
            )));
        }
        if number == 1 {
            write(device, Device::confirm)?;
        }
    }
    Ok(Check::new(NAME, true, "tried, confirmed, and started with", EXPECTED, NEXT))
}

/// Has a board write its flash, with its scheme stopped if it says that it has to be; gives whether it was.
fn write<S: Read + Write>(
    device: &mut Device<S>,
    action: fn(&mut Device<S>) -> Result<KeptReport, ConnectError>,
) -> Result<(KeptReport, bool), ConnectError> {
    match action(device) {
        Err(ConnectError::Refused(Refusal::Store(StoreError::SchemeRuns))) => {}
        done => return Ok((done?, false)),
    }
    device.stop()?;
    let done = action(device);
    device.check()?;
    Ok((done?, true))
}
