//! The firmware's log: keeps the last lines and writes all lines to a file.

use std::collections::VecDeque;
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Write};
use std::process::{ChildStderr, ChildStdout};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};

use defmt_decoder::{DecodeError, Table};

use crate::untrusted_text::escape_lines;

/// Lines kept for error messages.
const KEPT_LINES: usize = 12;

/// Log of an emulated board.
#[derive(Debug)]
pub(super) struct Log {
    lines: Lines,
    readers: Vec<JoinHandle<()>>,
}

#[derive(Debug, Clone)]
struct Lines {
    last: Arc<Mutex<VecDeque<String>>>,
    file: Option<Arc<File>>,
}

impl Lines {
    fn add(&self, line: String) {
        let line = escape_lines(&line);
        if let Some(mut file) = self.file.as_deref() {
            // A log that cannot be written does not end a run.
            let _ = writeln!(file, "{line}");
        }
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if last.len() == KEPT_LINES {
            last.pop_front();
        }
        last.push_back(line);
    }
}

impl Log {
    /// Reads the defmt frames of the image `elf` and the emulator's messages until both end.
    pub(super) fn follow(
        firmware: Option<ChildStdout>,
        emulator: Option<ChildStderr>,
        elf: Vec<u8>,
        file: Option<File>,
    ) -> Self {
        let lines = Lines { last: Arc::default(), file: file.map(Arc::new) };
        let (of_firmware, of_emulator) = (lines.clone(), lines.clone());
        let firmware =
            firmware.map(|stream| thread::spawn(move || decode(stream, &elf, |line| of_firmware.add(line))));
        let emulator = emulator.map(|stream| {
            let lines = BufReader::new(stream).lines().map_while(Result::ok);
            thread::spawn(move || lines.for_each(|line| of_emulator.add(line)))
        });
        Self { lines, readers: [firmware, emulator].into_iter().flatten().collect() }
    }

    /// Returns the last lines after the emulator has exited and all lines are read.
    pub(super) fn last_lines(&mut self) -> Vec<String> {
        for reader in self.readers.drain(..) {
            // A failed reader keeps its lines.
            let _ = reader.join();
        }
        self.lines.last.lock().unwrap_or_else(PoisonError::into_inner).iter().cloned().collect()
    }
}

/// Always reads to the end: a full pipe would block the firmware.
fn decode(mut stream: impl Read, elf: &[u8], mut add: impl FnMut(String)) {
    let mut bytes = [0; 1024];
    let table = Table::parse(elf).ok().flatten();
    let mut decoder = table.as_ref().map(Table::new_stream_decoder);
    while let Ok(count @ 1..) = stream.read(&mut bytes) {
        let Some(decoder) = &mut decoder else { continue };
        decoder.received(bytes.get(..count).unwrap_or_default());
        loop {
            match decoder.decode() {
                Ok(frame) => {
                    let level = frame.level().map_or("", |level| level.as_str());
                    add(format!("{level:<5} {}", frame.display_message()));
                }
                // Skipped: frames end with a delimiter.
                Err(DecodeError::Malformed) => {}
                Err(DecodeError::UnexpectedEof) => break,
            }
        }
    }
}
