//! Creates the experiment of a [rig file](crate::rig_file): moves the devices and measures their response.
//!
//! ```text
//! RigFile ──▶ Rig { Station: controller ◀─▶ Instrumented { Joint per axis, references, loads } } ──▶ Experiment
//! ```

mod axis;
mod body;
mod border;
mod build;
mod chain;
mod closed_loop;
mod controller_model;
mod excitation;
mod felt;
mod guards;
mod held_hand;
mod instrumented;
pub mod linear_loop;
mod live;
mod loop_gain;
mod machine;
mod moves;
mod obstacle;
mod one_station;
mod plant_model;
mod poles;
mod prediction;
mod press;
mod probe;
mod references;
mod series;

use std::ops::Range;
use std::time::Instant;

pub use border::StabilityLimit;
pub use build::{LoadedController, loaded_controllers};
pub use chain::{Chain, Controller};
pub use excitation::{Excitation, Held};
pub use linear_loop::{LinearLoop, LoopCondition, linear_loops};
pub use live::{LiveRig, ReferenceOverride, TELEMETRY_STREAMS};
pub use obstacle::Obstacle;
pub use one_station::{SingleStation, one_station};
use press::moved_by;

use press::Planned;

use crate::experiment::{Experiment, ExperimentError};
use crate::first_packet::first_packet;
use crate::observer::Observer;
use crate::observer::channel_energy::ChannelEnergy;
use crate::observer::creep::Creep;
use crate::observer::following::TrackingObserver;
use crate::observer::limit_cycles::LimitCycleObserver;
use crate::observer::peer::Peer;
use crate::observer::port_energy::PortEnergy;
use crate::observer::reception::Reception;
use crate::observer::round_trip::{RoundTrips, Ways};
use crate::observer::saturation::Saturated;
use crate::observer::watch::FaultMonitor;
use crate::outcome::Outcome;
use crate::phases::Phases;
use crate::recorder::Recorder;
use crate::rig::Rig;
use crate::rig_file::{ControllerAxes, HAND, LOAD, MoveSection, RigFile};

impl Experiment {
    /// Creates the experiment of a rig file, with all controllers in one process and in virtual time.
    ///
    /// # Errors
    /// [`ExperimentError`] if a device, plant or scheme is invalid.
    pub fn new(file: &RigFile) -> Result<Self, ExperimentError> {
        let mut experiment = experiment(file)?;
        experiment.outcome.warnings.extend(file.renamed_keys.iter().map(ToString::to_string));
        Ok(experiment)
    }
}

fn experiment(file: &RigFile) -> Result<Experiment, ExperimentError> {
    let begun = Instant::now();
    let planned = press::planned(file)?;
    match planned {
        Some(planned) => {
            let moved = planned.moved(file);
            let rig = build::rig(&moved, &planned.let_go_s())?;
            experiment_of(begun, &moved, Some(planned), rig, None)
        }
        None => experiment_of(begun, file, None, build::rig(file, &[])?, None),
    }
}

/// Creates the experiment of all stations, or of one station `alone`: its name and that of its peer.
fn experiment_of(
    begun: Instant,
    file: &RigFile,
    planned: Option<Planned>,
    mut rig: Rig,
    alone: Option<(&str, &str)>,
) -> Result<Experiment, ExperimentError> {
    let recorder = Recorder::new(&rig, &file.record)?;
    let mut outcome = Outcome::default();
    let observers = match &planned {
        Some(planned) => of_press(file, planned, &rig, alone)?,
        None => {
            if alone.is_none() {
                outcome.theory = StabilityLimit::of(file, &mut rig);
            }
            of_moves(file, &rig, alone)?
        }
    };
    let mut experiment = Experiment::observed(begun, rig, file.duration_s, recorder, observers, outcome);
    experiment.phases = planned.map(|planned| planned.phases);
    experiment.board_keys = guards::board_keys(file)?;
    Ok(experiment)
}

/// Observers of moves, in reporting order.
fn of_moves(
    file: &RigFile,
    rig: &Rig,
    alone: Option<(&str, &str)>,
) -> Result<Vec<Box<dyn Observer>>, ExperimentError> {
    let is_here = |part: &ControllerAxes<'_>| alone.is_none_or(|(name, _)| part.name() == name);
    let parts: Vec<ControllerAxes<'_>> = ControllerAxes::all(file).into_iter().filter(is_here).collect();
    let mut follows = Vec::new();
    for (station, part) in parts.iter().enumerate() {
        follows.extend(moves::follows(file, part, station)?);
    }
    let has_margins = file.experiment.margins && alone.is_none();
    let loops = if has_margins { probe::loops(file)? } else { Vec::new() };
    let rests_s = parts.iter().map(|part| moves::long_rests_s(file, part));
    let rests_s: Vec<_> = rests_s.collect::<Result<_, _>>()?;
    let mut observers: Vec<Box<dyn Observer>> = vec![
        Box::new(TrackingObserver::new(follows, loops)),
        Box::new(felt::feeling(file, None, alone.map(|(name, _)| name))?),
        Box::new(Saturated::new(rig)),
        Box::new(FaultMonitor::new(rig, parts.iter().map(|part| part.device.ranges()))),
        Box::new(LimitCycleObserver::new(rig, |station| rests_s.get(station).cloned().unwrap_or_default())),
        Box::new(Reception { reports_silence: alone.is_none() }),
    ];
    // Hands and loads supply no energy to controllers.
    let brings_energy =
        |moved: &MoveSection| ![HAND, LOAD].contains(&moved.on.as_str()) && !moved.is_constant();
    match alone {
        Some((_, other)) => observers.push(Box::new(Peer::new(rig, other, 1))),
        None if !file.experiment.moves.iter().any(brings_energy) => {
            observers.push(Box::new(PortEnergy::default()));
        }
        None => {}
    }
    Ok(observers)
}

/// Observers of a press; observers of both stations need both stations.
fn of_press(
    file: &RigFile,
    planned: &Planned,
    rig: &Rig,
    alone: Option<(&str, &str)>,
) -> Result<Vec<Box<dyn Observer>>, ExperimentError> {
    let Planned { chain, phases, link_round_trip_ticks, forces_n } = planned;
    let every_ticks = chain.every_ticks();
    let ways = Ways {
        delay_ticks: chain.delay_ticks(),
        // In the order of the connections.
        playout_ticks: [chain.slave.playout_ticks, chain.master.playout_ticks],
        waits: every_ticks > 1,
        planned_ticks: *link_round_trip_ticks,
        has_both_ends: alone.is_none(),
    };
    // Settled phase between the push and the release, in which no oscillation is allowed.
    let pushed_s: Range<f64> = phases.contact_start_s..phases.release_s.min(file.duration_s);
    let creep = Creep {
        controllers: [chain.master.clone(), chain.slave.clone()],
        contact_force_n: forces_n.iter().fold(0.0, |max: f64, force| max.max(force.abs())),
        every_ticks,
    };
    let mut observers: Vec<Box<dyn Observer>> = Vec::new();
    if alone.is_none() {
        observers.push(Box::new(linear_loop::Loops::new(file)));
        observers.push(Box::new(ChannelEnergy::new(rig)));
        observers.push(Box::new(PortEnergy::default()));
    }
    let ranges = |name: &str| press::part(file, name).map(|part| part.device.ranges());
    observers.push(Box::new(RoundTrips::new(ways)));
    observers.push(Box::new(felt::feeling(file, Some(planned), alone.map(|(name, _)| name))?));
    observers.push(Box::new(prediction::Prediction { chain: chain.clone(), dof: forces_n.len() }));
    observers.push(Box::new(FaultMonitor::new(
        rig,
        rig.stations().iter().filter_map(|station| ranges(&station.name)),
    )));
    observers.push(Box::new(LimitCycleObserver::new(rig, |_| vec![pushed_s.clone()])));
    observers.push(Box::new(Reception { reports_silence: alone.is_none() }));
    match alone {
        None => observers.push(Box::new(creep)),
        Some((_, other)) => observers.push(Box::new(Peer::new(rig, other, every_ticks))),
    }
    Ok(observers)
}

/// Returns the times at which the hand of a press guides, pushes and releases; `None` without a press.
///
/// # Errors
/// As [`Experiment::new`].
pub fn phases(file: &RigFile) -> Result<Option<Phases>, ExperimentError> {
    Ok(press::planned(file)?.map(|planned| planned.phases))
}

/// Returns the round trip in ticks between the stations of a press without late packets: links and delay modules of
/// both schemes. `None` without a press.
///
/// # Errors
/// As [`Experiment::new`].
pub fn round_trip_ticks(file: &RigFile) -> Result<Option<u32>, ExperimentError> {
    let planned = press::planned(file)?;
    Ok(planned.map(|planned| {
        planned.link_round_trip_ticks.saturating_add(planned.chain.delay_ticks().unwrap_or(0))
    }))
}

/// Returns the ticks per packet of a press; `None` without a press.
///
/// # Errors
/// As [`Experiment::new`].
pub fn every_ticks(file: &RigFile) -> Result<Option<u32>, ExperimentError> {
    Ok(press::planned(file)?.map(|planned| planned.chain.every_ticks()))
}

/// Returns the packet sizes of a press for one axis in words, from the hand's station and to it; 0 if no packet is
/// sent. `None` without a press.
///
/// # Errors
/// As [`Experiment::new`].
pub fn words_of_one_axis(file: &RigFile) -> Result<Option<[usize; 2]>, ExperimentError> {
    let mut file = file.clone();
    file.devices.iter_mut().for_each(|device| device.axes.truncate(1));
    let Some(parts) = file.press_pair() else { return Ok(None) };
    let mut words = [0; 2];
    for (words, part) in words.iter_mut().zip(&parts) {
        let mut dimsart = build::controller(&file, part)?;
        *words =
            first_packet(&mut dimsart, part.first_send_link(&file)).map_or(0, |packet| packet.words.len());
    }
    Ok(Some(words))
}
