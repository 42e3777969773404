//! A debugger of an emulated processor.

use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use std::thread;
use std::time::Duration;

use crate::firmware::{DEBUGGER, Firmware};
use crate::stopped::WORDS_BYTES;

/// Numbers of registers.
pub(crate) const LINK: usize = 14;
pub(crate) const PROGRAM_COUNTER: usize = 15;

/// Holds the emulated processor to look into its memory, by the protocol of GDB.
pub(crate) struct Debugger(UnixStream);

impl Debugger {
    pub(crate) fn attach(firmware: &Firmware) -> Self {
        // The emulator makes it a moment after it was started.
        let tries = std::iter::repeat_with(|| {
            thread::sleep(Duration::from_millis(10));
            UnixStream::connect(firmware.folder().join(DEBUGGER))
        });
        Self(tries.take(1_000).find_map(Result::ok).unwrap())
    }

    /// The commanded words at an address, in hexadecimal digits.
    pub(crate) fn read(&mut self, address: u64) -> String {
        self.ask(&format!("m{address:x},{WORDS_BYTES:x}"))
    }

    /// Puts instructions at an address, until a reset brings the image's back.
    pub(crate) fn write(&mut self, address: u64, instructions: &[u16]) {
        let bytes = instructions.iter().flat_map(|half| half.to_le_bytes());
        let digits: String = bytes.map(|byte| format!("{byte:02x}")).collect();
        let written = self.ask(&format!("M{address:x},{:x}:{digits}", digits.len() / 2));
        assert_eq!(written, "OK");
    }

    /// Lets it run until it comes to an address.
    pub(crate) fn run_to(&mut self, address: u64) {
        assert_eq!(self.ask(&format!("Z0,{address:x},2")), "OK");
        self.go("c");
        assert_eq!(self.ask(&format!("z0,{address:x},2")), "OK");
    }

    /// One instruction.
    pub(crate) fn step(&mut self) {
        self.go("s");
    }

    /// What a register holds.
    pub(crate) fn register(&mut self, number: usize) -> u64 {
        let digits = 8 * number..8 * (number + 1);
        u32::from_str_radix(&self.ask("g")[digits], 16).unwrap().swap_bytes().into()
    }

    pub(crate) fn run_on(mut self) {
        self.ask("D");
    }

    /// Until it stops.
    fn go(&mut self, request: &str) {
        self.send(request);
        while !self.answer().starts_with('T') {}
    }

    fn send(&mut self, request: &str) {
        let sum = |text: &str| text.bytes().fold(0_u8, u8::wrapping_add);
        write!(self.0, "${request}#{:02x}", sum(request)).unwrap();
    }

    fn ask(&mut self, request: &str) -> String {
        self.send(request);
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
