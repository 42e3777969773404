//! Rig files: devices, controllers, links and the experiment.
//!
//! ```toml
//! duration_s = 1.0
//!
//! [[device]]                          # what is controlled
//! name = "joint"
//! measures = ["POSITION", "DES_POSITION"]
//!
//! [[device.axis]]
//! unit = "rad"
//! plant.load.inertia = 0.01           # kg m²
//!
//! [[controller]]                      # what controls it
//! device = "joint"
//! scheme = "builtin:joint"
//!
//! [[experiment.move]]                 # what happens to it
//! device = "joint"
//! on = "DES_POSITION"
//! step = { at_s = 0.1, amplitude = 0.5 }
//! ```
//! The suffix of a key is its unit. Keys of rotary or linear axes have no suffix: rad or m, N m or N. Paths are
//! relative to the file's folder.

mod axis;
mod bus;
mod check;
mod controller;
mod data_type;
mod device;
mod environment;
mod error;
mod geometry;
mod media;
mod moves;
mod parameter;
mod parameter_check;
pub(crate) mod part;
mod read;
mod set;
mod settings_file;

use std::path::{Path, PathBuf};

use crate::renamed_keys::{self, RenamedKey};
use crate::schemes::suggestion;
pub use axis::{ActuatorSection, AxisSection, AxisUnit};
pub use bus::{BusSection, IdealSection};
pub use controller::{ControllerSection, LinkSection};
pub use data_type::TypeSection;
pub use device::{DeviceSection, WatchSection};
use dimsart_core::{DataType, ModuleKinds, types};
pub use environment::{AxisHand, AxisSpring, AxisWall, EnvironmentKind, RIGID_STIFFNESS, WallSide};
pub use error::RigFileError;
pub use geometry::{AxisGeometry, Geometry};
pub use media::{CanSection, DelayKind, UartSection, UdpSection};
pub use moves::{
    Chirp, ExperimentSection, HAND, LOAD, MinimumJerk, MoveSection, Prbs, PressSection, Ramp, SamplesFile,
    Sine, Step,
};
pub use parameter::ParameterSection;
pub use part::ControllerAxes;
use serde::{Deserialize, Serialize};
use set::Setting;
use toml::Table;

/// Shipped rigs, by name; among rigs with the same scheme, the first is the scheme's default.
pub const SHIPPED: [(&str, &str); 13] = [
    ("bilateral", include_str!("../scenarios/bilateral.toml")),
    ("arm", include_str!("../scenarios/arm.toml")),
    ("arm_bus", include_str!("../scenarios/arm_bus.toml")),
    ("joint", include_str!("../scenarios/joint.toml")),
    ("identify", include_str!("../scenarios/identify.toml")),
    ("identify_arm", include_str!("../scenarios/identify_arm.toml")),
    ("moteus", include_str!("../scenarios/moteus.toml")),
    ("cia402", include_str!("../scenarios/cia402.toml")),
    ("phantom", include_str!("../scenarios/phantom.toml")),
    ("phantom_tip", include_str!("../scenarios/phantom_tip.toml")),
    ("rokviss", include_str!("../scenarios/rokviss.toml")),
    ("telerobot", include_str!("../scenarios/telerobot.toml")),
    ("three", include_str!("../scenarios/three.toml")),
];

/// Complete definition of a run.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct RigFile {
    /// Random seed; equal seeds give bit-identical runs.
    #[serde(default = "first_seed")]
    pub seed: u64,
    /// Length of the run, `s`; default: as long as the [press](PressSection) needs.
    #[serde(default = "forever", skip_serializing_if = "is_forever")]
    pub duration_s: f64,
    /// Sample period of every controller, `s`.
    #[serde(default = "millisecond")]
    pub sample_period_s: f64,
    /// Short names for keys that are set together.
    #[serde(rename = "parameter", default, skip_serializing_if = "Vec::is_empty")]
    pub parameters: Vec<ParameterSection>,
    /// Additional types of the Data Base.
    #[serde(rename = "type", default, skip_serializing_if = "Vec::is_empty")]
    pub types: Vec<TypeSection>,
    /// Devices.
    #[serde(rename = "device")]
    pub devices: Vec<DeviceSection>,
    /// Controllers: one for a whole device, or several that share its axes.
    #[serde(rename = "controller")]
    pub controllers: Vec<ControllerSection>,
    /// Buses.
    #[serde(rename = "bus", default, skip_serializing_if = "Vec::is_empty")]
    pub buses: Vec<BusSection>,
    /// Links between controllers.
    #[serde(rename = "link", default)]
    pub links: Vec<LinkSection>,
    /// Experiment.
    pub experiment: ExperimentSection,
    /// Recording.
    #[serde(default)]
    pub record: RecordSection,
    /// Base folder of relative paths.
    #[serde(skip)]
    pub folder: PathBuf,
    /// Old keys that the file or a setting uses.
    #[serde(skip)]
    pub renamed_keys: Vec<RenamedKey>,
    /// Module kinds of every controller; default: the library's.
    #[serde(skip, default = "library")]
    pub kinds: ModuleKinds,
}

fn library() -> ModuleKinds {
    dimsart_modules::ALL
}

fn first_seed() -> u64 {
    1
}

fn millisecond() -> f64 {
    1e-3
}

fn forever() -> f64 {
    f64::INFINITY
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "as serde has it")]
fn is_forever(duration_s: &f64) -> bool {
    duration_s.is_infinite()
}

/// `[record]`: recorded signals.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct RecordSection {
    /// Ticks per row.
    pub every_ticks: u32,
    /// Prefixes of the recorded signals, such as `world` or `master.DES_FORCE`; empty: all.
    pub signals: Vec<String>,
}

impl Default for RecordSection {
    fn default() -> Self {
        Self { every_ticks: 1, signals: Vec::new() }
    }
}

/// Default rig of a run without a file, and of a settings file without `rig`.
pub const DEFAULT_RIG_NAME: &str = "bilateral";

/// Returns the value of a key in a text.
fn text_of_key(text: &str, key: &str) -> Option<String> {
    let line = text.lines().find(|line| line.trim_start_matches('#').starts_with(&format!("{key} = ")))?;
    Some(line.split_once(" # ")?.1.to_owned())
}

impl RigFile {
    /// Returns the text of a shipped rig.
    #[must_use]
    pub fn shipped(name: &str) -> Option<&'static str> {
        SHIPPED.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
    }

    /// Loads the file at `path` and applies each of `sets` (`device.joint.axis.0.plant.load.inertia=0.02`, or the
    /// name of a [parameter](ParameterSection)). A file without devices contains settings of the shipped rig named by
    /// its key `rig`, default [`DEFAULT_RIG_NAME`].
    ///
    /// # Errors
    /// The file cannot be read or is not TOML, has unknown keys or invalid values, or its keys conflict.
    pub fn load(path: &Path, sets: &[String]) -> Result<Self, RigFileError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| RigFileError::Unreadable { path: path.to_owned(), source })?;
        let (folder, name) =
            (path.parent().map(Path::to_owned).unwrap_or_default(), path.display().to_string());
        match settings_file::read(&text, &name, &folder)? {
            None => Self::read(&text, &name, folder, sets),
            Some((rig, settings)) => Self::read_with(rig, &name, PathBuf::new(), settings, sets),
        }
    }

    /// Reads a [shipped](SHIPPED) rig and applies each of `sets`.
    ///
    /// # Errors
    /// As [`load`](Self::load), or an unknown name.
    pub fn from_shipped(name: &str, sets: &[String]) -> Result<Self, RigFileError> {
        let near = || suggestion(name, &SHIPPED.map(|(name, _)| name.to_owned()));
        let text = Self::shipped(name)
            .ok_or_else(|| RigFileError::UnknownRig { name: name.to_owned(), near: near() })?;
        Self::read(text, name, PathBuf::new(), sets)
    }

    /// Reads a rig from a text and applies each of `sets`; `name` is its name in messages.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    pub fn read(text: &str, name: &str, folder: PathBuf, sets: &[String]) -> Result<Self, RigFileError> {
        Self::read_with(text, name, folder, Vec::new(), sets)
    }

    fn read_with(
        text: &str,
        name: &str,
        folder: PathBuf,
        mut settings: Vec<Setting>,
        sets: &[String],
    ) -> Result<Self, RigFileError> {
        let mut errors = Vec::new();
        for argument in sets {
            match Setting::of_argument(argument) {
                Ok(found) => settings.extend(found),
                Err(error) => errors.push(error),
            }
        }
        let is_shipped = SHIPPED.iter().any(|(_, shipped)| *shipped == text);
        // A shipped rig has the new keys: it is parsed once.
        let (text, mut renamed) = match is_shipped {
            true => (text.into(), Vec::new()),
            false => renamed_keys::replace_renamed_keys(text),
        };
        renamed.extend(settings.iter_mut().filter_map(Setting::update));
        let text = text.as_ref();
        let own = match is_shipped.then(|| toml::from_str(text)) {
            Some(Ok(own)) => own,
            _ => read::read(text, name)?,
        };
        let is_sound = is_shipped || own.clone().completed(folder.clone()).problems().is_empty();
        let file = match set::apply_all(text, own, &settings) {
            Ok(file) if errors.is_empty() => Self { renamed_keys: renamed, ..file.completed(folder) },
            Ok(_) if errors.len() == 1 => return Err(errors.remove(0)),
            Ok(_) => return Err(RigFileError::InvalidSettings(errors)),
            Err(error) => {
                errors.insert(0, error);
                return Err(if errors.len() == 1 {
                    errors.remove(0)
                } else {
                    RigFileError::InvalidSettings(errors)
                });
            }
        };
        let mut problems = file.problems();
        problems.extend(file.surplus_forces(&settings));
        if !is_shipped {
            problems.extend(parameter_check::problems(&file.parameters, text));
        }
        if problems.is_empty() {
            return Ok(file);
        }
        let at_fault = if is_sound { sets.to_vec() } else { Vec::new() };
        Err(RigFileError::InvalidKeys { name: name.to_owned(), sets: at_fault, problems })
    }

    /// Adds everything derived from the file.
    fn completed(mut self, folder: PathBuf) -> Self {
        self.folder = folder;
        self.devices.iter_mut().for_each(DeviceSection::complete);
        self
    }

    /// Returns the value of a top-level key or parameter of a shipped rig, as TOML, and its meaning in one line. The
    /// value is `None` if the key is missing.
    #[must_use]
    pub fn shipped_setting(rig: &str, name: &str) -> Option<(Option<String>, String)> {
        let text = Self::shipped(rig)?;
        let table: Table = toml::from_str(text).ok()?;
        let file: Self = toml::from_str(text).ok()?;
        let of_parameter = |found: &ParameterSection| {
            (found.keys.first().cloned().unwrap_or_default(), found.meaning.clone())
        };
        let last = name.rsplit('.').next().unwrap_or_default();
        let of_key = || Some((name.to_owned(), text_of_key(text, last)?));
        let (key, meaning) = file.parameter(name).map(of_parameter).or_else(of_key)?;
        Some((set::value_at(&table, &key).map(ToString::to_string), meaning))
    }

    /// Finds a parameter by name.
    #[must_use]
    pub fn parameter(&self, name: &str) -> Option<&ParameterSection> {
        self.parameters.iter().find(|parameter| parameter.name == name)
    }

    /// Returns the effective settings as a rig file that reproduces the run.
    #[must_use]
    pub fn to_toml(&self) -> String {
        toml::to_string(self).unwrap_or_else(|error| format!("# not expressible in TOML: {error}\n"))
    }

    /// Finds a device by name.
    #[must_use]
    pub fn device(&self, name: &str) -> Option<&DeviceSection> {
        self.devices.iter().find(|device| device.name == name)
    }

    /// Finds a type of the Data Base by name: of the file or built-in.
    #[must_use]
    pub fn data_type(&self, name: &str) -> Option<&'static DataType> {
        let mut own = self.types.iter().zip(data_type::FIRST_OWN..);
        let own = own.find(|(section, _)| section.name == name);
        own.and_then(|(section, id)| section.data_type(id)).or_else(|| types::find_by_name(name))
    }

    /// Whether a device has sensors for a type; otherwise it is a reference.
    #[must_use]
    pub fn is_sensed(data_type: &DataType) -> bool {
        check::SENSED.contains(&data_type)
    }

    /// Resolves a path of the file.
    #[must_use]
    pub fn resolve(&self, path: &Path) -> PathBuf {
        self.folder.join(path)
    }
}
