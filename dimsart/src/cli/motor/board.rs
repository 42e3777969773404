//! The motor configuration of a board: show, set, forget, identify.

use std::io::Write;
use std::path::Path;
use std::process::ExitCode;
use std::thread;
use std::time::Duration;

use drive::{Configuration, MotorEstimate};

use super::super::Ending;
use super::super::line::Device;
use super::print_found;
use crate::motor;

/// Polling interval of an identification.
const PAUSE: Duration = Duration::from_millis(20);

pub(super) fn show(device: &mut Device, port: &str, out: &mut impl Write) -> Ending {
    let state = device.motor()?;
    let whose = if state.is_stored {
        "configuration stored on the board"
    } else {
        "configuration of the image, none is stored on the board"
    };
    match state.fallback {
        Some(reason) if state.is_stored => {
            writeln!(out, "# {port}: configuration stored on the board, BUT {reason}.")?
        }
        Some(reason) => writeln!(
            out,
            "# {port}: configuration of the image, THE STORED CONFIGURATION WAS REJECTED: {reason}."
        )?,
        None => writeln!(out, "# {port}: {whose}.")?,
    }
    if state.is_restart_pending {
        writeln!(
            out,
            "# The configuration was changed after the board started: the next start uses the new configuration."
        )?;
    }
    write!(out, "{}", motor::text(&state.configuration))?;
    Ok(ExitCode::SUCCESS)
}

pub(super) fn set(device: &mut Device, file: &Path, restart: bool, out: &mut impl Write) -> Ending {
    let mut told = motor::read(file, super::warn)?;
    let now = device.motor()?.configuration;
    if told.inverter != now.inverter {
        eprintln!(
            "dimsart: note: [inverter] of {} differs from the board and is ignored: the board's values are used",
            file.display()
        );
        told.inverter = now.inverter;
        told.check().map_err(|error| format!("{}: {error}", file.display()))?;
    }
    keep(device, &now, &told, restart, out)
}

pub(super) fn forget(device: &mut Device, restart: bool, out: &mut impl Write) -> Ending {
    let stopped = device.delete_motor()?;
    end(device, stopped, restart, "the image's configuration", out)
}

pub(super) fn identify(device: &mut Device, current_a: f32, store: bool, out: &mut impl Write) -> Ending {
    let told = device.motor()?.configuration;
    let max_a = told.limits.current_a;
    if !(current_a > 0.0 && current_a <= max_a) {
        return Err(format!(
            "--current-a {current_a} is out of range: give a current above 0 A and up to limits.current_a = {max_a} A"
        )
        .into());
    }
    let found = device.identify_motor(current_a, || thread::sleep(PAUSE))?;
    let found = MotorEstimate {
        resistance_ohm: found.resistance_ohm,
        direct_inductance_h: found.direct_inductance_h,
        quadrature_inductance_h: found.quadrature_inductance_h,
        pole_pairs: found.pole_pairs,
        is_encoder_reversed: found.is_encoder_reversed,
        encoder_offset_rad: found.encoder_offset_rad,
    };
    print_found(&told, &found, "configured", out)?;
    if !told.encoder.is_absolute() {
        writeln!(
            out,
            "encoder_offset_rad is valid until the board restarts: the drive aligns an incremental encoder at each start"
        )?;
    }
    if !store {
        return Ok(ExitCode::SUCCESS);
    }
    let mut next = told;
    next.motor.resistance_ohm = found.resistance_ohm;
    next.motor.direct_inductance_h = found.direct_inductance_h;
    next.motor.quadrature_inductance_h = found.quadrature_inductance_h;
    next.motor.pole_pairs = found.pole_pairs;
    next.motor.is_encoder_reversed = found.is_encoder_reversed;
    if told.encoder.is_absolute() {
        next.motor.encoder_offset_rad = found.encoder_offset_rad;
    }
    next.check()?;
    keep(device, &told, &next, false, out)
}

fn keep(
    device: &mut Device,
    now: &Configuration,
    next: &Configuration,
    restart: bool,
    out: &mut impl Write,
) -> Ending {
    for (name, from, to) in motor::differences(now, next) {
        writeln!(out, "{name}: {from} -> {to}")?;
    }
    let stopped = device.store_motor(next)?;
    end(device, stopped, restart, "the new configuration", out)
}

fn end(device: &mut Device, stopped: bool, restart: bool, what: &str, out: &mut impl Write) -> Ending {
    let stopped = if stopped { " The running scheme was stopped for the write." } else { "" };
    if restart {
        device.restart()?;
        writeln!(out, "done: the board restarted with {what}.")?;
    } else {
        writeln!(out, "done: restart the board (or repeat with --restart) to use {what}.{stopped}")?;
    }
    Ok(ExitCode::SUCCESS)
}
