//! Firmware that stops by a panic, a fault or a stack overflow: outputs safe first, then why, then the end.
//!
//! The product has no hook for it: copies of the very image are run with the first instructions of a function
//! replaced, one that a request reaches inside the tick.

use std::fs;
use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::process::Command;
use std::thread;
use std::time::{Duration, Instant};

use dimsart_core::exchange::Tag;
use dimsart_core::protocol::{LeaseAction, MAX_FRAME_BYTES, Request, encode_request, request_id};
use hil_sim::emulated::Image;
use object::{Object, ObjectSection, ObjectSymbol};
use tempfile::TempDir;

use crate::by_hand::{ByHand, section};
use crate::common::image;
use crate::firmware::{DEBUGGER, Firmware};
use crate::run::are_emulators_in;

/// Looks at a device's own types, for a request that lists data types alone.
const IN_THE_TICK: &[&str] = &["type_at"];
/// Writes a panic's text.
const SAYS_WHY: &[&str] = &["4core3fmt5write"];

const UNKNOWN_INSTRUCTION: &[u16] = &[0xde00];
/// `push {r0-r7, lr}` for ever.
const STACK_OVERFLOW: &[u16] = &[0xb5ff, 0xe7fd];
/// Lets interrupt 5 come, which the firmware does not expect: that is a panic.
const PANIC: &[u16] = &[
    0xf24e, 0x1000, // movw r0, #0xe100
    0xf2ce, 0x0000, // movt r0, #0xe000: the interrupts' enable register
    0x2120, // movs r1, #1 << 5
    0x6001, // str r1, [r0]
    0xf8c0, 0x1100, // str r1, [r0, #0x100]: pending
    0xe7fe, // b .
];
const HANG: &[u16] = &[0xe7fe];

const FAULT: &str = "stopped: a stack overflow, a bad memory access or an unknown instruction";
const PANICKED: &str = "an interrupt came that nobody asked for";
const CASES: [(&[u16], &str); 3] = [(UNKNOWN_INSTRUCTION, FAULT), (STACK_OVERFLOW, FAULT), (PANIC, PANICKED)];

#[test]
fn outputs_are_safe_it_says_why_and_ends() {
    let Some(image) = image() else { return };
    for (patch, why) in CASES {
        let folder = tempfile::tempdir().unwrap();
        let firmware = Firmware::start_image(patched(&image, &folder, &[(IN_THE_TICK, patch)]), true);
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
    // Saying why never comes to an end.
    let patches: [(&[&str], &[u16]); 2] = [(IN_THE_TICK, PANIC), (SAYS_WHY, HANG)];
    let firmware = Firmware::start_image(patched(&image, &folder, &patches), true);
    let mut line = ByHand::greet(firmware.folder());
    let request = stopping_tick(&mut line);
    line.send(&as_sections(&request));
    let (commanded, _) = symbol(image.bytes(), &["host", "COMMANDED"]);
    let mut debugger = Debugger::attach(&firmware);
    let deadline = Instant::now() + Duration::from_secs(20);
    while debugger.read(commanded) != "00".repeat(WORDS_BYTES) {
        assert!(Instant::now() < deadline, "the actuators are not at rest");
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
        let output = Command::new(env!("CARGO_BIN_EXE_dimsart"))
            .args(["run", "--no-report", "--target", "mps2-an386", "--image"])
            // The scheme is brought to the board by requests, the one in question among them.
            .arg(patched(&image, &folder, &[(IN_THE_TICK, patch)]))
            .env("TMPDIR", temporary.path())
            .output()
            .unwrap();
        assert!(start.elapsed() < Duration::from_secs(10));
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{message}");
        let stopped = "the firmware on the emulated board stopped, its actuators at rest; its last words:";
        assert!(message.contains(stopped) && message.contains(why), "{message}");
        assert!(!are_emulators_in(temporary.path()), "an emulator is left");
    }
}

const WORDS_BYTES: usize = 12;

/// What makes the next tick stop, once the actuators have something to do.
fn stopping_tick(line: &mut ByHand) -> [(Tag, Vec<u8>); 2] {
    // Moved by hand.
    let measured = |tick: u8| [f32::from(tick) * 1e-3; 3].map(f32::to_le_bytes).concat();
    line.exchange(&[(Tag::Words, &measured(0)), (Tag::Command, &lease())]);
    let mut command = |tick| section(&line.exchange(&[(Tag::Words, &measured(tick))]), Tag::Words).unwrap();
    let commanded = (1..20).map(&mut command).last();
    assert_ne!(commanded.unwrap(), [0; WORDS_BYTES], "nothing is commanded");
    let mut buffer = [0; MAX_FRAME_BYTES];
    let request = encode_request(&Request::DataType { index: u16::MAX }, 1, &mut buffer).unwrap().to_vec();
    [(Tag::Words, measured(20)), (Tag::Command, request)]
}

/// A client takes the lease that motion needs.
fn lease() -> Vec<u8> {
    let request = Request::Lease(LeaseAction::Take);
    encode_request(&request, request_id(1, 1), &mut [0; MAX_FRAME_BYTES]).unwrap().to_vec()
}

fn as_sections(sections: &[(Tag, Vec<u8>)]) -> Vec<(Tag, &[u8])> {
    sections.iter().map(|(tag, content)| (*tag, content.as_slice())).collect()
}

/// The image, with other instructions at the start of functions.
fn patched(image: &Image, folder: &TempDir, patches: &[(&[&str], &[u16])]) -> PathBuf {
    let mut bytes = image.bytes().to_vec();
    for (function, instructions) in patches {
        let (_, place) = symbol(image.bytes(), function);
        let place = place.unwrap();
        let instructions: Vec<u8> = instructions.iter().flat_map(|half| half.to_le_bytes()).collect();
        bytes[place..place + instructions.len()].copy_from_slice(&instructions);
    }
    let path = folder.path().join("patched");
    fs::write(&path, bytes).unwrap();
    path
}

/// Address of the symbol whose name holds all `parts`, and its place in the file if it has one there.
fn symbol(elf: &[u8], parts: &[&str]) -> (u64, Option<usize>) {
    let file = object::File::parse(elf).unwrap();
    let is_it = |name: &str| parts.iter().all(|part| name.contains(part));
    let found: Vec<_> = file.symbols().filter(|symbol| symbol.name().is_ok_and(is_it)).collect();
    assert_eq!(found.len(), 1, "{parts:?}: {found:?}; name a function that the image has once");
    // The lowest bit marks Thumb code.
    let address = found[0].address() & !1;
    let section = file.section_by_index(found[0].section_index().unwrap()).unwrap();
    let place = section.file_range().map(|(start, _)| start + address - section.address());
    (address, place.map(|place| place.try_into().unwrap()))
}

/// Holds the emulated processor to look into its memory, by the protocol of GDB.
struct Debugger(UnixStream);

impl Debugger {
    fn attach(firmware: &Firmware) -> Self {
        Self(UnixStream::connect(firmware.folder().join(DEBUGGER)).unwrap())
    }

    /// The commanded words at an address, in hexadecimal digits.
    fn read(&mut self, address: u64) -> String {
        self.ask(&format!("m{address:x},{WORDS_BYTES:x}"))
    }

    fn run_on(mut self) {
        self.ask("D");
    }

    fn ask(&mut self, request: &str) -> String {
        let sum = |text: &str| text.bytes().fold(0_u8, u8::wrapping_add);
        write!(self.0, "${request}#{:02x}", sum(request)).unwrap();
        loop {
            let answer = self.answer();
            // QEMU 7 says by itself that the processor was stopped, `T`.
            if !answer.starts_with('T') {
                return answer;
            }
        }
    }

    fn answer(&mut self) -> String {
        let (mut answer, mut byte) = (String::new(), [0]);
        // `+$answer#`, then two digits.
        while byte != [b'#'] {
            self.0.read_exact(&mut byte).unwrap();
            answer.push(char::from(byte[0]));
        }
        self.0.read_exact(&mut [0; 2]).unwrap();
        self.0.write_all(b"+").unwrap();
        answer.trim_start_matches(['+', '$']).trim_end_matches('#').to_owned()
    }
}
