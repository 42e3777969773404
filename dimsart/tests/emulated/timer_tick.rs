//! The tick from a timer interrupt, commands over an emulated UART: pre-emption and the real path of bytes.

use std::collections::BTreeSet;
use std::io::ErrorKind;
use std::thread;
use std::time::Duration;

use dimsart::connect::{ConnectError, Device, SignalPoll};
use dimsart_link::exchange::Tag;
use dimsart_link::protocol::{
    MAX_FRAME_BYTES, Receiver, Request, decode_heartbeat, decode_response, encode_request, request_client,
    request_id,
};
use hil_sim::emulated::pin_to_current_cpu;
use hil_sim::link::Stream;
use rand_core::{Rng, SeedableRng};

use crate::by_hand::{ByHand, section};
use crate::firmware::{Firmware, greet, greet_after_queue};
use test_requirements::length;

fn ticks(device: &mut Device<Box<dyn Stream>>) -> u64 {
    let state = device.state().unwrap();
    let number = state.strip_prefix("tick ").and_then(|rest| rest.split(':').next());
    number.unwrap().parse().unwrap()
}

#[test]
fn commands_are_answered_below_a_tick_that_is_never_late() {
    let Some(firmware) = Firmware::start(false) else { return };
    let mut device = greet(firmware.uart());
    let start = ticks(&mut device);
    // 100 requests, each interrupted by the tick.
    for _ in 0..100 {
        device.state().unwrap();
    }
    while ticks(&mut device) < start + 1_000 {}
    let reports = firmware.reports();
    assert!(!reports.is_empty());
    for report in reports {
        assert!(report.contains(", 0 late, 0 overruns, "), "{report}");
    }
}

#[test]
fn noise_a_cut_frame_and_a_flood_are_survived() {
    // Each byte is handed over inside the emulator, whose UART holds one: 50 us on one processor, up to 100 ms on a loaded one.
    pin_to_current_cpu();
    let Some(firmware) = Firmware::start(false) else { return };
    let mut uart = firmware.uart();
    let mut noise = vec![0; length(500, 10_000_000)];
    rand_pcg::Pcg32::seed_from_u64(3).fill_bytes(&mut noise);
    let mut buffer = [0; MAX_FRAME_BYTES];
    let request = encode_request(&Request::Status, 1, &mut buffer).unwrap();
    exchange(&mut uart, &noise, |_| {});
    exchange(&mut uart, &request[..request.len() / 2], |_| {});
    exchange(&mut uart, &request.repeat(length(25, 2_000)), |_| {});
    // A loaded host takes long to deliver the bytes that are still queued: each is a hand-over on one processor.
    let mut device = greet_after_queue(uart);
    let before = ticks(&mut device);
    assert!(ticks(&mut device) > before);
    for report in firmware.reports() {
        assert!(report.contains(", 0 late, 0 overruns, "), "{report}");
    }
}

/// Writes all `bytes` and reads the answers in between.
fn exchange(uart: &mut Box<dyn Stream>, mut bytes: &[u8], mut heard: impl FnMut(&[u8])) {
    let mut answers = [0; 1024];
    while !bytes.is_empty() {
        match uart.write(&bytes[..bytes.len().min(1024)]) {
            Ok(count) => bytes = &bytes[count..],
            // The emulator is halted at the moment.
            Err(error) => assert_eq!(error.kind(), ErrorKind::WouldBlock),
        }
        if let Ok(count) = uart.read(&mut answers) {
            heard(&answers[..count]);
        }
    }
}

/// The line is as fast as the emulator accepts bytes; see `flood` for a hundred times a line's rate.
#[test]
fn eight_clients_keep_neither_the_tick_nor_the_heart_from_beating() {
    let Some(firmware) = Firmware::start(false) else { return };
    let mut uart = firmware.uart();
    let (mut receiver, mut beats, mut answered) = (Receiver::new(), Vec::new(), BTreeSet::new());
    let flood: Vec<u8> = (0..=u8::MAX)
        .flat_map(|number| (1..=8).map(move |client| request_id(client, number)))
        .flat_map(|id| encode_request(&Request::Status, id, &mut [0; MAX_FRAME_BYTES]).unwrap().to_vec())
        .collect();
    let mut rest = flood.iter().copied().cycle();
    while beats.len() < length(10, 20) || answered.len() < 8 {
        let bytes: Vec<u8> = rest.by_ref().take(64).collect();
        exchange(&mut uart, &bytes, |answer| {
            receiver.push_all(answer, |content| {
                beats.extend(decode_heartbeat(content));
                answered.extend(decode_response(content).map(|(id, _)| request_client(id)));
            });
        });
    }
    for pair in beats.windows(2) {
        let [(first, one), (second, other)] = [pair[0], pair[1]];
        assert_eq!((second - first, other.ticks - one.ticks), (1, 100), "{beats:?}");
        assert_eq!(other.dropped, 0);
    }
    assert_eq!(answered, (1..=8).collect());
    for report in firmware.reports() {
        assert!(report.contains(", 0 late, 0 overruns, "), "{report}");
    }
}

#[test]
fn a_board_moves_its_device_while_the_lease_is_held_and_says_so_by_itself() {
    let Some(firmware) = Firmware::start(false) else { return };
    let mut device = greet(firmware.uart());
    let wait_for = |device: &mut Device<_>, part: &str| {
        for _ in 0..1_000 {
            if device.live().unwrap().to_string().contains(part) {
                return;
            }
            device.listen(Duration::from_millis(10)).unwrap();
        }
        panic!("{part}: {}", device.live().unwrap());
    };
    device.set("COMM_RXMOD", "TIMEOUT_TICKS", "0").unwrap();
    wait_for(&mut device, "no client holds the lease");
    let status = device.take_lease().unwrap();
    assert_eq!((status.holder, status.ticks_left), (device.client(), 200));
    // Not renewed: the emulator's time is independent.
    wait_for(&mut device, "no client holds the lease");
    // An answer that a loaded host delivers late counts as an expired lease.
    let refused = loop {
        match device.renew_lease() {
            Err(ConnectError::LeaseExpired) => {}
            other => break other.unwrap_err(),
        }
    };
    assert!(refused.to_string().contains("a fault or a timeout ended the lease"), "{refused}");
    let mut live = SignalPoll::new(&["POSITION".to_owned()], Duration::from_millis(20));
    assert_eq!(device.read_signals(&mut live).unwrap()[0].values.len(), 3);
    assert!(live.uses_telemetry());
}

const PERIOD_CYCLES: u32 = 25_000;

#[test]
fn ticks_begin_a_period_apart() {
    let Some(firmware) = Firmware::start(true) else { return };
    let mut line = ByHand::greet(firmware.folder());
    assert_eq!(jitter_cycles(&mut line, length(1_000, 5_000)), 0);
}

#[test]
fn requests_do_not_hold_a_tick_up() {
    const REQUESTS: usize = 1_000;
    let Some(firmware) = Firmware::start(true) else { return };
    let mut line = ByHand::greet(firmware.folder());
    let jitter = thread::scope(|scope| {
        let asked = scope.spawn(|| {
            let mut device = greet(firmware.uart());
            (0..REQUESTS).for_each(|_| drop(device.state().unwrap()));
        });
        let mut jitter = 0;
        while !asked.is_finished() {
            jitter = jitter_cycles(&mut line, 10).max(jitter);
        }
        asked.join().unwrap();
        jitter
    });
    assert_eq!(jitter, 0);
}

/// Returns the maximum deviation of the time between two ticks from a period.
fn jitter_cycles(line: &mut ByHand, ticks: usize) -> u32 {
    // Cycle counter before every tick.
    let mut start = || {
        let stamps = section(&line.exchange(&[(Tag::Words, &[0; 12])]), Tag::Stamps).unwrap();
        u32::from_le_bytes(stamps[..4].try_into().unwrap())
    };
    let starts: Vec<u32> = (0..=ticks).map(|_| start()).collect();
    let periods = starts.windows(2).map(|pair| pair[1].wrapping_sub(pair[0]) & 0xff_ffff);
    periods.map(|period| period.abs_diff(PERIOD_CYCLES)).max().unwrap()
}
