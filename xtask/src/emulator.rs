//! QEMU for programs without a host.

use std::io::Read;
use std::path::Path;
use std::process::{ChildStdout, Stdio};

use defmt_decoder::{DecodeError, Table};

use crate::setup;
use crate::shell::{Outcome, command};

/// A fixed time per instruction, so that time counts instructions.
const EMULATOR: [&str; 12] = [
    "-M",
    "mps2-an386",
    "-nographic",
    "-monitor",
    "none",
    "-serial",
    "none",
    "-semihosting-config",
    "enable=on,target=native",
    "-icount",
    "shift=10,align=off,sleep=off",
    "-kernel",
];

/// Runs a program to its end and prints its log; fails if the program does.
pub(crate) fn emulate(image: &Path) -> Outcome {
    setup::emulator()?;
    let elf = std::fs::read(image).map_err(|error| format!("cannot read {}: {error}", image.display()))?;
    let mut emulator = command("qemu-system-arm", EMULATOR);
    let emulator = emulator.arg(image).stdout(Stdio::piped()).spawn();
    let mut emulator = emulator.map_err(|error| format!("cannot start the emulator: {error}"))?;
    if let Some(log) = emulator.stdout.take() {
        show(log, &elf)?;
    }
    let status = emulator.wait().map_err(|error| error.to_string())?;
    if status.success() { Ok(()) } else { Err(format!("{} failed", image.display())) }
}

/// Prints an image's defmt log.
fn show(mut log: ChildStdout, elf: &[u8]) -> Outcome {
    let table = Table::parse(elf).map_err(|error| error.to_string())?.ok_or("the image has no log")?;
    let mut decoder = table.new_stream_decoder();
    let mut bytes = [0; 1024];
    while let Ok(count @ 1..) = log.read(&mut bytes) {
        decoder.received(bytes.get(..count).unwrap_or_default());
        loop {
            match decoder.decode() {
                Ok(frame) => println!("{}", frame.display_message()),
                Err(DecodeError::Malformed) => {}
                Err(DecodeError::UnexpectedEof) => break,
            }
        }
    }
    Ok(())
}
