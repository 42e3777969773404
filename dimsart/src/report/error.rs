//! Errors of writing a report.

use std::io;
use std::path::PathBuf;

/// Error of writing a report.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The folder does not exist and cannot be created.
    #[error("cannot create {}: {source}; choose another folder", path.display())]
    Folder {
        /// The requested folder.
        path: PathBuf,
        /// Error of the system.
        source: io::Error,
    },
    /// A file cannot be written.
    #[error("cannot write {}: {source}; free some space there or choose another folder", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Error of the system.
        source: io::Error,
    },
    /// The user stopped it.
    #[error("stopped while writing the report; {} is incomplete", folder.display())]
    Stopped {
        /// The report's folder.
        folder: PathBuf,
    },
    /// A picture or the page cannot be created.
    #[error("cannot create {}: {reason}; the other files are valid, please report this as a bug", path.display())]
    Content {
        /// The missing file.
        path: PathBuf,
        /// Error of the library.
        reason: String,
    },
}
