//! The paper's bilateral experiment: a scenario becomes a rig, and runs.

use std::net::SocketAddr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use dimsart_core::{AxisKind, DescriptorError, DeviceDescriptor, StorageError, limits, types};

use crate::energy::ChannelEnergy;
use crate::felt::{self, FeltStiffness};
use crate::link::{InProcess, InProcessParameters, Link, Udp, UdpError};
use crate::outcome::{AxisOutcome, Outcome};
use crate::plant::{
    Axis, AxisWise, Environment, HandParameters, ParameterError, Plant, WallParameters, WallSide,
};
use crate::recorder::Recorder;
use crate::recording::Recording;
use crate::report::TickMap;
use crate::rig::{End, Probe, Rig, SimulatedDimsart, Station};
use crate::scenario::{Phases, Scenario, SideSection, Stale, WaveForm};
use crate::schemes::{self, Loaded, SchemeFileError, SchemeText, Setting};
use crate::tick_map::tick_map;
use crate::watch::Watch;

/// One of the two ends of the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Side {
    /// The operator's end.
    Master,
    /// The remote end.
    Slave,
}

impl Side {
    /// Its name in schemes and reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Master => "master",
            Self::Slave => "slave",
        }
    }
}

/// Why an experiment could not be set up or run.
#[derive(Debug, thiserror::Error)]
pub enum ExperimentError {
    /// The device cannot exist.
    #[error("{0}; change dof or sample_period_s")]
    Device(#[from] DescriptorError),
    /// The device's types do not fit.
    #[error("the device's types do not fit into the Data Base: {0:?}")]
    Storage(StorageError),
    /// A plant's parameter.
    #[error("{side}: {error}")]
    Plant {
        /// Whose plant.
        side: &'static str,
        /// What is wrong.
        error: ParameterError,
    },
    /// The scheme cannot be read.
    #[error(transparent)]
    SchemeFile(#[from] SchemeFileError),
    /// The scheme does not run on this side.
    #[error("the scheme {name} does not run on the {side}:\n{}", list(loaded))]
    Scheme {
        /// The scheme.
        name: String,
        /// The side.
        side: &'static str,
        /// What is wrong.
        loaded: Loaded,
    },
    /// A socket.
    #[error(transparent)]
    Udp(#[from] UdpError),
    /// The other process does not answer.
    #[error(
        "nothing came from {peer} for {waited_s} s; start the other side with `dimsart run --side {other}` and the \
         same scenario"
    )]
    NoPeer {
        /// Where it should be.
        peer: SocketAddr,
        /// How long was waited.
        waited_s: u64,
        /// The other side's name.
        other: &'static str,
    },
}

fn list(loaded: &Loaded) -> String {
    let lines = loaded.errors.iter().chain(&loaded.faults).map(|line| format!("  {line}"));
    lines.collect::<Vec<_>>().join("\n")
}

/// How long a side waits for the other one to start.
const PEER_WAIT: Duration = Duration::from_secs(60);
/// Ticks between two looks at the progress.
const PROGRESS_TICKS: u64 = 512;

/// A rig made of a scenario, ready to run.
#[derive(Debug)]
pub struct Experiment {
    scenario: Scenario,
    phases: Phases,
    rig: Rig,
    /// The only side that is simulated here, paced by real time; none when both are.
    side: Option<Side>,
}

/// What a run leaves behind.
#[derive(Debug)]
pub struct Run {
    /// The figures.
    pub outcome: Outcome,
    /// The signals.
    pub recording: Recording,
    /// What happens in a tick, by controller.
    pub tick_maps: Vec<TickMap>,
    /// When what happened.
    pub phases: Phases,
}

impl Experiment {
    /// Both sides in one process and one virtual time.
    ///
    /// # Errors
    /// [`ExperimentError`] when device, plant or scheme cannot be made of the scenario.
    pub fn new(scenario: &Scenario) -> Result<Self, ExperimentError> {
        let phases = Phases::from(scenario);
        let mut rig = Rig::new(scenario.sample_period_s);
        let master = rig.add(station(scenario, &phases, Side::Master)?);
        let slave = rig.add(station(scenario, &phases, Side::Slave)?);
        let end = |station| End { station, link: 0 };
        let link = |delay_ticks, stream: u64| -> Box<dyn Link> {
            let link = &scenario.link;
            let parameters = InProcessParameters {
                delay_ticks,
                jitter_ticks: link.jitter_ticks,
                loss: link.loss,
                duplication: link.duplication,
                reordering: link.reordering,
            };
            Box::new(InProcess::new(parameters, scenario.seed.wrapping_mul(2).wrapping_add(stream)))
        };
        rig.connect(end(master), end(slave), link(scenario.link.forward_delay_ticks, 0));
        rig.connect(end(slave), end(master), link(scenario.link.backward_delay_ticks, 1));
        Ok(Self { scenario: scenario.clone(), phases, rig, side: None })
    }

    /// One side only, in real time, the other one being another process behind UDP sockets. Waits for
    /// it to start, unless `stop` is set meanwhile.
    ///
    /// # Errors
    /// As [`new`](Self::new), and when a socket cannot be opened or the other side does not come.
    pub fn one_side(scenario: &Scenario, side: Side, stop: &AtomicBool) -> Result<Self, ExperimentError> {
        let phases = Phases::from(scenario);
        let mut rig = Rig::new(scenario.sample_period_s);
        let station = rig.add(station(scenario, &phases, side)?);
        let link = &scenario.link;
        let (own, key, peer, other) = match side {
            Side::Master => (link.master_address, "master_address", link.slave_address, "slave"),
            Side::Slave => (link.slave_address, "slave_address", link.master_address, "master"),
        };
        let end = End { station, link: 0 };
        rig.connect(end, end, Box::new(Udp::open(own, key, peer)?));
        let mut experiment = Self { scenario: scenario.clone(), phases, rig, side: Some(side) };
        experiment.meet(peer, other, stop)?;
        Ok(experiment)
    }

    /// Exchanges packets, the world standing still, until the other side's come in.
    fn meet(
        &mut self,
        peer: SocketAddr,
        other: &'static str,
        stop: &AtomicBool,
    ) -> Result<(), ExperimentError> {
        let start = Instant::now();
        let mut round_trip = Probe::new(types::LINK_ROUND_TRIP.first());
        loop {
            self.rig.tick();
            let heard = self.rig.stations().iter().any(|station| round_trip.words(station) != [0]);
            if heard || stop.load(Ordering::Relaxed) {
                return Ok(());
            }
            if start.elapsed() > PEER_WAIT {
                return Err(ExperimentError::NoPeer { peer, waited_s: PEER_WAIT.as_secs(), other });
            }
            std::thread::sleep(Duration::from_secs_f64(self.scenario.sample_period_s));
        }
    }

    /// The rig, to look at or to change before it runs.
    pub fn rig_mut(&mut self) -> &mut Rig {
        &mut self.rig
    }

    /// Length of the run, `s`.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.scenario.duration_s.unwrap_or(self.phases.end_s)
    }

    /// Runs to the end, until something leaves its range, or until `stop` is set. `progress` hears the
    /// virtual time, `s`, now and then.
    pub fn run(mut self, stop: &AtomicBool, mut progress: impl FnMut(f64)) -> Run {
        let end_s = self.duration_s();
        let mut recorder = Recorder::new(&self.rig, &self.scenario.record);
        recorder.reserve(end_s / self.scenario.sample_period_s);
        let mut energy = ChannelEnergy::new(&self.rig);
        let mut watch = Watch::new(&self.rig, &self.scenario.limits);
        let mut felt = FeltStiffness::new(self.scenario.dof, self.scenario.wall.position_m);
        let mut round_trips = RoundTrips::default();
        let mut faults = Vec::new();
        let mut is_stable = true;
        let mut late_ticks = 0_u64;
        let settled = self.phases.settled();
        let start = Instant::now();
        let half_tick_s = 0.5 * self.scenario.sample_period_s;
        while self.rig.time_s() < end_s - half_tick_s {
            if stop.load(Ordering::Relaxed) {
                faults.push(format!("stopped by the user at {:.3} s", self.rig.time_s()));
                break;
            }
            if self.rig.ticks().is_multiple_of(PROGRESS_TICKS) {
                progress(self.rig.time_s());
            }
            if self.side.is_some() {
                late_ticks += u64::from(!wait_until(start, self.rig.time_s(), self.scenario.sample_period_s));
            }
            self.rig.tick();
            recorder.record(&self.rig, energy.add(&self.rig));
            round_trips.add(&self.rig);
            if settled.contains(&self.rig.time_s()) {
                let wall = self.rig.stations().last();
                let touches = |axis| match self.side {
                    Some(Side::Master) => self.scenario.contact_force_n(axis) > 0.0,
                    _ => wall
                        .and_then(|slave| slave.plant.truth(axis))
                        .is_some_and(|truth| truth.is_in_contact),
                };
                felt.add(&self.rig, touches);
            }
            if let Some(fault) = watch.look(&self.rig) {
                faults.push(fault);
                is_stable = false;
                break;
            }
            self.rig.advance();
        }
        let wall_s = start.elapsed().as_secs_f64();
        progress(self.rig.time_s());
        if late_ticks > 0 {
            faults.push(format!("{late_ticks} ticks came more than a period late: this machine is busy"));
        }
        let tick_maps = self.rig.stations().iter();
        let tick_maps = tick_maps.map(|station| tick_map(&station.name, station.dimsart.engine())).collect();
        let outcome =
            self.outcome(is_stable, wall_s, energy.smallest_j(), round_trips.median(), &felt, faults);
        Run { outcome, recording: recorder.finish(), tick_maps, phases: self.phases }
    }

    fn outcome(
        &mut self,
        stable: bool,
        wall_s: f64,
        energy_min_j: f64,
        link_round_trip_ticks: Option<u32>,
        felt: &FeltStiffness,
        faults: Vec<String>,
    ) -> Outcome {
        let dof = self.scenario.dof;
        let delays: Option<u32> = match self.rig.stations_mut() {
            [master, slave] => {
                Some([master, slave].map(|side| felt::time_delay_ticks(&mut side.dimsart)).iter().sum())
            }
            _ => Some(self.scenario.master.time_delay_ticks + self.scenario.slave.time_delay_ticks),
        };
        let round_trip_ticks = link_round_trip_ticks.zip(delays).map(|(link, delays)| link + delays);
        let wall_n_per_m = self.scenario.wall.stiffness_n_per_m;
        let round_trip_s = round_trip_ticks.map(|ticks| f64::from(ticks) * self.scenario.sample_period_s);
        let predicted = match (self.rig.stations_mut(), round_trip_s) {
            ([master, slave], Some(round_trip_s)) => {
                felt::predicted(&mut master.dimsart, &mut slave.dimsart, dof, round_trip_s, wall_n_per_m)
            }
            _ => vec![None; dof],
        };
        let felt = if self.side == Some(Side::Slave) { vec![None; dof] } else { felt.per_axis() };
        let axes = felt.into_iter().zip(predicted).enumerate().map(|(axis, (felt, predicted))| AxisOutcome {
            axis,
            k_felt_n_per_m: felt,
            k_predicted_n_per_m: predicted,
        });
        Outcome::new(
            self.rig.ticks(),
            self.rig.time_s(),
            wall_s,
            stable,
            energy_min_j,
            round_trip_ticks,
            axes.collect(),
            faults,
        )
    }
}

/// Sleeps until `time_s` after `start`. Says whether that was not more than a period ago already.
fn wait_until(start: Instant, time_s: f64, period_s: f64) -> bool {
    let due = Duration::from_secs_f64(time_s);
    let now = start.elapsed();
    if let Some(rest) = due.checked_sub(now) {
        std::thread::sleep(rest);
    }
    now.saturating_sub(due).as_secs_f64() <= period_s
}

/// Counts the round trips that the first station measures on its link.
#[derive(Debug)]
struct RoundTrips {
    probe: Probe,
    counts: std::collections::BTreeMap<u32, u64>,
    last: (u32, u64),
}

impl Default for RoundTrips {
    fn default() -> Self {
        let probe = Probe::new(types::LINK_ROUND_TRIP.first());
        Self { probe, counts: std::collections::BTreeMap::new(), last: (0, 0) }
    }
}

impl RoundTrips {
    fn add(&mut self, rig: &Rig) {
        let Some(&ticks) = rig.stations().first().and_then(|station| self.probe.words(station).first())
        else {
            return;
        };
        if ticks != self.last.0 {
            *self.counts.entry(self.last.0).or_default() += self.last.1;
            self.last = (ticks, 0);
        }
        self.last.1 += 1;
    }

    /// The median of the ticks in which it was known.
    fn median(mut self) -> Option<u32> {
        *self.counts.entry(self.last.0).or_default() += self.last.1;
        self.counts.remove(&0);
        let half = self.counts.values().sum::<u64>().div_ceil(2);
        let mut sum = 0;
        self.counts
            .into_iter()
            .find(|(_, count)| {
                sum += count;
                sum >= half
            })
            .map(|(ticks, _)| ticks)
    }
}

fn station(scenario: &Scenario, phases: &Phases, side: Side) -> Result<Station, ExperimentError> {
    let section = match side {
        Side::Master => &scenario.master,
        Side::Slave => &scenario.slave,
    };
    let dimsart = dimsart(scenario, section, side)?;
    let plant = plant(scenario, phases, section, side);
    let plant = plant.map_err(|error| ExperimentError::Plant { side: side.name(), error })?;
    Ok(Station::new(side.name(), dimsart, plant))
}

fn dimsart(
    scenario: &Scenario,
    section: &SideSection,
    side: Side,
) -> Result<Box<SimulatedDimsart>, ExperimentError> {
    let device = device(side.name(), scenario.dof, scenario.sample_period_s)?;
    let mut dimsart = Box::new(SimulatedDimsart::new(device).map_err(ExperimentError::Storage)?);
    let scheme = SchemeText::read(&section.scheme)?;
    let loaded = schemes::load(&scheme, side.name(), &settings(scenario, section), &mut dimsart);
    if !loaded.is_sound() {
        return Err(ExperimentError::Scheme { name: scheme.name, side: side.name(), loaded });
    }
    Ok(dimsart)
}

/// The simulated devices: positions out, forces in, linear axes.
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

/// What the scenario says about the schemes' parameters.
fn settings(scenario: &Scenario, section: &SideSection) -> Vec<Setting> {
    let form = match scenario.wave.form {
        WaveForm::Split => "SPLIT",
        WaveForm::Implicit => "IMPLICIT",
        WaveForm::Printed => "PRINTED",
    };
    let law = if scenario.wave.form == WaveForm::Implicit { "ON" } else { "OFF" };
    let stale = match scenario.link.stale {
        Stale::Zero => "ZERO",
        Stale::Hold => "HOLD",
        Stale::Limited => "LIMITED",
        Stale::Integral => "INTEGRAL",
    };
    let setting = |module, command, value: String| Setting { module, command, value };
    vec![
        setting("COMM_RXMOD", "STALE", stale.to_owned()),
        setting("WTRANSF_MOD", "B_PARAM", scenario.wave.impedance_ns_per_m.to_string()),
        setting("WTRANSF_MOD", "FORM", form.to_owned()),
        setting("PDCTRL_MOD", "K_PARAM", section.stiffness_n_per_m.to_string()),
        setting("PDCTRL_MOD", "D_PARAM", section.damping_ns_per_m.to_string()),
        setting("PDCTRL_MOD", "LAW_OUTPUT", law.to_owned()),
        setting("TIMEDELAY_MOD", "TD_PARAM", section.time_delay_ticks.to_string()),
    ]
}

fn plant(
    scenario: &Scenario,
    phases: &Phases,
    section: &SideSection,
    side: Side,
) -> Result<Box<dyn Plant>, ParameterError> {
    let axis = |axis| {
        let environment: Box<dyn Environment> = match side {
            Side::Master => Box::new(
                HandParameters {
                    mass_kg: scenario.hand.mass_kg,
                    damping_ns_per_m: scenario.hand.damping_ns_per_m,
                    stiffness_n_per_m: scenario.hand.stiffness_n_per_m,
                    phases: phases.hand(scenario, axis),
                }
                .build()?,
            ),
            Side::Slave => Box::new(
                WallParameters {
                    position_m: scenario.wall.position_m,
                    stiffness_n_per_m: scenario.wall.stiffness_n_per_m,
                    damping_ns_per_m: scenario.wall.damping_ns_per_m,
                    solid: WallSide::Above,
                }
                .build()?,
            ),
        };
        Axis::new(&section.device, section.motor.as_ref(), vec![environment])
    };
    Ok(Box::new(AxisWise::new((0..scenario.dof).map(axis).collect::<Result<_, _>>()?)))
}
