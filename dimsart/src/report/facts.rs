//! What a run was made of.

use crate::replay::DeviceFacts;
use hil_sim::rig::{Rig, Station};
use hil_sim::schemes;

/// How wall-clock time goes on in a recording.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum TimeBase {
    /// As the time of the run, from when its file was begun.
    #[default]
    Simulated,
    /// As rows arrive: the clock of a device is not that of this computer.
    RealTime,
}

/// What a run was made of.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct RunFacts {
    /// The settings that repeat it, as TOML.
    pub settings_toml: String,
    /// The controllers, in the order of the rig.
    pub controllers: Vec<ControllerFacts>,
    /// Where the times of its messages come from.
    pub time_base: TimeBase,
}

impl RunFacts {
    /// The facts of a rig before its first tick.
    pub fn new(settings_toml: String, rig: &mut Rig) -> Self {
        let facts = |station: &mut Station| {
            let engine = station.dimsart.engine_mut();
            let commands: Vec<_> = engine.commands().collect();
            ControllerFacts {
                name: station.name.clone(),
                scheme: schemes::rows(&commands, &station.name, engine),
                device_json: serde_json::to_string_pretty(&DeviceFacts::from(engine.device())).ok(),
            }
        };
        let controllers = rig.stations_mut().iter_mut().map(facts).collect();
        Self { settings_toml, controllers, time_base: TimeBase::Simulated }
    }

    /// The same of a run in real time.
    #[must_use]
    pub fn in_real_time(self) -> Self {
        Self { time_base: TimeBase::RealTime, ..self }
    }
}

/// What a controller was when a recording began.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ControllerFacts {
    /// Its name.
    pub name: String,
    /// Its scheme as rows of text.
    pub scheme: String,
    /// Its device, as [`DeviceFacts`](crate::replay::DeviceFacts), for who runs it again.
    pub device_json: Option<String>,
}
