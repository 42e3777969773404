//! A joint under a PD scheme against its closed forms.

use core::f64::consts::PI;

use hil_sim::bus::can::{CanFrame, Format, Identifier};
use hil_sim::experiment::run;
use hil_sim::rig_file::RigFile;

use super::{DAMPING, INERTIA, PERIOD_S, STIFFNESS, read, step, text};

/// Positions of an axis as its controller reads them, by tick.
fn positions(text: &str, axis: usize) -> Vec<f64> {
    let run = run(&read(text)).unwrap();
    assert!(run.outcome.stable && run.outcome.faults.is_empty(), "{:?}", run.outcome);
    let place = run.recording.find("robot", "POSITION", Some(axis)).unwrap();
    run.recording.column(place).collect()
}

/// Whatever the bus does to a frame's start: the longest that stuff bits can make the frames of a tick, and none.
fn jitter_s(frames: f64) -> f64 {
    let most = CanFrame::max_wire_bits(Identifier::Extended(0x8001), Format::Fd, 32);
    // Head, data and CRC field of 32 bytes without stuff bits that depend on them.
    let min_fast = 5 + 8 * 32 + 4 + 21 + 7 + 1;
    frames * f64::from(most.fast - min_fast) / 5e6
}

/// Torque and motion of the drive's own periods, from frame to frame: what is commanded comes of where the joint was a
/// frame ago, and nothing else is late.
fn predicted(ticks: usize, target: f64) -> Vec<f64> {
    let (mut read, mut x, mut v) = (vec![0.0], 0.0, 0.0);
    for tick in 0..ticks {
        let error = target - read[tick];
        let before = if tick == 0 { error } else { target - read[tick - 1] };
        let torque = STIFFNESS * error + DAMPING * (error - before) / PERIOD_S;
        // The reply to this frame, read in the next tick.
        read.push(x);
        x += PERIOD_S * v + 0.5 * PERIOD_S * PERIOD_S * torque / INERTIA;
        v += PERIOD_S * torque / INERTIA;
    }
    read
}

#[test]
fn a_joint_moves_as_its_difference_equations_say() {
    for axis in [0, 1] {
        let read = positions(&text("", &step(axis, 0.05)), axis);
        let expected = predicted(read.len(), 0.05);
        let fastest =
            expected.windows(2).map(|pair| (pair[1] - pair[0]).abs() / PERIOD_S).fold(0.0, f64::max);
        let allowed = fastest * jitter_s(if axis == 0 { 1.0 } else { 2.0 }) + 1e-7;
        let off =
            read.iter().zip(&expected).map(|(read, expected)| (read - expected).abs()).fold(0.0, f64::max);
        assert!(off <= allowed, "axis {axis}: {off} rad, allowed {allowed}");
        assert!(fastest > 0.5, "it moved: {fastest} rad/s");
    }
}

/// `J x″ + D x′ + K x = K r` with what is late by `t` taken off: the position by a tick and half of a held command, its
/// difference by half a tick more. Then `(J - D t_D) x″ + (D - K t_K) x′ + K x = K r`.
#[test]
fn the_step_is_that_of_spring_damper_and_inertia_with_the_delay_taken_off() {
    let mass = INERTIA - DAMPING * 2.0 * PERIOD_S;
    let damping = DAMPING - STIFFNESS * 1.5 * PERIOD_S;
    let natural = (STIFFNESS / mass).sqrt();
    let share = damping / (2.0 * (STIFFNESS * mass).sqrt());
    let damped = natural * (1.0 - share * share).sqrt();
    let overshoot = (-PI * share / (1.0 - share * share).sqrt()).exp();
    let read = positions(&text("", &step(0, 0.05)), 0);
    let (tick, most) =
        read.iter().enumerate().fold(
            (0, 0.0),
            |found: (usize, f64), (tick, position)| {
                if *position > found.1 { (tick, *position) } else { found }
            },
        );
    assert!((most / 0.05 - 1.0 - overshoot).abs() < 0.01, "{} by {overshoot}", most / 0.05 - 1.0);
    let (peak_s, expected_s) = (tick as f64 * PERIOD_S, PI / damped);
    // Measurements are a tick old; the first command is a tick late.
    assert!((peak_s - expected_s).abs() < 3.0 * PERIOD_S, "{peak_s} s, {expected_s} s");
    assert!((read.last().unwrap() - 0.05).abs() < 1e-5);
}

/// A pendulum hangs `m g l sin(x) / K` below where it is wanted.
#[test]
fn the_shipped_rig_runs_and_its_pendulum_hangs_as_much_lower_as_its_weight_says() {
    let file = RigFile::read(RigFile::shipped("moteus").unwrap(), "moteus", Default::default(), &[]).unwrap();
    let run = run(&file).unwrap();
    assert!(run.outcome.stable && run.outcome.faults.is_empty(), "{:?}", run.outcome.faults);
    let last = |signal: &str, axis| {
        let place = run.recording.find("robot", signal, Some(axis)).unwrap();
        run.recording.column(place).last().unwrap()
    };
    let position = last("POSITION", 0);
    let weight = 1.5 * position.sin();
    assert!((STIFFNESS * (0.8 - position) - weight).abs() < 1e-3, "{position}");
    assert!((last("MEASURED_TORQUE", 0) - weight).abs() < 1e-3);
    // The other one yields to its load.
    assert!((last("POSITION", 1) - (0.05 - 1.0 / STIFFNESS)).abs() < 1e-4);
    assert!((last("BUS_VOLTAGE", 1) - 24.0).abs() < 0.25 && (last("TEMPERATURE", 1) - 30.0).abs() < 0.5);
    assert!(last("VELOCITY", 0).abs() < 1e-3 && last("DRIVE_FAULT", 0).abs() < 1e-9);
    let axis = run.outcome.axes.iter().find(|of| of.axis == 1).unwrap();
    assert!(
        axis.loop_figures
            .and_then(|of| of.phase_margin_deg)
            .is_some_and(|margin| (30.0..80.0).contains(&margin)),
        "{axis:?}"
    );
}

/// The safety stage limits the command to the drive's maximum torque: the drive reports no limit of its own.
#[test]
fn a_command_is_held_to_the_maximum_torque_of_the_drive_and_the_joint_goes_on() {
    let text = text("max_torque_nm = 0.5", &step(0, 0.05));
    let run = run(&read(&text)).unwrap();
    let column = |signal: &str| -> Vec<f64> {
        let place = run.recording.find("robot", signal, Some(0)).unwrap();
        run.recording.column(place).collect()
    };
    let (torque, fault) = (column("MEASURED_TORQUE"), column("DRIVE_FAULT"));
    assert!(torque.iter().all(|torque| torque.abs() <= 0.5 + 1e-6));
    assert!(torque.iter().any(|torque| torque.abs() > 0.5 - 1e-3));
    assert!(fault.iter().all(|fault| fault.abs() < 1e-9), "{fault:?}");
    assert!((column("POSITION").last().unwrap() - 0.05).abs() < 1e-3);
}
