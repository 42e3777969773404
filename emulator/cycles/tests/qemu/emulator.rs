//! QEMU and its log of the state before every instruction.

use std::io::{BufRead, BufReader, Read};
use std::path::PathBuf;
use std::process::{Child, ChildStderr, Command, Stdio};

/// Bytes of the log per read.
const AT_ONCE: usize = 1 << 20;

/// State of a processor before an instruction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct State {
    /// R0 to R15.
    pub(crate) core: [u32; 16],
    /// S0 to S31.
    pub(crate) float: [u32; 32],
    /// The program status register, including the IT state.
    pub(crate) xpsr: u32,
    /// The float status register.
    pub(crate) fpscr: u32,
}

/// A running emulator.
pub(crate) struct Emulator {
    process: Child,
    log: BufReader<ChildStderr>,
    line: Vec<u8>,
    /// Log lines other than registers.
    pub(crate) said: String,
}

impl Emulator {
    /// Starts the emulated board in single-step mode with these files loaded at these addresses.
    pub(crate) fn start(files: &[(PathBuf, u32)]) -> Self {
        let mut command = Command::new("qemu-system-arm");
        command.args(["-M", "mps2-an386", "-nographic", "-monitor", "none", "-serial", "none"]);
        command.args(["-semihosting-config", "enable=on,target=native"]);
        command.args(one_by_one()).args(["-d", "cpu,fpu,nochain", "-D", "/dev/stderr"]);
        for (file, address) in files {
            let loader = format!("loader,file={},addr={address},force-raw=on", file.display());
            command.args(["-device", &loader]);
        }
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        let mut process = command.spawn().expect("QEMU");
        let log = process.stderr.take().expect("a pipe");
        Self { process, log: BufReader::with_capacity(AT_ONCE, log), line: Vec::new(), said: String::new() }
    }

    /// The state before the next instruction; `None` after the program has ended.
    pub(crate) fn state(&mut self) -> Option<State> {
        let mut state = State::default();
        loop {
            self.line.clear();
            if self.log.read_until(b'\n', &mut self.line).expect("a log") == 0 {
                return None;
            }
            let line = self.line.as_slice();
            match line {
                // R00=00000000 R01=00000000 R02=00000000 R03=00000000
                [b'R', b'0'..=b'9', ..] => {
                    for field in line.chunks(13) {
                        state.core[number(&field[1..3], 10)] = hexadecimal(&field[4..12]);
                    }
                }
                // s00=00000000 s01=00000000 d00=0000000000000000
                [b's', b'0'..=b'9', ..] => {
                    for field in line[..26].chunks(13) {
                        state.float[number(&field[1..3], 10)] = hexadecimal(&field[4..12]);
                    }
                }
                [b'X', b'P', b'S', b'R', ..] => state.xpsr = hexadecimal(&line[5..13]),
                [b'F', b'P', b'S', b'C', b'R', ..] => {
                    state.fpscr = hexadecimal(&line[7..15]);
                    return Some(state);
                }
                _ => self.said.push_str(&String::from_utf8_lossy(line)),
            }
        }
    }
}

/// QEMU's option for single-step mode, which depends on its version.
fn one_by_one() -> &'static [&'static str] {
    let output = Command::new("qemu-system-arm").arg("--version").output().expect("QEMU");
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    let version = said.split("version ").nth(1).unwrap_or_default();
    let mut numbers = version.split(['.', ' ']).map_while(|number| number.parse::<u32>().ok());
    match (numbers.next(), numbers.next()) {
        (Some(major), Some(minor)) if (major, minor) < (8, 1) => &["-singlestep"],
        _ => &["-accel", "tcg,one-insn-per-tb=on"],
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        // Fails only if QEMU has already ended.
        let _ = self.process.kill();
        let _ = self.process.wait();
        let _ = self.log.get_mut().read_to_string(&mut self.said);
    }
}

fn number(digits: &[u8], base: u32) -> usize {
    digits.iter().fold(0, |number, digit| number * base as usize + usize::from(digit - b'0'))
}

fn hexadecimal(digits: &[u8]) -> u32 {
    digits.iter().fold(0, |word, digit| {
        let value = if digit.is_ascii_digit() { digit - b'0' } else { digit - b'a' + 10 };
        word << 4 | u32::from(value)
    })
}
