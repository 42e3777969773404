//! WCET bounds of the shipped scheme in images with their sides' schemes: rows for `cargo xtask write budgets`.
//!
//! `cargo run --release -p dimsart --example scheme_budgets FOLDER BOARD...`; the folder has an image named after each.
//!
//! ```text
//! nucleo-g474re master PDCTRL_MOD 285 36        board, side, part of a tick, cycles, bytes of stack
//! ```

use std::error::Error;
use std::path::Path;
use std::thread;

use cycles::timing::{Column, Timing};
use dimsart::cycles::{Figures, Firmware, Setup, measure};
use hil_sim::rig_file::RigFile;

/// Bounds need no run: a few ticks verify that image and host compute the same.
const SETTINGS: [&str; 2] = ["dof=3", "duration_s=0.01"];

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().ok_or("give a folder of images, then boards")?;
    let boards: Vec<String> = arguments.collect();
    let images = boards.iter().flat_map(|board| ["master", "slave"].map(|side| (board, side)));
    let folder = Path::new(&folder);
    let rows = thread::scope(|scope| {
        let started: Vec<_> =
            images.map(|(board, side)| scope.spawn(move || rows(folder, board, side))).collect();
        let ended = started.into_iter().map(|one| one.join().map_err(|_| "a thread panicked".to_owned())?);
        ended.collect::<Result<String, String>>()
    })?;
    print!("{rows}");
    Ok(())
}

fn rows(folder: &Path, board: &str, side: &'static str) -> Result<String, String> {
    let name = format!("{board} as {}", side);
    let figures = figures(&folder.join(board), board, side).map_err(|error| format!("{name}: {error}"))?;
    let whole = [("tick", &figures.tick), ("frame_and_engine", &figures.frame_and_engine)];
    let modules = figures.modules.iter().map(|row| (row.name.as_str(), row));
    let row = |(what, row): (&str, &dimsart::cycles::Row)| {
        let (cycles, stack_bytes) = row.bound.zip(row.stack_bytes)?;
        Some(format!("{board} {} {what} {cycles} {stack_bytes}\n", side))
    };
    let rows: Option<String> = whole.into_iter().chain(modules).map(row).collect();
    rows.ok_or_else(|| format!("{name}: {}", figures.no_bound.unwrap_or_default()))
}

fn figures(image: &Path, board: &str, side: &'static str) -> Result<Figures, Box<dyn Error>> {
    let firmware = Firmware::find(Some(image), Some(board))?;
    let rig = RigFile::from_shipped("bilateral", &SETTINGS.map(str::to_owned))?;
    let setup = Setup {
        firmware: &firmware,
        rig: &rig,
        side,
        commands: None,
        counts_instructions: false,
        timing: Timing::new(firmware.memory().profile(), Column::Upper),
        random_ticks: 0,
        profile: firmware.memory().name(),
        column: "upper",
    };
    Ok(measure(&setup, |_, _| {})?)
}
