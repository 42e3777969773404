//! A debugger of an emulated processor.

use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use std::thread;
use std::time::Duration;

use crate::firmware::{DEBUGGER, Firmware};
use crate::stopped::WORDS_BYTES;

/// Register numbers.
pub(crate) const LINK: usize = 14;
pub(crate) const PROGRAM_COUNTER: usize = 15;

/// Halts the emulated processor to access its memory, by the GDB protocol.
pub(crate) struct Debugger(UnixStream);

impl Debugger {
    pub(crate) fn attach(firmware: &Firmware) -> Self {
        // The emulator creates it shortly after its start.
        let tries = std::iter::repeat_with(|| {
            thread::sleep(Duration::from_millis(10));
            UnixStream::connect(firmware.folder().join(DEBUGGER))
        });
        Self(tries.take(1_000).find_map(Result::ok).unwrap())
    }

    /// Returns the words at an address, in hexadecimal digits.
    pub(crate) fn read(&mut self, address: u64) -> String {
        self.ask(&format!("m{address:x},{WORDS_BYTES:x}"))
    }

    /// Writes instructions to an address; a reset restores the image.
    pub(crate) fn write(&mut self, address: u64, instructions: &[u16]) {
        let bytes = instructions.iter().flat_map(|half| half.to_le_bytes());
        let digits: String = bytes.map(|byte| format!("{byte:02x}")).collect();
        let written = self.ask(&format!("M{address:x},{:x}:{digits}", digits.len() / 2));
        assert_eq!(written, "OK");
    }

    /// Runs to an address.
    pub(crate) fn run_to(&mut self, address: u64) {
        assert_eq!(self.ask(&format!("Z0,{address:x},2")), "OK");
        self.go("c");
        assert_eq!(self.ask(&format!("z0,{address:x},2")), "OK");
    }

    /// Executes one instruction.
    pub(crate) fn step(&mut self) {
        self.go("s");
    }

    /// Returns the content of a register.
    pub(crate) fn register(&mut self, number: usize) -> u64 {
        let digits = 8 * number..8 * (number + 1);
        u32::from_str_radix(&self.ask("g")[digits], 16).unwrap().swap_bytes().into()
    }

    pub(crate) fn run_on(mut self) {
        self.ask("D");
    }

    /// Waits until it stops.
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
            // QEMU 7 reports the halt unsolicited, `T`.
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
