//! The file with the signals of a run, written while it goes on.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::JoinHandle;

use clap::ValueEnum;

use super::facts::RunFacts;
use super::{BUS_STEM, PAGE_FILE, ReportError, TIMELINE_STEM, csv, make_folder, mcap, picture_files};
use crate::recorder_files;
use hil_sim::recording::Piece;

/// Pieces of 64 rows at most that may wait for a slow disk before the run waits for it, too.
const MOST_WAITING: usize = 64;

/// How signals are written.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum SignalsFormat {
    /// Text, one column per word.
    #[default]
    Csv,
    /// Binary, for Foxglove and `PlotJuggler`, with what the run was made of.
    Mcap(RunFacts),
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
    /// Name of the file in the report's folder.
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

/// The file with the signals of a run. It grows while the run goes on: a run that is killed leaves what it recorded.
#[derive(Debug)]
pub struct SignalsFile {
    path: PathBuf,
    thread: JoinHandle<io::Result<()>>,
}

impl SignalsFile {
    /// Begins the file in `folder`, made if missing, in place of the report that is there, with pictures of these
    /// `stems`. What it is to hold goes into the sender, which waits when the disk is 4096 rows behind.
    ///
    /// # Errors
    /// [`ReportError`] names the folder or file and what to do.
    pub fn create(
        folder: &Path,
        stems: &[&str],
        format: SignalsFormat,
    ) -> Result<(Self, SyncSender<Piece>), ReportError> {
        make_folder(folder)?;
        let pictures =
            stems.iter().chain(&[BUS_STEM, TIMELINE_STEM]).flat_map(|stem| picture_files(folder, stem));
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
        let (sender, pieces) = sync_channel(MOST_WAITING);
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

    /// Waits until all is written that went into the sender, which must be gone.
    ///
    /// # Errors
    /// [`ReportError::File`] when the disk did not take it; the rows before are in the file.
    pub fn finish(self) -> Result<PathBuf, ReportError> {
        let written = self.thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        written.map(|()| self.path.clone()).map_err(|source| ReportError::File { path: self.path, source })
    }
}
