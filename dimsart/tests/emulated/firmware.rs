//! Firmware with the tick from a timer, in an emulator whose UART is a socket.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Child, Command};
use std::thread;
use std::time::Duration;

use defmt_decoder::DecodeError;
use dimsart::connect::{Device, Timeouts};
use hil_sim::link::{Stream, open_port};
use tempfile::TempDir;

use crate::common::{measuring_image, timer_image};
use test_requirements::{TEST_TIMEOUT, wait_until};

const UART: &str = "uart0";
const LOG: &str = "log";
/// Output outside the log.
const LAST_WORDS: &str = "last-words";
/// 16 ns per instruction: a tick of 1 ms has 62 500 instructions.
const SHIFT: u8 = 4;
/// 128 ns, 3.2 counts of the board's counter: a tick has 7812 instructions.
const MEASURING_SHIFT: u8 = 7;
/// Address of the debugger interface, which halts the processor.
pub(crate) const DEBUGGER: &str = "gdb";

/// A board without a simulated device, or that waits for a device at its FIFOs.
pub(crate) struct Firmware {
    image: PathBuf,
    shift: u8,
    emulator: Child,
    folder: TempDir,
}

impl Firmware {
    /// Starts it in its own folder; `None` without an image.
    pub(crate) fn start(has_device: bool) -> Option<Self> {
        Some(Self::start_image(timer_image()?, has_device))
    }

    /// Starts the image that measures itself, at the highest speed at which its counter resolves every instruction.
    pub(crate) fn start_measuring() -> Option<Self> {
        Some(Self::start_shifted(measuring_image()?, false, MEASURING_SHIFT))
    }

    /// Starts any image.
    pub(crate) fn start_image(image: PathBuf, has_device: bool) -> Self {
        Self::start_shifted(image, has_device, SHIFT)
    }

    fn start_shifted(image: PathBuf, has_device: bool, shift: u8) -> Self {
        let folder = tempfile::tempdir().unwrap();
        if has_device {
            let fifos = ["to-board", "from-board"].map(|name| folder.path().join(name));
            assert!(Command::new("mkfifo").args(fifos).status().unwrap().success());
        }
        Self { emulator: emulator(&image, folder.path(), shift), image, shift, folder }
    }

    /// Restarts it with the content of its flash.
    pub(crate) fn restart(&mut self) {
        self.end();
        for socket in [UART, DEBUGGER] {
            let _ = fs::remove_file(self.folder().join(socket));
        }
        self.emulator = emulator(&self.image, self.folder.path(), self.shift);
    }

    pub(crate) fn image(&self) -> &Path {
        &self.image
    }

    pub(crate) fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// Returns the name of its UART, once the UART accepts connections: its name exists earlier, the debugger's socket later.
    pub(crate) fn port(&self) -> String {
        let [uart, debugger] = [UART, DEBUGGER].map(|socket| self.folder().join(socket));
        wait_until(|| "the emulator creates no sockets".to_owned(), || debugger.exists());
        format!("unix:{}", uart.display())
    }

    pub(crate) fn uart(&self) -> Box<dyn Stream> {
        // The name exists shortly before the socket listens.
        let port = self.port();
        let tries = std::iter::repeat_with(|| {
            thread::sleep(Duration::from_millis(10));
            open_port(&port, 0)
        });
        tries.take(6000).find_map(Result::ok).unwrap()
    }

    /// Returns its log about ticks after its end.
    pub(crate) fn reports(mut self) -> Vec<String> {
        self.end();
        let mut lines = self.log();
        lines.retain(|line| line.starts_with("tick "));
        lines
    }

    /// Returns its exit code and its log.
    pub(crate) fn last_words(mut self) -> (Option<i32>, Vec<String>) {
        let status = self.emulator.wait().unwrap();
        (status.code(), self.log())
    }

    /// Returns complete lines: a reset can truncate a line.
    pub(crate) fn log(&self) -> Vec<String> {
        let elf = fs::read(&self.image).unwrap();
        let table = defmt_decoder::Table::parse(&elf).unwrap().unwrap();
        let mut decoder = table.new_stream_decoder();
        decoder.received(&fs::read(self.folder().join(LOG)).unwrap());
        let mut lines = Vec::new();
        loop {
            match decoder.decode() {
                Ok(frame) => lines.push(frame.display_message().to_string()),
                Err(DecodeError::Malformed) => {}
                Err(DecodeError::UnexpectedEof) => break,
            }
        }
        lines.extend(fs::read_to_string(self.folder().join(LAST_WORDS)).unwrap().lines().map(str::to_owned));
        lines
    }

    pub(crate) fn end(&mut self) {
        let _ = self.emulator.kill();
        let _ = self.emulator.wait();
    }
}

impl Drop for Firmware {
    fn drop(&mut self) {
        self.end();
    }
}

fn emulator(image: &Path, folder: &Path, shift: u8) -> Child {
    Command::new("qemu-system-arm")
        .args(["-M", "mps2-an386", "-nographic", "-monitor", "none"])
        .args(["-serial", &format!("unix:{UART},server=on,wait=off")])
        .args(["-semihosting-config", "enable=on,target=native"])
        .args(["-icount", &format!("shift={shift},align=off,sleep=off")])
        .args(["-gdb", &format!("unix:{DEBUGGER},server=on,wait=off")])
        .arg("-kernel")
        .arg(std::path::absolute(image).unwrap())
        .current_dir(folder)
        .stdout(File::create(folder.join(LOG)).unwrap())
        .stderr(File::create(folder.join(LAST_WORDS)).unwrap())
        .spawn()
        .unwrap()
}

pub(crate) fn greet(uart: Box<dyn Stream>) -> Device<Box<dyn Stream>> {
    greet_within(uart, 10)
}

/// Greets a board that first has to read what is queued for it.
pub(crate) fn greet_after_queue(uart: Box<dyn Stream>) -> Device<Box<dyn Stream>> {
    greet_within(uart, 100)
}

fn greet_within(uart: Box<dyn Stream>, tries: u32) -> Device<Box<dyn Stream>> {
    let patience = Timeouts { timeout: TEST_TIMEOUT / 10, tries };
    Device::identify(uart, patience, dimsart_modules::ALL).unwrap()
}
