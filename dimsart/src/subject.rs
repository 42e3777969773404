//! The subject of a run: a rig file, or a scenario of two sides.

use std::error::Error;
use std::path::{Path, PathBuf};

use hil_sim::bilateral::Side;
use hil_sim::experiment::{Experiment, ExperimentError, Run, Setup};
use hil_sim::rig_file::{RigFile, RigFileError, SHIPPED};
use hil_sim::scenario::Scenario;
use hil_sim::schemes::suggestion;

use crate::pictures::{bilateral, response};
use crate::report::Figure;

/// What a run is made of.
#[derive(Debug, Clone)]
pub enum Subject {
    /// Two sides of a delayed link.
    Scenario(Box<Scenario>),
    /// Any devices, controllers and links.
    Rig(Box<RigFile>),
}

impl Subject {
    /// The rig file or scenario file at a path, or the shipped rig of that name, with `sets` over it; without a path, the
    /// shipped scenario.
    ///
    /// # Errors
    /// [`ScenarioError`](hil_sim::scenario::ScenarioError) or [`RigFileError`] when file or `sets` are wrong.
    pub fn read(path: Option<&Path>, sets: &[String]) -> Result<Self, Box<dyn Error>> {
        Ok(match read(path, sets)? {
            Some(file) => Self::Rig(Box::new(file)),
            None => Self::Scenario(Box::new(Scenario::load(path, sets)?)),
        })
    }

    /// The settings in effect, as a file that gives the same run again.
    #[must_use]
    pub fn settings_toml(&self) -> String {
        match self {
            Self::Scenario(scenario) => scenario.to_toml(),
            Self::Rig(file) => file.to_toml(),
        }
    }

    /// Time between two ticks, `s`.
    #[must_use]
    pub fn sample_period_s(&self) -> f64 {
        match self {
            Self::Scenario(scenario) => scenario.sample_period_s,
            Self::Rig(file) => file.sample_period_s,
        }
    }

    /// What its report is called, for all of it or one side alone.
    #[must_use]
    pub fn title(&self, side: Option<Side>) -> String {
        match self {
            Self::Scenario(_) => {
                format!("Bilateral control over a delayed link: {}", side.map_or("both sides", Side::name))
            }
            Self::Rig(file) => {
                let names: Vec<&str> = file.devices.iter().map(|device| device.name.as_str()).collect();
                format!("Response of {}", names.join(", "))
            }
        }
    }

    /// Names of its figures' files, without what says their format.
    #[must_use]
    pub fn file_stems(&self) -> Vec<String> {
        match self {
            Self::Scenario(_) => bilateral::FILE_STEMS.map(str::to_owned).to_vec(),
            Self::Rig(file) => response::file_stems(file),
        }
    }

    /// The figures that the recorded signals allow.
    #[must_use]
    pub fn figures(&self, run: &Run, side: Option<Side>) -> Vec<Figure> {
        match (self, &run.phases) {
            (Self::Scenario(scenario), Some(phases)) => {
                bilateral::figures(&run.recording, phases, scenario, side)
            }
            (Self::Scenario(_), None) => Vec::new(),
            (Self::Rig(file), _) => response::figures(&run.recording, file),
        }
    }
}

impl Setup for Subject {
    fn experiment(&self) -> Result<Experiment, ExperimentError> {
        match self {
            Self::Scenario(scenario) => scenario.experiment(),
            Self::Rig(file) => file.experiment(),
        }
    }
}

/// The rig file at a path, or the shipped one of that name; none for anything else.
///
/// # Errors
/// What is wrong with file or `sets`, or with the name.
pub fn read(path: Option<&Path>, sets: &[String]) -> Result<Option<RigFile>, RigFileError> {
    let Some(path) = path else { return Ok(None) };
    let shipped = path.to_str().and_then(RigFile::shipped).filter(|_| !path.exists());
    if let Some(text) = shipped {
        let name = path.display().to_string();
        return RigFile::read(text, &name, PathBuf::new(), sets).map(Some);
    }
    if !path.exists() && path.extension().is_none() {
        let (name, known) = (path.display().to_string(), SHIPPED.map(|(name, _)| name.to_owned()));
        return Err(RigFileError::NotShipped { near: suggestion(&name, &known), name });
    }
    // A file that cannot be read is reported as a scenario.
    match std::fs::read_to_string(path) {
        Ok(text) if RigFile::is_one(&text) => RigFile::load(path, sets).map(Some),
        _ => Ok(None),
    }
}

/// The rig of a name or a TOML file; none for a scheme.
///
/// # Errors
/// As [`read`].
pub fn read_rig(path: &Path) -> Result<Option<RigFile>, RigFileError> {
    let is_toml = path.extension().is_some_and(|extension| extension == "toml");
    let is_shipped = path.to_str().and_then(RigFile::shipped).is_some();
    if is_toml || is_shipped { read(Some(path), &[]) } else { Ok(None) }
}
