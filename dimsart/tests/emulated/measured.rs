//! Module costs measured by the board are equal to the counts of `dimsart cycles`.

use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use cycles::timing::{Column, Profile, Timing};
use dimsart::broker::{self, SharedPort};
use dimsart::connect::{ConnectError, CycleCounts, Device, Subscription};
use dimsart::cycles::{Controller, Firmware as Image};
use dimsart_core::{AxisKind, Command as SchemeCommand, DeviceDescriptor, Dimsart, ProvidedMemory, types};
use dimsart_link::protocol::Refusal;
use dimsart_link::saved_scheme;
use dimsart_modules::ALL;
use hil_sim::link::Stream;

use crate::firmware::{Firmware, greet};

const TICKS: u32 = 500;

/// Waits until it has measured enough ticks.
fn measured(device: &mut Device<Box<dyn Stream>>) -> Result<CycleCounts, ConnectError> {
    loop {
        let measured = device.cycle_counts()?.unwrap();
        if measured.tick.runs >= TICKS {
            return Ok(measured);
        }
    }
}

/// Measures from a reset on, while the lease is held throughout. The emulator does not keep the host's time, so the lease
/// lasts milliseconds of the host: a busy host loses it and starts again.
fn measured_under_the_lease(device: &mut Device<Box<dyn Stream>>) -> CycleCounts {
    for _ in 0..1000 {
        let attempt = device.hold_lease().and_then(|_| device.reset(None)).and_then(|_| measured(device));
        match attempt {
            Err(ConnectError::Refused(Refusal::Lease { .. })) | Err(ConnectError::LeaseExpired) => {}
            attempt => return attempt.unwrap(),
        }
    }
    panic!("the lease was lost each time");
}

#[test]
fn every_call_takes_the_instructions_that_the_machine_counts() {
    let Some(firmware) = Firmware::start_measuring() else { return };
    let mut device = greet(firmware.uart());
    let commands = device.commands().unwrap();
    // As in the machine: motion is enabled, and modules start in the first tick.
    let measured = measured_under_the_lease(&mut device);
    assert!(measured.is_instructions);

    let image = Image::find_by_name(Some(firmware.image()), &device.identity().image).unwrap();
    let timing = Timing::new(Profile::ZeroWait, Column::Likely);
    let axes = device.identity().axes.len();
    let mut machine = Controller::new(&image, timing, axes).unwrap();
    machine.load(&scheme(&commands, axes)).unwrap();
    // On the board operation was enabled before the reset, too.
    machine.tick(&[]).unwrap();
    machine.load(&scheme(&commands, axes)).unwrap();
    let mut counted = vec![(u64::MAX, 0); measured.calls.len()];
    let mut tick = (u64::MAX, 0);
    for _ in 0..TICKS {
        // No simulated device: it is at rest.
        let run = machine.tick(&[]).unwrap();
        assert_eq!(run.calls.len(), counted.len());
        tick = (run.instructions.min(tick.0), run.instructions.max(tick.1));
        for ((least, greatest), call) in counted.iter_mut().zip(&run.calls) {
            *least = call.instructions.min(*least);
            *greatest = call.instructions.max(*greatest);
        }
    }

    // The overhead of the two counter readings is the same for every call.
    let around = |counted: u64, measured: f64| counted as f64 - measured;
    let first = around(counted[0].0, measured.calls[0].min).round();
    assert!((0.0..=16.0).contains(&first), "{first}: {counted:?} {measured:?}");
    for ((least, greatest), call) in counted.iter().zip(&measured.calls) {
        for (counted, measured) in [(*least, call.min), (*greatest, call.max)] {
            let differs_by = around(counted, measured) - first;
            assert!(differs_by.abs() < 0.9, "{differs_by}: {counted:?} {measured:?}");
        }
    }
    // A tick's reading excludes the bookkeeping of the tick itself, too.
    let [least, greatest] = [around(tick.0, measured.tick.min), around(tick.1, measured.tick.max)];
    assert!((0.0..=80.0).contains(&least), "{least}: {tick:?} {measured:?}");
    assert!((greatest - least).abs() < 1.5, "{least} {greatest}: {tick:?} {measured:?}");
}

/// Eight programs that request all signals of every tick at one port: the cost of the board's computation is unchanged.
#[test]
fn eight_clients_cost_a_tick_nothing() {
    let Some(firmware) = Firmware::start_measuring() else { return };
    let port = format!("sim:eight-{}", std::process::id());
    let _shared = SharedPort::new(&port, firmware.uart()).unwrap();
    let connect = || greet(broker::open(&port, 0).unwrap());
    let mut device = connect();
    device.reset_cycle_counts().unwrap();
    let alone = measured(&mut device).unwrap().tick;
    let is_over = AtomicBool::new(false);
    let watched = thread::scope(|scope| {
        for _ in 0..8 {
            scope.spawn(|| {
                let (mut client, mut tap) = (connect(), Subscription::new(1));
                while !is_over.load(Ordering::Relaxed) {
                    // Where another client has the board's stream, it retries.
                    let _ = client.receive_rows(&mut tap, Duration::from_millis(20));
                    client.signals(&[]).unwrap();
                }
            });
        }
        device.reset_cycle_counts().unwrap();
        let watched = measured(&mut device).unwrap().tick;
        is_over.store(true, Ordering::Relaxed);
        watched
    });
    println!("instructions of a tick: {alone:?} alone, {watched:?} with eight clients");
    assert!(watched.mean <= 1.02 * alone.mean, "{alone:?} {watched:?}");
    assert!(watched.max <= 1.02 * alone.max, "{alone:?} {watched:?}");
}

/// A device's scheme as bytes to save.
fn scheme(commands: &[SchemeCommand], axes: usize) -> saved_scheme::SchemeBytes {
    let axes = vec![AxisKind::Linear; axes];
    let device = DeviceDescriptor::new("arm", &axes, 1e-3, &[types::POSITION], &[types::DES_FORCE]);
    let mut dimsart = Dimsart::new(ProvidedMemory::leak_default(), device.unwrap(), ALL).unwrap();
    for command in commands {
        dimsart.command(*command).unwrap();
    }
    dimsart.command(SchemeCommand::Check).unwrap();
    saved_scheme::save(dimsart.engine_mut()).unwrap()
}

#[test]
fn a_change_of_the_scheme_and_a_request_begin_anew() {
    let Some(firmware) = Firmware::start_measuring() else { return };
    let mut device = greet(firmware.uart());
    let before = measured(&mut device).unwrap();
    device.reset_cycle_counts().unwrap();
    assert!(device.cycle_counts().unwrap().unwrap().tick.runs < before.tick.runs);
    measured(&mut device).unwrap();
    device.stop().unwrap();
    let stopped = device.cycle_counts().unwrap().unwrap();
    assert_eq!((stopped.tick.runs, stopped.tick.max), (0, 0.0));
}

#[test]
fn the_command_shows_them_beside_the_model_and_says_that_the_bounds_hold() {
    let Some(firmware) = Firmware::start_measuring() else { return };
    // Dropped before the command connects as another client.
    drop(measured(&mut greet(firmware.uart())).unwrap());
    let output = Command::new(env!("CARGO_BIN_EXE_dimsart"))
        .args(["cycles", firmware.image().to_str().unwrap(), "--attach", &firmware.port()])
        .args(["--json", "--set", "duration_s=0.2", "--random-ticks", "100"])
        .output()
        .unwrap();
    let (said, failed) =
        (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap());
    assert!(output.status.success(), "{said}{failed}");
    let report: serde_json::Value = serde_json::from_str(said.lines().last().unwrap()).unwrap();
    assert_eq!(report["holds"], true, "{report}");
    assert_eq!(report["measured_unit"], report["emulated_unit"], "{report}");
    let modules = report["modules"].as_array().unwrap();
    assert!(!modules.is_empty() && modules.iter().all(|row| row["measured_max"].is_number()), "{report}");
}
