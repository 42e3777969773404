//! Settings and controllers of a run.

use crate::replay::DeviceDescription;
use hil_sim::rig::{Rig, Station};
use hil_sim::schemes;

/// Relation of a recording's timestamps to wall-clock time.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum TimeBase {
    /// Simulated time since the creation of the file.
    #[default]
    Simulated,
    /// Arrival time of rows, as the clock of a device differs from this computer's clock.
    RealTime,
}

/// Settings and controllers of a run.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct RunMetadata {
    /// Settings that repeat the run, as TOML.
    pub settings_toml: String,
    /// Controllers, in the order of the rig.
    pub controllers: Vec<ControllerMetadata>,
    /// Source of the timestamps.
    pub time_base: TimeBase,
}

impl RunMetadata {
    /// Reads the facts of a rig before its first tick.
    pub fn new(settings_toml: String, rig: &mut Rig) -> Self {
        let facts = |station: &mut Station| {
            let engine = station.dimsart.engine_mut();
            let commands: Vec<_> = engine.rebuild_commands().collect();
            ControllerMetadata {
                name: station.name.clone(),
                scheme: schemes::rows(&commands, &station.name, engine),
                device_json: serde_json::to_string_pretty(&DeviceDescription::from(engine.device())).ok(),
            }
        };
        let controllers = rig.stations_mut().iter_mut().map(facts).collect();
        Self { settings_toml, controllers, time_base: TimeBase::Simulated }
    }

    /// Marks the run as a run in real time.
    #[must_use]
    pub fn in_real_time(self) -> Self {
        Self { time_base: TimeBase::RealTime, ..self }
    }
}

/// A controller at the start of a recording.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ControllerMetadata {
    /// Name.
    pub name: String,
    /// Scheme as rows of text.
    pub scheme: String,
    /// Device, as [`DeviceDescription`](crate::replay::DeviceDescription), for a replay.
    pub device_json: Option<String>,
}
