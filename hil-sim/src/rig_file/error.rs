//! What is wrong with a rig file, where, and what to do next.

use std::path::PathBuf;

/// A rig file that cannot be run.
#[derive(Debug, thiserror::Error)]
pub enum RigFileError {
    /// The file is not there or not to be read.
    #[error("cannot read the rig file {}: {source}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A name that nothing shipped has, and no file.
    #[error("there is no file {name}, and nothing that comes with the command is called that: {near}")]
    NotShipped {
        /// The name.
        name: String,
        /// What is there.
        near: String,
    },
    /// It is no TOML, or a key does not exist, is missing or does not take its value.
    #[error("{name}: {message}")]
    NotOne {
        /// The file.
        name: String,
        /// What is wrong, with line and column.
        message: String,
    },
    /// An argument of `--set`.
    #[error("--set {argument}: {reason}")]
    Set {
        /// The argument.
        argument: String,
        /// What is wrong with it.
        reason: String,
    },
    /// It does not go together.
    #[error("{name} cannot be run:\n  {}", problems.join("\n  "))]
    Wrong {
        /// The file.
        name: String,
        /// Everything that is wrong, a line each.
        problems: Vec<String>,
    },
}
