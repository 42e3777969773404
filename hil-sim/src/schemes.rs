//! Scheme files on the host: the shipped ones, loading, and error messages.

mod explain;
mod frequencies;
mod load;
mod rows;
mod setting;

pub use explain::SchemeErrorMessage;
pub use load::{LoadReport, load, load_for};
pub use rows::{entry_text, rows, value_text};
pub use setting::Setting;

use std::path::Path;

use dimsart_core::{AxisKind, DescriptorError, DeviceDescriptor, limits, types};

use crate::untrusted_text::escape_lines;

/// Sides that a scheme can address.
pub const SIDES: &[&str] = &["master", "slave"];

/// Device for checking a scheme without a rig: measures positions, takes forces, linear axes.
///
/// # Errors
/// [`DescriptorError`] for an impossible number of axes or period.
pub fn device(
    name: &'static str,
    dof: usize,
    sample_period_s: f64,
) -> Result<DeviceDescriptor, DescriptorError> {
    let axes = [AxisKind::Linear; limits::MAX_DOF];
    let axes = axes.get(..dof).ok_or(DescriptorError::Dof { wanted: dof })?;
    #[expect(clippy::cast_possible_truncation, reason = "controllers count in f32")]
    let sample_period_s = sample_period_s as f32;
    DeviceDescriptor::new(name, axes, sample_period_s, &[types::POSITION], &[types::DES_FORCE])
}

/// Shipped schemes, by name.
pub const BUILT_IN: &[(&str, &str)] = &[
    ("arm", include_str!("../schemes/arm.scheme")),
    ("arm_bus", include_str!("../schemes/arm_bus.scheme")),
    ("bilateral", include_str!("../schemes/bilateral.scheme")),
    ("joint", include_str!("../schemes/joint.scheme")),
    ("moteus", include_str!("../schemes/moteus.scheme")),
    ("phantom", include_str!("../schemes/phantom.scheme")),
    ("position_force", include_str!("../schemes/position_force.scheme")),
    ("phantom_tip", include_str!("../schemes/phantom_tip.scheme")),
    ("position_position", include_str!("../schemes/position_position.scheme")),
    ("rokviss", include_str!("../schemes/rokviss.scheme")),
    ("small_motors", include_str!("../schemes/small_motors.scheme")),
    ("table1", include_str!("../schemes/table1.scheme")),
    ("tank", include_str!("../schemes/tank.scheme")),
    ("tdpa", include_str!("../schemes/tdpa.scheme")),
    ("three", include_str!("../schemes/three.scheme")),
    ("waves", include_str!("../schemes/waves.scheme")),
];

/// The text of a scheme and where it is from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SchemeText {
    /// File or built-in name, for messages.
    pub name: String,
    /// Its rows.
    pub text: String,
}

/// A scheme that cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum SchemeFileError {
    /// Cannot read the file.
    #[error("cannot read scheme file {name}: {source}; correct the path, or use one of {}", built_in_names())]
    Unreadable {
        /// The file.
        name: String,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// `builtin:` with an unknown name.
    #[error("unknown scheme {name}; use the path of a file, or one of {}", built_in_names())]
    UnknownScheme {
        /// The name as written.
        name: String,
    },
}

/// Prefix of the name of a shipped scheme.
pub(crate) const BUILT_IN_PREFIX: &str = "builtin:";

impl SchemeText {
    /// Reads a file, or the shipped scheme `builtin:NAME`.
    ///
    /// # Errors
    /// [`SchemeFileError`] if the file or built-in scheme does not exist.
    pub fn read(name: &str) -> Result<Self, SchemeFileError> {
        Self::read_from(name, Path::new(""))
    }

    /// Like [`read`](Self::read), with paths relative to `folder`.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn read_from(name: &str, folder: &Path) -> Result<Self, SchemeFileError> {
        let name = match name.starts_with(BUILT_IN_PREFIX) {
            true => name.to_owned(),
            false => folder.join(name).display().to_string(),
        };
        match name.strip_prefix(BUILT_IN_PREFIX) {
            Some(wanted) => match BUILT_IN.iter().find(|(known, _)| *known == wanted) {
                Some((_, text)) => Ok(Self { name, text: (*text).to_owned() }),
                None => Err(SchemeFileError::UnknownScheme { name }),
            },
            None => match std::fs::read_to_string(&name) {
                Ok(text) => Ok(Self { name, text: escape_lines(&text) }),
                Err(source) => Err(SchemeFileError::Unreadable { name, source }),
            },
        }
    }
}

fn built_in_names() -> String {
    let names: Vec<_> = BUILT_IN.iter().map(|(name, _)| format!("{BUILT_IN_PREFIX}{name}")).collect();
    names.join(", ")
}

/// Maximum length of a word shown in full; longer words match no name.
const MAX_WORD_CHARS: usize = 64;

/// Finds the known word most similar to `word`, if any is similar.
#[must_use]
pub fn most_similar<'a>(word: &str, known: &'a [String]) -> Option<&'a str> {
    if word.len() > 4 * MAX_WORD_CHARS {
        return None;
    }
    let word = word.to_uppercase();
    let likeness = |known: &&String| strsim::jaro_winkler(&word, &known.to_uppercase());
    let best = known.iter().max_by(|a, b| likeness(a).total_cmp(&likeness(b)))?;
    (!word.is_empty() && likeness(&best) > 0.75).then_some(best)
}

/// Suggests the known word most similar to an unknown `word`, or lists the known words.
#[must_use]
pub fn suggestion(word: &str, known: &[String]) -> String {
    match most_similar(word, known) {
        Some(near) => format!("did you mean '{near}'?"),
        None if known.is_empty() => "no names available".to_owned(),
        None => format!("available: {}", known.join(", ")),
    }
}
