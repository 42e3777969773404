//! `cargo xtask cycle-table BOARD`: checks the cycle table on a board's chip; on the emulated board, its sequences.

use std::io::Read;
use std::path::Path;
use std::process::{ChildStdout, Stdio};

use boards::BOARDS;
use defmt_decoder::{DecodeError, Table};

use crate::boards::PROFILE;
use crate::flash::run_on_chip;
use crate::setup;
use crate::shell::{Outcome, command, run};
use crate::toolchain::{Toolchain, output};

/// A fixed time for every instruction, so that time counts them.
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

/// Builds the image, runs it on the board and shows its table; fails where the chip or the emulator differs.
pub(crate) fn cycle_table(name: &str) -> Outcome {
    let board = BOARDS.iter().find(|board| board.name == name).ok_or_else(|| {
        let names: Vec<&str> = BOARDS.iter().map(|board| board.name).collect();
        format!("{name} is no board; boards: {}", names.join(", "))
    })?;
    let features = format!("{},cycle-table", board.name);
    let arguments =
        ["--package", "firmware", "--bin", "cycle-table", "--profile", PROFILE, "--features", &features];
    run(&mut Toolchain::set_up()?.cargo("build", &arguments))?;
    let image = output(PROFILE).join("cycle-table");
    match board.tooling.chip {
        Some(chip) => run_on_chip(chip, &image),
        None => emulate(&image),
    }
}

fn emulate(image: &Path) -> Outcome {
    setup::emulator()?;
    let elf = std::fs::read(image).map_err(|error| format!("cannot read {}: {error}", image.display()))?;
    let mut emulator = command("qemu-system-arm", EMULATOR);
    let emulator = emulator.arg(image).stdout(Stdio::piped()).spawn();
    let mut emulator = emulator.map_err(|error| format!("cannot start the emulator: {error}"))?;
    if let Some(log) = emulator.stdout.take() {
        show(log, &elf)?;
    }
    let status = emulator.wait().map_err(|error| error.to_string())?;
    if status.success() { Ok(()) } else { Err("a sequence is not what the crate cycles says".into()) }
}

/// Prints what an image logs by defmt.
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
