//! Motor configuration of a drive as text, and its simulation with the code of the crate `drive` and the simulator's motor.

mod simulated;
mod text;

use std::fs;
use std::path::{Path, PathBuf};

use drive::{Configuration, ConfigurationError};
use hil_sim::renamed_keys::{self, RenamedKey};

pub use simulated::{CurrentStepResponse, identify, simulate_current_step};
pub use text::{differences, text};

/// Example configuration with comments.
pub const EXAMPLE: &str = include_str!("motor/example.toml");

/// Error of a configuration file.
#[derive(Debug, thiserror::Error)]
pub enum MotorError {
    /// The file cannot be read.
    #[error("cannot read {path}: {source}; create an example with `dimsart motor example`")]
    File {
        /// The file.
        path: PathBuf,
        /// Error of the system.
        source: std::io::Error,
    },
    /// Invalid TOML or keys.
    #[error("invalid motor configuration {path}: {reason}")]
    Text {
        /// The file.
        path: PathBuf,
        /// Location and error.
        reason: String,
    },
    /// Invalid value.
    #[error("invalid motor configuration {path}: {error}")]
    Value {
        /// The file.
        path: PathBuf,
        /// The value and its range.
        error: ConfigurationError,
    },
}

/// Reads a configuration file; calls `warn` with each old key in it.
///
/// # Errors
/// [`MotorError`].
pub fn read(path: &Path, warn: impl FnMut(RenamedKey)) -> Result<Configuration, MotorError> {
    let path_of = || path.to_owned();
    let text = fs::read_to_string(path).map_err(|source| MotorError::File { path: path_of(), source })?;
    let (text, renamed) = renamed_keys::replace_renamed_keys(&text);
    renamed.into_iter().for_each(warn);
    let configuration: Configuration = toml::from_str(&text)
        .map_err(|error| MotorError::Text { path: path_of(), reason: error.to_string() })?;
    configuration.check().map_err(|error| MotorError::Value { path: path_of(), error })?;
    Ok(configuration)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_example_is_right_and_what_is_not_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("motor.toml");
        let read_text = |text: &str| {
            fs::write(&file, text).unwrap();
            read(&file, |_| ())
        };
        assert!(read(&file, |_| ()).unwrap_err().to_string().contains("dimsart motor example"));
        assert_eq!(read_text(EXAMPLE).unwrap().motor.pole_pairs, 10);
        let mut warnings = Vec::new();
        fs::write(&file, EXAMPLE.replace("max_duty", "most_duty")).unwrap();
        assert_eq!(read(&file, |key| warnings.push(key.old)).unwrap(), read_text(EXAMPLE).unwrap());
        assert_eq!(warnings, ["most_duty"]);
        for (from, to, expected) in [
            ("max_duty = 0.95", "max_duty = 0.3", "max_duty is 0.3: must be 0.6 to 1"),
            ("pole_pairs = 10", "pole_pears = 10", "unknown field `pole_pears`"),
            ("pole_pairs = 10\n", "", "missing field `pole_pairs`"),
            ("trip_c = 100.0", "trip_c = 70", "limits.trip_c is 70: must be above limits.derating_c"),
        ] {
            let error = read_text(&EXAMPLE.replace(from, to)).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
    }
}
