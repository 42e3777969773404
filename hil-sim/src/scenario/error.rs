//! What can be wrong with a scenario, and where it was written.

use std::fmt;
use std::path::{Path, PathBuf};

/// Where a setting was written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Origin {
    /// In a scenario file; line and column count from 1.
    File {
        /// The file as it was named.
        path: PathBuf,
        /// Line of the key.
        line: usize,
        /// Column of the key, in characters.
        column: usize,
    },
    /// In this argument of `--set`.
    Set(String),
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File { path, line, column } => write!(f, "{}:{line}:{column}", path.display()),
            Self::Set(argument) => write!(f, "--set {argument}"),
        }
    }
}

impl ScenarioError {
    /// Whether it is an argument of the command line that is wrong, not a file.
    #[must_use]
    pub fn is_usage(&self) -> bool {
        match self {
            Self::Unreadable { .. } | Self::NotToml { .. } => false,
            Self::NotASetting { .. } | Self::TooManyForces { .. } => true,
            Self::Several(errors) => errors.iter().all(Self::is_usage),
            Self::UnknownKey { origin, .. } | Self::WrongValue { origin, .. } => {
                matches!(origin, Origin::Set(_))
            }
        }
    }
}

/// A scenario that cannot be run. Nothing was started.
#[derive(Debug, thiserror::Error)]
pub enum ScenarioError {
    /// The file cannot be read.
    #[error("{}: cannot read the scenario ({source}); give the path of a TOML file", path.display())]
    Unreadable {
        /// The file as it was named.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The file is not TOML.
    #[error("{}: not a TOML file: {message}{}", path.display(), scheme_hint(path))]
    NotToml {
        /// The file as it was named.
        path: PathBuf,
        /// What the parser says, with line and column.
        message: String,
    },
    /// An argument of `--set` without a key or a value.
    #[error("--set {argument}: write it as key=value, for instance --set link.loss=0.1")]
    NotASetting {
        /// The argument.
        argument: String,
    },
    /// A force for an axis that is not there.
    #[error(
        "hand.contact_force_n has {entries} values and there are {dof} axes: give it one for each axis, or raise dof"
    )]
    TooManyForces {
        /// Values.
        entries: usize,
        /// Axes.
        dof: usize,
    },
    /// All that is wrong, in the order in which it was written.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    Several(Vec<ScenarioError>),
    /// No such key.
    #[error("{origin}: there is no key `{key}`; {}", key_hint(nearest.as_deref()))]
    UnknownKey {
        /// The key as written.
        key: String,
        /// The valid key most like it, if one is like it at all.
        nearest: Option<String>,
        /// Where it was written.
        origin: Origin,
    },
    /// A value that its key does not take.
    #[error("{origin}: `{key}` cannot be {value}; give it {allowed}")]
    WrongValue {
        /// The key.
        key: String,
        /// The refused value.
        value: String,
        /// What the key takes.
        allowed: String,
        /// Where it was written.
        origin: Origin,
    },
}

/// Who gives a scheme to what takes scenarios.
fn scheme_hint(path: &Path) -> String {
    match path.extension() {
        Some(extension) if extension == "scheme" => {
            let path = path.display();
            format!(
                "\nIf it is a scheme: `dimsart check {path}` checks it, `dimsart run --set master.scheme={path}` runs it"
            )
        }
        _ => String::new(),
    }
}

fn key_hint(nearest: Option<&str>) -> String {
    nearest
        .map_or("`dimsart run --keys` prints all".to_owned(), |nearest| format!("did you mean `{nearest}`?"))
}
