//! Resolves a rig given on the command line.

use std::path::{Path, PathBuf};

use dimsart_core::ModuleKinds;
use hil_sim::rig_file::{DEFAULT_RIG_NAME, RigFile, RigFileError, SHIPPED};
use hil_sim::schemes::suggestion;

/// Reads the rig file at a path, or the shipped rig of this name, applies `sets`, and uses these module kinds. Without a path,
/// reads the default rig.
///
/// # Errors
/// The file or name is unknown or invalid, or a setting is invalid.
pub fn read(path: Option<&Path>, sets: &[String], kinds: ModuleKinds) -> Result<RigFile, RigFileError> {
    Ok(RigFile { kinds, ..read_file(path, sets)? })
}

fn read_file(path: Option<&Path>, sets: &[String]) -> Result<RigFile, RigFileError> {
    let Some(path) = path else { return RigFile::from_shipped(DEFAULT_RIG_NAME, sets) };
    let shipped = path.to_str().and_then(RigFile::shipped).filter(|_| !path.exists());
    if let Some(text) = shipped {
        return RigFile::read(text, &path.display().to_string(), PathBuf::new(), sets);
    }
    if !path.exists() && path.extension().is_none() {
        let (name, known) = (path.display().to_string(), SHIPPED.map(|(name, _)| name.to_owned()));
        return Err(RigFileError::UnknownRig { near: suggestion(&name, &known), name });
    }
    RigFile::load(path, sets)
}

/// Whether an argument denotes a rig (TOML file or shipped name), not a scheme or recording.
#[must_use]
pub fn is_rig(path: &Path) -> bool {
    let is_toml = path.extension().is_some_and(|extension| extension == "toml");
    is_toml || path.to_str().and_then(RigFile::shipped).is_some()
}

/// Reads the rig of a name or a TOML file; none for a scheme.
///
/// # Errors
/// As [`read`].
pub fn read_rig(path: &Path, kinds: ModuleKinds) -> Result<Option<RigFile>, RigFileError> {
    if is_rig(path) { read(Some(path), &[], kinds).map(Some) } else { Ok(None) }
}
