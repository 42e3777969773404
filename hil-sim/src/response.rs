//! The experiment of a [rig file](crate::rig_file): its devices are moved as it says, and how they follow is measured.
//!
//! ```text
//! RigFile ──▶ Rig { Station: controller ◀─▶ Instrumented { Joint per axis, references, loads } } ──▶ Experiment
//! ```

mod body;
mod border;
mod build;
mod closed_loop;
mod controller_model;
mod felt;
mod instrumented;
mod live;
mod loop_gain;
mod machine;
mod moves;
mod plant_model;
mod poles;
mod probe;
mod references;

use std::time::Instant;

pub use border::Border;
pub use build::{LoadedController, loaded_controllers};
pub use live::{Hold, LiveRig, TELEMETRY_STREAMS};
pub use loop_gain::LoopFigures;
pub(crate) use poles::UNDECIDED;

use controller_model::Place;

use crate::experiment::{Experiment, ExperimentError, Setup};
use crate::observer::Observer;
use crate::observer::following::Followings;
use crate::observer::limit_cycles::Swings;
use crate::observer::port_energy::PortEnergy;
use crate::observer::reception::Reception;
use crate::observer::saturation::Saturated;
use crate::observer::watch::Watch;
use crate::outcome::Outcome;
use crate::recorder::Recorder;
use crate::rig_file::{HAND, LOAD, MoveSection, Part, RigFile};

/// The loop around an axis.
#[derive(Debug, Default)]
pub(crate) struct AxisLoop {
    pub(crate) station: usize,
    /// Among those of the station.
    pub(crate) axis: usize,
    /// None where it is not linear.
    pub(crate) free: Option<LoopFigures>,
    /// The same with every axis held by its wall; none without one.
    pub(crate) in_contact: Option<LoopFigures>,
}

impl AxisLoop {
    /// One that is not linear.
    fn unknown(at: Place) -> Self {
        Self { station: at.station, axis: at.place, ..Self::default() }
    }
}

impl Setup for RigFile {
    fn experiment(&self) -> Result<Experiment, ExperimentError> {
        let begun = Instant::now();
        let (mut rig, parts) = (build::rig(self)?, Part::of_all(self));
        let mut follows = Vec::new();
        for (station, part) in parts.iter().enumerate() {
            follows.extend(moves::follows(self, part, station)?);
        }
        let loops = if self.experiment.margins { probe::loops(self)? } else { Vec::new() };
        let rests_s = parts.iter().map(|part| moves::long_rests_s(self, part));
        let rests_s: Vec<_> = rests_s.collect::<Result<_, _>>()?;
        let outcome = Outcome { theory: Border::of(self, &mut rig), ..Outcome::default() };
        let recorder = Recorder::new(&rig, &self.record)?;
        let mut observers: Vec<Box<dyn Observer>> = vec![
            Box::new(Followings::new(follows, loops)),
            Box::new(felt::feeling(self)?),
            Box::new(Saturated::new(&rig)),
            Box::new(Watch::new(&rig, parts.iter().map(|part| part.device.ranges()))),
            Box::new(Swings::new(&rig, |station| rests_s.get(station).cloned().unwrap_or_default())),
            Box::new(Reception { reports_silence: true }),
        ];
        // Hands and loads alone bring no energy to controllers.
        let brings_energy =
            |moved: &MoveSection| ![HAND, LOAD].contains(&moved.on.as_str()) && !moved.is_constant();
        if !self.experiment.moves.iter().any(brings_energy) {
            observers.push(Box::new(PortEnergy::default()));
        }
        Ok(Experiment::observed(begun, rig, self.duration_s, recorder, observers, outcome))
    }
}
