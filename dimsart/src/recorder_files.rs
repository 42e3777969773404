//! Writes the rows of a simulated run's recorders as CSV next to its signals.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::connect::{ConnectError, Device, InProcess, RecorderRows, Timeouts};
use crate::report::ReportError;
use hil_sim::rig::{Rig, Station};

/// Prefix and suffix of the file names.
const PREFIX: &str = "recorder_";
const EXTENSION: &str = ".csv";
/// Part of each file name after the controller's name.
const KIND: &str = "_RECORDER_MOD";

/// The file of one recorder.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct RecorderFile {
    /// File name in the run's folder.
    pub name: String,
    /// Description of its content.
    pub content: String,
}

/// Writes a file for every plugged-in recorder. Reports recorders that cannot be read to `note`.
///
/// # Errors
/// [`ReportError::File`] for a file that cannot be written.
pub fn write(
    folder: &Path,
    rig: &mut Rig,
    mut note: impl FnMut(String),
) -> Result<Vec<RecorderFile>, ReportError> {
    let mut files = Vec::new();
    for station in rig.stations_mut() {
        let found = read(station).unwrap_or_else(|error| vec![Err(error)]);
        let is_on_board = station.board_mut().is_some();
        let controller = &station.name;
        if is_on_board && !found.is_empty() {
            // The local copy has the board's signals, but not its recorder memories.
            note(format!(
                "cannot read recorders of {controller} on the emulated board: run without --target"
            ));
            continue;
        }
        for recorded in found {
            match recorded {
                Ok(recorded) => files.push(write_rows(folder, controller, &recorded)?),
                Err(error) => note(format!("cannot read a recorder of {controller}: {error}")),
            }
        }
    }
    Ok(files)
}

/// Removes recorder files of an earlier run from `folder`.
///
/// # Errors
/// [`ReportError::File`] for a file that cannot be removed.
pub fn remove_old(folder: &Path) -> Result<(), ReportError> {
    let failed = |path: &Path, source| ReportError::File { path: path.to_owned(), source };
    for entry in fs::read_dir(folder).map_err(|source| failed(folder, source))? {
        let path = entry.map_err(|source| failed(folder, source))?.path();
        if is_one(&path) {
            fs::remove_file(&path).map_err(|source| failed(&path, source))?;
        }
    }
    Ok(())
}

fn is_one(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    name.starts_with(PREFIX) && name.ends_with(EXTENSION) && name.contains(KIND)
}

type Read<T> = Result<T, ConnectError>;

fn read(station: &mut Station) -> Read<Vec<Read<RecorderRows>>> {
    let kinds = station.dimsart.engine().kinds();
    let mut device = Device::identify(InProcess::new(&mut station.dimsart), Timeouts::default(), kinds)?;
    let names = device.recorders()?;
    Ok(names.iter().map(|name| device.read_recorder(Some(name))).collect())
}

fn write_rows(folder: &Path, controller: &str, recorded: &RecorderRows) -> Result<RecorderFile, ReportError> {
    let name = format!("{PREFIX}{controller}_{}{EXTENSION}", recorded.recorder);
    let path: PathBuf = folder.join(&name);
    let written = File::create(&path).map(io::BufWriter::new).and_then(|file| recorded.write_csv(file));
    written.map_err(|source| ReportError::File { path, source })?;
    Ok(RecorderFile { name, content: recorded.to_string() })
}
