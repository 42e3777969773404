//! The file with the signals of a run, written during the run.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::JoinHandle;

use clap::ValueEnum;

use super::facts::RunMetadata;
use super::{BUS_STEM, PAGE_FILE, ReportError, TIMELINE_STEM, csv, make_folder, mcap, picture_file};
use crate::recorder_files;
use hil_sim::recording::RecordingChunk;

/// Queue length for a slow disk, in blocks of up to 64 rows; the run waits when it is full.
const MAX_WAITING: usize = 64;

/// Format of the signals, with its metadata.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum SignalsFormat {
    /// Text, one column per word.
    #[default]
    Csv,
    /// Binary, for Foxglove and `PlotJuggler`, with settings and schemes of the run.
    Mcap(RunMetadata),
}

/// [`SignalsFormat`] by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum SignalsKind {
    /// `signals.csv`: text, one column per word.
    Csv,
    /// `signals.mcap`: binary, for Foxglove and `PlotJuggler`, with settings and schemes inside.
    Mcap,
}

impl SignalsKind {
    /// Returns the file name in the report's folder.
    #[must_use]
    pub const fn file_name(self) -> &'static str {
        match self {
            Self::Csv => "signals.csv",
            Self::Mcap => "signals.mcap",
        }
    }
}

impl SignalsFormat {
    const fn kind(&self) -> SignalsKind {
        match self {
            Self::Csv => SignalsKind::Csv,
            Self::Mcap(_) => SignalsKind::Mcap,
        }
    }
}

/// The file with the signals of a run. It grows during the run, so that a killed run keeps its recorded signals.
#[derive(Debug)]
pub struct SignalsFile {
    path: PathBuf,
    thread: JoinHandle<io::Result<()>>,
}

impl SignalsFile {
    /// Creates the file in `folder`, created if missing, and removes the previous report with pictures of these `stems`. Rows
    /// are written through the sender, which waits when 4096 rows are pending.
    ///
    /// # Errors
    /// [`ReportError`] names the folder or file and the remedy.
    pub fn create(
        folder: &Path,
        stems: &[&str],
        format: SignalsFormat,
    ) -> Result<(Self, SyncSender<RecordingChunk>), ReportError> {
        make_folder(folder)?;
        let pictures = stems.iter().chain(&[BUS_STEM, TIMELINE_STEM]).map(|stem| picture_file(folder, stem));
        let signals = SignalsKind::value_variants().iter().map(|kind| folder.join(kind.file_name()));
        for old in [folder.join(PAGE_FILE)].into_iter().chain(pictures).chain(signals) {
            match fs::remove_file(&old) {
                Err(source) if source.kind() != io::ErrorKind::NotFound => {
                    return Err(ReportError::File { path: old, source });
                }
                _ => {}
            }
        }
        recorder_files::remove_old(folder)?;
        let path = folder.join(format.kind().file_name());
        let options = File::options().read(true).write(true).create(true).truncate(true).open(&path);
        let file = options.map_err(|source| ReportError::File { path: path.clone(), source })?;
        let (sender, pieces) = sync_channel(MAX_WAITING);
        let at = path.clone();
        let thread = std::thread::spawn(move || match format {
            SignalsFormat::Csv => csv::write(&pieces, file, &at),
            SignalsFormat::Mcap(facts) => mcap::write(&pieces, &file, &facts),
        });
        Ok((Self { path, thread }, sender))
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Waits until all rows are written. The sender must be dropped before.
    ///
    /// # Errors
    /// [`ReportError::File`] on a write error; earlier rows are in the file.
    pub fn finish(self) -> Result<PathBuf, ReportError> {
        let written = self.thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        written.map(|()| self.path.clone()).map_err(|source| ReportError::File { path: self.path, source })
    }
}
