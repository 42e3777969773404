//! Saves a scheme while the board ticks, then tries and confirms it over two restarts.

use std::io::{Read, Write};

use dimsart_link::protocol::{Refusal, StoreError};

use super::ticks::wait;
use super::{BoardEnvironment, Check};
use crate::connect::{ConnectError, Device, StoredSchemesReport};

const NAME: &str = "save, restart, confirm";
const EXPECTED: &str = "scheme on trial after the first restart, saved after the second";
const NEXT: &str =
    "run `show` and `events`; if the flash loses data, the flash is worn out or write-protected";
/// Maximum time from a restart to the first answer, `s`.
const START_S: f64 = 5.0;

/// Saves the current scheme, tries it and confirms it. Stops the scheme if the processor halts while it writes flash. Late
/// ticks are a separate check.
///
/// # Errors
/// [`ConnectError`] if the device does not answer.
pub fn save_and_restart<S: Read + Write>(
    device: &mut Device<S>,
    around: &mut impl BoardEnvironment,
) -> Result<Vec<Check>, ConnectError> {
    if !around.can_restart() {
        return Ok(vec![Check::not_run(NAME, "no restart command given (--restart)")]);
    }
    if device.stored_schemes()?.is_none() {
        return Ok(vec![Check::not_run(NAME, "the device stores no schemes")]);
    }
    let before = device.timing()?;
    let (saved, was_stopped) = write(device, Device::save)?;
    let after = device.timing()?;
    let mut checks = Vec::new();
    if let (Some(before), Some(after)) = (before, after) {
        let (late, overruns) =
            (after.late.saturating_sub(before.late), after.overruns.saturating_sub(before.overruns));
        let found = format!("{late} ticks started late, {overruns} overran");
        checks.push(match was_stopped {
            // The board announced it, and nothing moves.
            true => Check::not_run(
                "ticks in time while saving",
                format!("{found}; the scheme was stopped, because the processor halts while writing to flash"),
            ),
            false => Check::new(
                "ticks in time while saving",
                late + overruns == 0,
                found,
                "0 late, 0 overran",
                "set option bit DBANK to 1: the processor then reads one flash bank while it writes the other",
            ),
        });
    }
    checks.push(tried(device, around, &saved)?);
    Ok(checks)
}

fn tried<S: Read + Write>(
    device: &mut Device<S>,
    around: &mut impl BoardEnvironment,
    saved: &StoredSchemesReport,
) -> Result<Check, ConnectError> {
    let wrong = |found: String| Check::new(NAME, false, found, EXPECTED, NEXT);
    if saved.trial != "waits" {
        return Ok(wrong(format!("state after `save`: {saved}")));
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
        let kept = device.stored_schemes()?;
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
    Ok(Check::new(NAME, true, "scheme tried, confirmed and started", EXPECTED, NEXT))
}

/// Writes the board's flash, and stops its scheme first if the board requires it; returns whether it was stopped.
fn write<S: Read + Write>(
    device: &mut Device<S>,
    action: fn(&mut Device<S>) -> Result<StoredSchemesReport, ConnectError>,
) -> Result<(StoredSchemesReport, bool), ConnectError> {
    match action(device) {
        Err(ConnectError::Refused(Refusal::Store(StoreError::SchemeIsRunning))) => {}
        done => return Ok((done?, false)),
    }
    device.stop()?;
    let done = action(device);
    device.check()?;
    Ok((done?, true))
}
