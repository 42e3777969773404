//! Firmware stopped by a panic, a fault, a stack overflow or its watchdog: safe outputs first, then the reason, then the end.
//!
//! The product has no test hook: the tests run copies of the image in which the first instructions of a function are
//! replaced, a function that a request reaches within the tick.

use std::process;
use std::thread;
use std::time::{Duration, Instant};

use dimsart_core::{Command, Value};
use dimsart_link::exchange::Tag;
use dimsart_link::protocol::{LeaseAction, MAX_FRAME_BYTES, Request, encode_request, request_id};
use dimsart_modules::ALL;

use crate::by_hand::{ByHand, section};
use crate::common::image;
use crate::debugger::Debugger;
use crate::firmware::Firmware;
use crate::patched::{patched, symbol};
use crate::run::are_emulators_in;
use test_requirements::TEST_TIMEOUT;

/// Reads a device's own types, for a request of data types.
pub(crate) const IN_THE_TICK: &[&str] = &["type_at"];
/// Writes a panic's text.
pub(crate) const SAYS_WHY: &[&str] = &["4core3fmt5write"];

const UNKNOWN_INSTRUCTION: &[u16] = &[0xde00];
/// `push {r0-r7, lr}` endlessly.
const STACK_OVERFLOW: &[u16] = &[0xb5ff, 0xe7fd];
/// Triggers interrupt 5, which the firmware does not expect: a panic.
pub(crate) const PANIC: &[u16] = &[
    0xf24e, 0x1000, // movw r0, #0xe100
    0xf2ce, 0x0000, // movt r0, #0xe000: the interrupts' enable register
    0x2120, // movs r1, #1 << 5
    0x6001, // str r1, [r0]
    0xf8c0, 0x1100, // str r1, [r0, #0x100]: pending
    0xe7fe, // b .
];
/// `b .`
pub(crate) const HANG: &[u16] = &[0xe7fe];
/// The same, with a fed watchdog.
const HANG_FED: &[u16] = &[
    0xf248, 0x0000, // movw r0, #0x8000
    0xf2c4, 0x0000, // movt r0, #0x4000: what the watchdog counts down from
    0x6000, // str r0, [r0]
    0xe7fd, // b .-2
];

const FAULT: &str = "exception: stack overflow, invalid access or undefined instruction";
const PANICKED: &str = "unexpected interrupt";
pub(crate) const NOT_FED: &str = "watchdog timeout: ticks were late";
const CASES: [(&[u16], &str); 4] =
    [(UNKNOWN_INSTRUCTION, FAULT), (STACK_OVERFLOW, FAULT), (PANIC, PANICKED), (HANG, NOT_FED)];

#[test]
fn outputs_are_safe_it_says_why_and_ends() {
    let Some(image) = image() else { return };
    for (patch, why) in CASES {
        let folder = tempfile::tempdir().unwrap();
        let firmware = Firmware::start_image(patched(image.bytes(), &folder, &[(IN_THE_TICK, patch)]), true);
        let mut line = ByHand::greet(firmware.folder());
        let request = stopping_tick(&mut line);
        let left = section(&line.exchange(&as_sections(&request)), Tag::Stopped).unwrap();
        assert!(left.len() > WORDS_BYTES && left.iter().all(|byte| *byte == 0), "{left:?}");
        let (code, log) = firmware.last_words();
        assert_eq!(code, Some(101));
        assert!(log.last().unwrap().contains(why), "{log:?}");
    }
}

#[test]
fn outputs_are_safe_before_it_says_why() {
    let Some(image) = image() else { return };
    let folder = tempfile::tempdir().unwrap();
    // The output of the reason never ends.
    let patches: [(&[&str], &[u16]); 2] = [(IN_THE_TICK, PANIC), (SAYS_WHY, HANG_FED)];
    let firmware = Firmware::start_image(patched(image.bytes(), &folder, &patches), true);
    let mut line = ByHand::greet(firmware.folder());
    let request = stopping_tick(&mut line);
    line.send(&as_sections(&request));
    let (commanded, _) = symbol(image.bytes(), &["host", "COMMANDED"]);
    let mut debugger = Debugger::attach(&firmware);
    let deadline = Instant::now() + TEST_TIMEOUT;
    while debugger.read(commanded) != "00".repeat(WORDS_BYTES) {
        assert!(Instant::now() < deadline, "the outputs are not at their safe value");
        debugger.run_on();
        thread::sleep(Duration::from_millis(20));
        debugger = Debugger::attach(&firmware);
    }
}

#[test]
fn a_run_says_that_its_firmware_stopped_and_leaves_nothing_behind() {
    let Some(image) = image() else { return };
    for (patch, why) in CASES {
        let (folder, temporary) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let start = Instant::now();
        let output = process::Command::new(env!("CARGO_BIN_EXE_dimsart"))
            .args(["run", "--no-report", "--target", "mps2-an386", "--image"])
            // Requests create the scheme on the board; one of them stops it.
            .arg(patched(image.bytes(), &folder, &[(IN_THE_TICK, patch)]))
            .env("TMPDIR", temporary.path())
            .output()
            .unwrap();
        assert!(start.elapsed() < TEST_TIMEOUT);
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{message}");
        let stopped = "the firmware on the emulated board stopped; last actuator commands: all 0; end of the \
            firmware's log:";
        assert!(message.contains(stopped) && message.contains(why), "{message}");
        assert!(!are_emulators_in(temporary.path()), "an emulator is still running");
    }
}

pub(crate) const WORDS_BYTES: usize = 12;

/// Request that stops the next tick, sent while the actuators are active.
pub(crate) fn stopping_tick(line: &mut ByHand) -> [(Tag, Vec<u8>); 2] {
    move_by_hand(line);
    [
        (Tag::Words, measured(TICKS_OF_MOTION)),
        (Tag::Command, request(&Request::DataType { index: u16::MAX }, 1)),
    ]
}

pub(crate) const TICKS_OF_MOTION: u8 = 20;

/// Lets the board move without packets on its link.
pub(crate) fn without_peer(line: &mut ByHand) {
    let module = ALL.module("COMM_RXMOD").unwrap();
    let timeout = (0..=u8::MAX).find(|index| {
        let found = ALL.describe_parameter(module.kind, *index);
        found.is_some_and(|found| found.name == "TIMEOUT_TICKS")
    });
    let set = Command::set(module, timeout.unwrap(), Value::Count(0));
    line.exchange(&[(Tag::Words, &measured(0)), (Tag::Command, &request(&Request::Command(set), 2))]);
}

/// Moves the device until the actuators are active. A client has taken the lease.
pub(crate) fn move_by_hand(line: &mut ByHand) {
    without_peer(line);
    let lease = request(&Request::Lease(LeaseAction::Take), 1);
    line.exchange(&[(Tag::Words, &measured(0)), (Tag::Command, &lease)]);
    let mut command = |tick| section(&line.exchange(&[(Tag::Words, &measured(tick))]), Tag::Words).unwrap();
    let commanded = (1..TICKS_OF_MOTION).map(&mut command).last();
    assert_ne!(commanded.unwrap(), [0; WORDS_BYTES], "no output command");
}

/// Position of the hand.
pub(crate) fn measured(tick: u8) -> Vec<u8> {
    [f32::from(tick) * 1e-3; 3].map(f32::to_le_bytes).concat()
}

/// Request of a client.
pub(crate) fn request(request: &Request, number: u8) -> Vec<u8> {
    encode_request(request, request_id(1, number), &mut [0; MAX_FRAME_BYTES]).unwrap().to_vec()
}

pub(crate) fn as_sections(sections: &[(Tag, Vec<u8>)]) -> Vec<(Tag, &[u8])> {
    sections.iter().map(|(tag, content)| (*tag, content.as_slice())).collect()
}
