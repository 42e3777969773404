//! Why a report could not be written.

use std::io;
use std::path::PathBuf;

/// Why a report could not be written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The folder does not exist and cannot be made.
    #[error("cannot create {}: {source}; choose another folder with --out", path.display())]
    Folder {
        /// The folder asked for.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// A file cannot be written.
    #[error("cannot write {}: {source}; free some space there or choose another folder with --out", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The user gave up waiting for it.
    #[error("stopped while the report was written; {} has a part of it", folder.display())]
    Stopped {
        /// The report's folder.
        folder: PathBuf,
    },
    /// A picture or the page cannot be made from what the run left.
    #[error("cannot make {}: {reason}; the other files are good, please report this as a bug", path.display())]
    Content {
        /// The file that is missing.
        path: PathBuf,
        /// What the library says.
        reason: String,
    },
}
