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
    /// It is no TOML.
    #[error("{name}: {message}")]
    NotOne {
        /// The file.
        name: String,
        /// What is wrong, with line and column.
        message: String,
    },
    /// One setting: of the command line, or of a file of settings.
    #[error("{at}: {reason}")]
    Set {
        /// `--set` and its argument, or file, line and column.
        at: String,
        /// What is wrong with it.
        reason: String,
    },
    /// Several settings.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    Sets(Vec<RigFileError>),
    /// It has keys that do not exist, are missing or do not take their values, or does not go together.
    #[error("{name}{} cannot be run:\n  {}", with(sets), problems.join("\n  "))]
    Wrong {
        /// The file.
        name: String,
        /// The arguments of `--set` without which it can be run.
        sets: Vec<String>,
        /// Everything that is wrong, a line each.
        problems: Vec<String>,
    },
}

impl RigFileError {
    /// Whether it is an argument of the command line that is wrong, not a file.
    #[must_use]
    pub fn is_usage(&self) -> bool {
        match self {
            Self::Set { at, .. } => at.starts_with(SET),
            Self::Sets(errors) => errors.iter().all(Self::is_usage),
            Self::Wrong { sets, .. } => !sets.is_empty(),
            Self::Unreadable { .. } | Self::NotShipped { .. } | Self::NotOne { .. } => false,
        }
    }
}

/// How a setting of the command line begins in messages.
pub(super) const SET: &str = "--set ";

fn with(sets: &[String]) -> String {
    sets.iter().map(|argument| format!(" with --set {argument}")).collect()
}
