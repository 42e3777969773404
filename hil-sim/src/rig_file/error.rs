//! Errors of rig files.

use std::path::PathBuf;

/// Invalid rig file or setting.
#[derive(Debug, thiserror::Error)]
pub enum RigFileError {
    /// Cannot read the file.
    #[error("cannot read the rig file {}: {source}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// Neither a file nor a shipped rig.
    #[error("no such file or shipped rig: {name}; {near}")]
    UnknownRig {
        /// The name.
        name: String,
        /// Suggestion, or available rigs.
        near: String,
    },
    /// Invalid TOML.
    #[error("{name}: {message}")]
    InvalidToml {
        /// The file.
        name: String,
        /// Message with line and column.
        message: String,
    },
    /// Invalid setting of the command line or a settings file.
    #[error("{at}: {reason}")]
    InvalidSetting {
        /// `--set` and its argument, or file, line and column.
        at: String,
        /// Reason.
        reason: String,
    },
    /// Several invalid settings.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    InvalidSettings(Vec<RigFileError>),
    /// Unknown or missing keys, invalid values, or conflicting keys.
    #[error("cannot run {name}{}:\n  {}", with(sets), problems.join("\n  "))]
    InvalidKeys {
        /// The file.
        name: String,
        /// Arguments of `--set` that cause the errors.
        sets: Vec<String>,
        /// All errors, one line each.
        problems: Vec<String>,
    },
}

impl RigFileError {
    /// Whether a command line argument is wrong, not a file.
    #[must_use]
    pub fn is_usage_error(&self) -> bool {
        match self {
            Self::InvalidSetting { at, .. } => at.starts_with(SET),
            Self::InvalidSettings(errors) => errors.iter().all(Self::is_usage_error),
            Self::InvalidKeys { sets, .. } => !sets.is_empty(),
            Self::Unreadable { .. } | Self::UnknownRig { .. } | Self::InvalidToml { .. } => false,
        }
    }
}

/// Prefix of settings of the command line in messages.
pub(super) const SET: &str = "--set ";

fn with(sets: &[String]) -> String {
    sets.iter().map(|argument| format!(" with --set {argument}")).collect()
}
