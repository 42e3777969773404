//! The paper's bilateral experiment: a scenario becomes a rig, and runs.

pub mod border;
pub mod chain;
pub mod creep;
pub mod energy;
mod error;
mod guards;
pub mod linear_loop;
mod one_side;
mod peer;
pub mod perceived_stiffness;
pub mod phases;
pub mod round_trips;
mod side;
mod station;

use std::fs::File;
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::SyncSender;
use std::thread::JoinHandle;
use std::time::Instant;

use dimsart_core::{DataType, types};

pub use error::ExperimentError;
pub use side::Side;
pub use station::{device, settings};

use guards::{board_key, guard_both};
use one_side::Alone;
use station::{controller, station};

use crate::bilateral::chain::{Chain, Controller};
use crate::bilateral::energy::ChannelEnergy;
use crate::bilateral::linear_loop::{LinearLoop, linear_loops};
use crate::bilateral::perceived_stiffness::PerceivedStiffness;
use crate::bilateral::phases::Phases;
use crate::bilateral::round_trips::RoundTrips;
use crate::bus::MediumReport;
use crate::emulated::{Board, Image};
use crate::first_packet::first_packet;
use crate::limit_cycle::Swings;
use crate::link::{Carrier, Ends, TransitTicks};
use crate::outcome::{AxisOutcome, Outcome, RealTime};
use crate::pace::Pace;
use crate::port_energy::PortEnergy;
use crate::reception::{received, silences};
use crate::recorder::Recorder;
use crate::recording::{Piece, Recording};
use crate::rig::{End, Probe, Rig};
use crate::scenario::Scenario;
use crate::watch::{Alarm, Watch};
use peer::Peer;

/// Silence from the other process that is worth a word at the end of a run, ticks.
const SILENCE_TICKS: u32 = 100;
/// Share of late ticks that is a fault: now and then one is normal on a host.
const LATE_SHARE: f64 = 0.01;
/// Ticks between two looks at the progress.
const PROGRESS_TICKS: u64 = 512;

/// A rig made of a scenario, ready to run.
#[derive(Debug)]
pub struct Experiment {
    begun: Instant,
    scenario: Scenario,
    chain: Chain,
    phases: Phases,
    link_round_trip_ticks: u32,
    rig: Rig,
    /// None when nothing is to be kept.
    recorder: Option<Recorder>,
    /// None when both sides are simulated here.
    alone: Option<Alone>,
}

/// What a run leaves behind.
#[derive(Debug)]
pub struct Run {
    /// The figures.
    pub outcome: Outcome,
    /// The signals.
    pub recording: Recording,
    /// The rig, as the run left it.
    pub rig: Rig,
    /// When what happened.
    pub phases: Phases,
    /// What the simulated media came to.
    pub media: Vec<MediumReport>,
    /// What broke the run off before its end, beyond what can happen in it.
    pub broken: Option<ExperimentError>,
}

impl Experiment {
    /// Both sides in one process and one virtual time.
    ///
    /// # Errors
    /// [`ExperimentError`] when device, plant or scheme cannot be made of the scenario.
    pub fn new(scenario: &Scenario) -> Result<Self, ExperimentError> {
        let begun = Instant::now();
        let mut master = controller(scenario, Side::Master)?;
        let mut slave = controller(scenario, Side::Slave)?;
        let chain = chain(scenario, Controller::read(&mut master), Controller::read(&mut slave))?;
        let carrier = Carrier::new(scenario)?;
        let link_round_trip_ticks = carrier.round_trip_ticks();
        let phases = Phases::new(scenario, &chain, link_round_trip_ticks);
        let mut rig = Rig::new(scenario.sample_period_s);
        let master = rig.add(station(scenario, &phases, Side::Master, master)?);
        let slave = rig.add(station(scenario, &phases, Side::Slave, slave)?);
        let end = |station| End { station, link: 0 };
        let channel = |station: usize| {
            rig.stations().get(station).map_or(0, |station| station.dimsart.listening_channel(0))
        };
        let ends = Ends { forward_channel: channel(slave), backward_channel: channel(master) };
        let [forward, backward] = carrier.connect(ends);
        guard_both(scenario, &mut rig, ends)?;
        rig.connect(end(master), end(slave), forward);
        rig.connect(end(slave), end(master), backward);
        let recorder = Some(Recorder::new(&rig, &scenario.record)?);
        let scenario = scenario.clone();
        Ok(Self { begun, scenario, chain, phases, link_round_trip_ticks, rig, recorder, alone: None })
    }

    /// Words of the packets that the scenario's schemes send for one axis, from master and from slave; 0 for a side
    /// that sends none.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn words_of_one_axis(scenario: &Scenario) -> Result<[usize; 2], ExperimentError> {
        let mut words = [0; 2];
        for (words, side) in words.iter_mut().zip([Side::Master, Side::Slave]) {
            let mut dimsart = controller(&Scenario { dof: 1, ..scenario.clone() }, side)?;
            *words = first_packet(&mut dimsart, 0).map_or(0, |packet| packet.words.len());
        }
        Ok(words)
    }

    /// Lets the controller of a side run as firmware on an emulated board. The firmware's log goes to `log`. Where the
    /// scenario names a key and the image takes one, it is the firmware that authenticates packets.
    ///
    /// # Errors
    /// [`ExperimentError::Emulated`] when image or emulator are not there or not the right ones.
    pub fn emulate(
        &mut self,
        side: Side,
        image: &Image,
        mut log: Option<File>,
    ) -> Result<(), ExperimentError> {
        let stations = self.rig.stations_mut();
        for station in stations.iter_mut().filter(|station| station.name == side.name()) {
            let key = board_key(&self.scenario, side)?.filter(|_| image.is_authenticated());
            let board = Board::start(image, &mut station.dimsart, key, log.take());
            let board =
                board.map_err(|source| ExperimentError::Emulated { side: side.name().to_owned(), source })?;
            station.move_to(board);
        }
        Ok(())
    }

    /// When what happens.
    #[must_use]
    pub fn phases(&self) -> &Phases {
        &self.phases
    }

    /// The rig, to look at or to change before it runs.
    pub fn rig_mut(&mut self) -> &mut Rig {
        &mut self.rig
    }

    /// Ticks of a round trip when nothing on the way is late: [the link's](Carrier::round_trip_ticks) and the delay
    /// modules' of both schemes; none when the other side's scheme is not at hand.
    #[must_use]
    pub fn round_trip_ticks(&self) -> Option<u32> {
        Some(self.link_round_trip_ticks.saturating_add(self.chain.delay_ticks()?))
    }

    /// Keeps no signals, and takes no memory for them: the run's [`recording`](Run::recording) will be empty.
    #[must_use]
    pub fn without_recording(self) -> Self {
        Self { recorder: None, ..self }
    }

    /// Tells `listener` every row of the run as it is recorded; see [`Recorder::tell`].
    pub fn tell(&mut self, listener: SyncSender<Piece>) {
        if let Some(recorder) = &mut self.recorder {
            recorder.tell(listener);
        }
    }

    /// Keeps of a long run what pictures need, in memory that does not grow with its length. A [listener](Self::tell) hears
    /// every row.
    pub fn keep_for_pictures(&mut self) {
        if let Some(recorder) = &mut self.recorder {
            recorder.keep_for_pictures();
        }
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
        let mut recorder = self.recorder.take();
        if let Some(recorder) = &mut recorder {
            recorder.reserve(end_s / self.scenario.sample_period_s);
        }
        let mut energy = ChannelEnergy::new(&self.rig);
        let mut port_energy = PortEnergy::default();
        let mut swings = self.swings(end_s);
        let mut watch = Watch::new(&self.rig, [self.scenario.limits.ranges(); 2]);
        let mut perceived = PerceivedStiffness::new(&self.chain.obstacles, self.phases.settled());
        let mut round_trips = RoundTrips::default();
        let unlike = self.chain.unlike_impedances_ns_per_m().map(|[master, slave]| {
            format!(
                "the wave impedances differ, {master} N s/m on the master and {slave} N s/m on the slave: forces and \
                 motions are scaled, and no stiffness is predicted; give both schemes the same B_PARAM"
            )
        });
        let loops = self.begin_loops();
        let (mut faults, mut is_stable, mut broken) = (Vec::new(), true, None);
        let settled = self.phases.settled();
        let mut pace = self.alone.map(|alone| Pace::new(alone.start, self.scenario.sample_period_s));
        let side = self.alone.map(|alone| alone.side);
        let half_tick_s = 0.5 * self.scenario.sample_period_s;
        let mut peer = Peer::new(&self.rig);
        while self.rig.time_s() < end_s - half_tick_s {
            if stop.load(Ordering::Relaxed) {
                faults.push(format!("stopped by the user at {:.3} s", self.rig.time_s()));
                break;
            }
            if self.rig.ticks().is_multiple_of(PROGRESS_TICKS) {
                progress(self.rig.time_s());
            }
            if let Some(pace) = &mut pace {
                pace.wait_for(self.rig.time_s());
            }
            self.rig.tick();
            if let Some((side, source)) = self.rig.trouble() {
                broken = Some(ExperimentError::Emulated { side, source });
                faults.push(format!("broken off at {:.3} s", self.rig.time_s()));
                is_stable = false;
                break;
            }
            energy.add(&self.rig);
            if let Some(recorder) = &mut recorder {
                recorder.record(&self.rig, &energy.energy_j());
            }
            port_energy.add(&self.rig);
            swings.add(&self.rig);
            round_trips.add(&self.rig);
            if settled.contains(&self.rig.time_s()) {
                let is_pushed = |axis| self.scenario.contact_force_n(axis).abs() > 0.0;
                let slave = self.rig.stations().last().filter(|_| side != Some(Side::Master));
                let touches =
                    |axis| is_pushed(axis) && slave.is_none_or(|slave| slave.plant.is_touching(axis));
                perceived.add(&self.rig, touches);
            }
            match watch.look(&self.rig) {
                None => {}
                Some(Alarm::LinkLost(lost)) => faults.extend(lost),
                Some(Alarm::Grows(fault)) => {
                    faults.push(fault);
                    is_stable = false;
                }
                Some(Alarm::Left(fault)) => {
                    faults.push(fault);
                    is_stable = false;
                    break;
                }
            }
            peer.look(&self.rig);
            self.rig.advance();
        }
        let loops =
            loops.map_or_else(Vec::new, |loops| loops.join().unwrap_or_else(|panic| resume_unwind(panic)));
        let wall_s = self.begun.elapsed().as_secs_f64();
        let of_loops = loops.iter().filter_map(|one| one.fault(self.scenario.sample_period_s));
        faults.splice(..0, unlike.into_iter().chain(of_loops));
        is_stable &= !loops.iter().any(LinearLoop::grows);
        let is_over = self.rig.time_s() >= end_s - self.scenario.sample_period_s;
        let mut undecided = Vec::new();
        let limit_cycles = match is_over {
            true => swings.found(&self.rig, &mut faults, &mut undecided),
            false => Vec::new(),
        };
        is_stable &= undecided.is_empty() && !limit_cycles.iter().any(|cycle| cycle.is_chatter);
        faults.extend(undecided);
        // A side that runs alone has met the other one before.
        let both = self.rig.stations().iter().filter(|_| self.alone.is_none());
        let silences: Vec<_> = both.flat_map(|station| silences(station, self.rig.ticks())).collect();
        is_stable &= !silences.iter().any(|silence| silence.is_refusal);
        faults.extend(silences.into_iter().map(|silence| silence.text));
        let media = self.rig.media();
        faults.extend(media.iter().flat_map(|medium| medium.faults.clone()));
        progress(self.rig.time_s());
        let real_time = side.zip(pace).map(|(side, pace)| self.real_time(side, &pace, &mut faults));
        // The channel's energy takes the waves of both ends.
        let energy_min_j = energy.smallest_j().filter(|_| side.is_none());
        let outcome = self.outcome(is_stable, wall_s, energy_min_j, round_trips.median(), &perceived, faults);
        let media_traffic = media.iter().map(|medium| medium.traffic.clone()).collect();
        let outcome = outcome.with_received(self.rig.stations().iter().filter_map(received).collect());
        let creep = if side.is_none() { self.creep(&outcome.received) } else { Vec::new() };
        let outcome = if creep.is_empty() { outcome } else { outcome.without_prediction() };
        let undecided = loops.iter().filter_map(LinearLoop::warning);
        let peer = side.map(|side| peer.warnings(&self.rig, &self.scenario, side)).unwrap_or_default();
        let warnings = undecided
            .chain(creep)
            .chain(perceived.unsettled().filter(|_| side.is_none()))
            .chain(peer)
            .collect();
        let energy_ports_min_j = (side.is_none() && outcome.ticks > 0).then(|| port_energy.smallest_j());
        let outcome = Outcome {
            real_time,
            media: media_traffic,
            energy_ports_min_j,
            rounding_creep_m_per_h: self.rounding_creep_m_per_h().filter(|_| side.is_none()),
            limit_cycles,
            loops,
            warnings,
            ..outcome
        };
        Run {
            outcome,
            recording: recorder.map(Recorder::finish).unwrap_or_default(),
            rig: self.rig,
            phases: self.phases,
            media,
            broken,
        }
    }

    /// Works out the loops, beside the run. None for one side alone. A scenario that made an experiment makes its loops.
    fn begin_loops(&self) -> Option<JoinHandle<Vec<LinearLoop>>> {
        let scenario = self.alone.is_none().then(|| self.scenario.clone())?;
        Some(std::thread::spawn(move || linear_loops(&scenario).unwrap_or_default()))
    }

    /// Watches every axis from the hand's push on until it lets go: nothing is to swing when that has settled.
    fn swings(&self, end_s: f64) -> Swings {
        let Phases { contact_start_s, release_s, .. } = self.phases;
        Swings::new(&self.rig, |_| vec![contact_start_s..release_s.min(end_s)])
    }

    /// What the clock and the other process did to the run.
    fn real_time(&self, side: Side, pace: &Pace, faults: &mut Vec<String>) -> RealTime {
        let link = |signal: &DataType| {
            let station = self.rig.stations().first();
            station.and_then(|station| Probe::new(signal.first()).words(station).first().copied())
        };
        let late_ticks = pace.late_ticks();
        #[expect(clippy::cast_precision_loss, reason = "far fewer ticks than 2^53")]
        if late_ticks as f64 > LATE_SHARE * self.rig.ticks() as f64 {
            let ticks = self.rig.ticks();
            faults.push(format!(
                "{late_ticks} of {ticks} ticks came more than a period late: this machine is busy"
            ));
        }
        if let Some(silence_ticks) = link(types::LINK_AGE).filter(|ticks| *ticks > SILENCE_TICKS) {
            let other = side.other().name();
            faults.push(format!(
                "nothing came from the {other} in the last {silence_ticks} ticks: it ended first"
            ));
        }
        RealTime { side: side.name(), late_ticks, worst_lateness_s: pace.worst_lateness_s() }
    }

    /// Ticks that a wave takes over the link there and back, when an echo takes `echo_ticks` on median.
    fn there_and_back_ticks(&self, echo_ticks: u32) -> u32 {
        let Self { chain, scenario, .. } = self;
        // In the order of the connections. Play-out counts from the fastest packet.
        let playout_ticks = [chain.slave.playout_ticks, chain.master.playout_ticks];
        let is_played_out = playout_ticks.iter().any(|ticks| *ticks > 0);
        // Where packets are rarer than ticks, an echo waits for the next one; the wave does not.
        let waits = scenario.link.every_ticks.is_some_and(|ticks| ticks > 1);
        if self.alone.is_some() || !(waits || is_played_out) {
            return echo_ticks;
        }
        let ways = self.rig.transit_ticks().zip(playout_ticks).map(|(transit, playout_ticks)| {
            let TransitTicks { mean, shortest } = transit?;
            #[expect(clippy::cast_precision_loss, reason = "far fewer ticks than 2^53")]
            Some(if playout_ticks > 0 { shortest as f64 } else { mean })
        });
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a cast saturates")]
        let measured = ways.sum::<Option<f64>>().map(|ticks| ticks.round() as u32);
        measured.unwrap_or(self.link_round_trip_ticks)
    }

    fn outcome(
        &self,
        stable: bool,
        wall_s: f64,
        energy_min_j: Option<f64>,
        link_round_trip_ticks: Option<u32>,
        perceived: &PerceivedStiffness,
        faults: Vec<String>,
    ) -> Outcome {
        let dof = self.scenario.dof;
        let link_round_trip_ticks = link_round_trip_ticks.map(|echo| self.there_and_back_ticks(echo));
        let delay_ticks = self.chain.delay_ticks();
        let round_trip_ticks = link_round_trip_ticks.zip(delay_ticks).map(|(link, delay)| link + delay);
        let predicted = |axis| {
            let round_trip_s = f64::from(round_trip_ticks?) * self.scenario.sample_period_s;
            self.chain.stiffness_n_per_m(axis, round_trip_s)
        };
        let perceived = if self.alone.is_some_and(|alone| alone.side == Side::Slave) {
            vec![None; dof]
        } else {
            perceived.per_axis()
        };
        let axes = perceived.into_iter().enumerate().map(|(axis, k_perceived_n_per_m)| AxisOutcome {
            axis,
            k_perceived_n_per_m,
            k_predicted_n_per_m: predicted(axis),
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

fn chain(scenario: &Scenario, master: Controller, slave: Controller) -> Result<Chain, ExperimentError> {
    let chain = Chain::new(scenario, master, slave);
    chain.map_err(|error| ExperimentError::Plant { side: Side::Slave.name(), error })
}
