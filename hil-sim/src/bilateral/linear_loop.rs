//! Whether the loop of hand, controllers, link and environment grows or dies out, as a linear system: by its largest
//! eigenvalue, whatever a run happens to show of it.
//!
//! One axis is put together from the scenario's own controllers, links and plants, without what is not linear or is
//! chance: dry friction, encoder steps, a motor's voltage limit, jitter, loss, bit errors. Hand and environment strike
//! it, and what it does then is listened to: the second difference of both positions, of which a constant offset or speed
//! leaves nothing. The largest eigenvalue is by how much that grows from tick to tick in the end.

use core::ops::ControlFlow;
use std::panic::resume_unwind;
use std::thread::JoinHandle;

use serde::Serialize;

use super::Side;
use super::station::{controller, station_held};
use crate::experiment::ExperimentError;
use crate::link::{Carrier, Ends};
use crate::observer::Observer;
use crate::outcome::Outcome;
use crate::plant::{EnvironmentKind, HandPhase, RIGID_STIFFNESS_N_PER_M, SpringParameters};
use crate::rig::{End, Rig};
use crate::scenario::Scenario;

/// Speed that the hand's strike gives the master alone, `m/s`.
const STRUCK_M_PER_S: f64 = 0.1;
/// How far the slave's spring is stretched at most, `m`, for each `m/s` of that.
const MOST_STRETCHED_M: f64 = 0.01;
/// Growth per tick, up or down, that is not told from none.
pub const UNDECIDED: f64 = 1e-5;
/// Shortest and longest time that is listened for, ticks.
const LEAST_TICKS: usize = 1_500;
const MOST_TICKS: usize = 64_000;
/// The same in blocks: long round trips take longer.
const LEAST_BLOCKS: usize = 8;
/// Ticks that are looked at together, at least, and the same in round trips.
const LEAST_BLOCK_TICKS: usize = 100;
const BLOCK_ROUND_TRIPS: usize = 2;
/// Share of the largest block, as a root mean square, below which there is only rounding.
const ROUNDING: f64 = 1e-5;
/// Second difference at which growth is beyond doubt, and above which the controllers' numbers come to their ends, `m`.
const TOP_M: f64 = 0.1;
/// Ticks in which a strike half as hard is answered half as much by what is linear, and how exactly.
const HALF_TICKS: usize = 400;
const LINEAR_WITHIN: f64 = 0.02;

/// What acts on both ends of the loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Held {
    /// The hand guides the master by its spring; the slave is free.
    Guided,
    /// The hand holds the master by its mass and damping alone; the slave is free.
    Free,
    /// The same, and the slave stays in contact with what it meets.
    Contact,
}

/// One linear loop.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LinearLoop {
    /// What acts on it.
    pub held: Held,
    /// Its largest eigenvalue: by how much what is struck grows (> 1) or dies out in a tick. None for a loop that is not
    /// linear: struck half as hard, it does not answer by half.
    pub growth_per_tick: Option<f64>,
}

impl Held {
    const ALL: [Self; 3] = [Self::Guided, Self::Free, Self::Contact];

    fn words(self) -> &'static str {
        match self {
            Self::Guided => "guided by the hand",
            Self::Free => "free",
            Self::Contact => "in contact",
        }
    }
}

impl LinearLoop {
    /// Whether it grows for certain.
    #[must_use]
    pub fn grows(&self) -> bool {
        self.growth_per_tick.is_some_and(|growth| growth > 1.0 + UNDECIDED)
    }

    /// Whether it is not told if it grows.
    #[must_use]
    pub fn is_undecided(&self) -> bool {
        self.growth_per_tick.is_some_and(|growth| (growth - 1.0).abs() <= UNDECIDED)
    }

    /// What is wrong with one that grows, in words.
    fn fault(&self, period_s: f64) -> Option<String> {
        let growth = self.growth_per_tick.filter(|_| self.grows())?;
        let doubles_s = period_s * core::f64::consts::LN_2 / libm::log(growth);
        let held = self.held.words();
        Some(format!("the loop {held} grows by {growth:.6} per tick: it doubles in {doubles_s:.3} s"))
    }

    /// Of one that is not told from either, in words.
    fn warning(&self) -> Option<String> {
        let held = self.held.words();
        let text = format!("the loop {held} neither grows nor dies out within 1e-5 per tick: undecided");
        self.is_undecided().then_some(text)
    }
}

/// Works out the loops of a scenario on a thread of its own during the run.
#[derive(Debug)]
pub(super) struct Loops {
    scenario: Scenario,
    worked_out: Option<JoinHandle<Vec<LinearLoop>>>,
}

impl Loops {
    pub(super) fn new(scenario: &Scenario) -> Self {
        Self { scenario: scenario.clone(), worked_out: None }
    }
}

impl Observer for Loops {
    fn begin(&mut self) {
        let scenario = self.scenario.clone();
        // A scenario that makes an experiment makes its loops.
        self.worked_out = Some(std::thread::spawn(move || linear_loops(&scenario).unwrap_or_default()));
    }

    fn observe(&mut self, _rig: &Rig) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    fn report(&mut self, rig: &Rig, outcome: &mut Outcome) {
        let worked_out = self.worked_out.take().map(JoinHandle::join);
        outcome.loops =
            worked_out.map_or_else(Vec::new, |loops| loops.unwrap_or_else(|panic| resume_unwind(panic)));
        outcome.faults.extend(outcome.loops.iter().filter_map(|one| one.fault(rig.period_s())));
        outcome.warnings.extend(outcome.loops.iter().filter_map(LinearLoop::warning));
        outcome.stable &= !outcome.loops.iter().any(LinearLoop::grows);
    }
}

/// The loops of a scenario: guided, free, and in contact where there is something to meet.
///
/// # Errors
/// As [`Experiment::new`](crate::experiment::Experiment::new).
pub fn linear_loops(scenario: &Scenario) -> Result<Vec<LinearLoop>, ExperimentError> {
    let meets = scenario.environment != EnvironmentKind::Nothing;
    let has_spring = scenario.hand.stiffness_n_per_m > 0.0;
    let is_of_interest = |held: &Held| match held {
        Held::Guided => has_spring,
        Held::Free => true,
        Held::Contact => meets,
    };
    let linear = linear(scenario);
    Held::ALL
        .into_iter()
        .filter(is_of_interest)
        .map(|held| Ok(LinearLoop { held, growth_per_tick: growth_per_tick(&linear, held)? }))
        .collect()
}

/// One axis of it without what is not linear, or is chance.
fn linear(scenario: &Scenario) -> Scenario {
    let mut linear = Scenario { dof: 1, ..scenario.clone() };
    for side in [&mut linear.master, &mut linear.slave] {
        side.device.coulomb_friction_n = 0.0;
        side.device.encoder_step_m = 0.0;
        side.device.start_position_m = 0.0;
        if let Some(motor) = &mut side.motor {
            motor.voltage_limit_v = f64::INFINITY;
        }
    }
    let link = &mut linear.link;
    (link.loss, link.duplication, link.reordering, link.jitter_ticks) = (0.0, 0.0, 0.0, 0);
    link.key_file = None;
    (linear.uart.bit_error_rate, linear.uart.byte_drop, linear.uart.byte_insert) = (0.0, 0.0, 0.0);
    linear.can.bit_error_rate = 0.0;
    linear.udp.burst_start = 0.0;
    linear
}

fn growth_per_tick(linear: &Scenario, held: Held) -> Result<Option<f64>, ExperimentError> {
    let mut whole = Struck::new(linear, held, STRUCK_M_PER_S)?;
    let mut half = Struck::new(linear, held, 0.5 * STRUCK_M_PER_S)?;
    let round_trip_ticks = Carrier::new(linear)?.round_trip_ticks() as usize + whole.delay_ticks;
    whole.listen(HALF_TICKS);
    let ticks = whole.squares.len();
    half.listen(ticks);
    let [whole_root, half_root] = [&whole, &half].map(|struck| struck.root_mean_square(0, ticks));
    if (0.5 * whole_root - half_root).abs() > LINEAR_WITHIN * half_root {
        return Ok(None);
    }
    let block_ticks = LEAST_BLOCK_TICKS.max(BLOCK_ROUND_TRIPS * round_trip_ticks);
    let least_blocks = LEAST_TICKS.div_ceil(block_ticks).max(LEAST_BLOCKS);
    let most_blocks = MOST_TICKS.div_ceil(block_ticks).max(2 * LEAST_BLOCKS);
    let mut blocks: Vec<f64> = Vec::new();
    while blocks.len() < most_blocks {
        let from = blocks.len() * block_ticks;
        whole.listen(from + block_ticks);
        blocks.push(whole.root_mean_square(from, from + block_ticks));
        if whole.is_over {
            blocks.pop();
            break;
        }
        let largest = blocks.iter().copied().fold(0.0, f64::max);
        if blocks.len() >= least_blocks && blocks.last().is_some_and(|last| *last < ROUNDING * largest) {
            break;
        }
    }
    let is_fast = whole.is_over && blocks.len() < LEAST_BLOCKS;
    Ok(if is_fast { whole.fast_growth() } else { growth_of(&blocks, block_ticks) })
}

/// Of the second half of the blocks up to the last one that is more than rounding.
fn growth_of(blocks: &[f64], block_ticks: usize) -> Option<f64> {
    let largest = blocks.iter().copied().fold(0.0, f64::max);
    let is_heard = |block: &f64| *block > 3.0 * ROUNDING * largest;
    let heard = blocks.iter().rposition(is_heard).map_or(0, |last| last + 1);
    let Some(from) = heard.checked_sub(2).map(|before| (heard / 2).min(before)) else { return Some(0.0) };
    let logarithms = blocks.iter().take(heard).skip(from).map(|block| libm::log(*block));
    Some(libm::exp(slope(logarithms) / count(block_ticks)))
}

/// Of the straight line through values at 0, 1, 2..., by least squares.
fn slope(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let middle = 0.5 * (count(values.len()) - 1.0);
    let sums = values.enumerate().fold((0.0, 0.0), |(products, squares), (at, value)| {
        let away = count(at) - middle;
        (products + away * value, squares + away * away)
    });
    sums.0 / sums.1
}

#[expect(clippy::cast_precision_loss, reason = "far fewer ticks than 2^53")]
fn count(ticks: usize) -> f64 {
    ticks as f64
}

/// A loop at rest that the hand has struck.
struct Struck {
    rig: Rig,
    delay_ticks: usize,
    /// By station, its last two positions, `m`.
    last_m: [[f64; 2]; 2],
    /// By tick, the square of the second difference of both positions, `m²`.
    squares: Vec<f64>,
    /// Whether it has grown up to [`TOP_M`].
    is_over: bool,
}

impl Struck {
    fn new(linear: &Scenario, held: Held, struck_m_per_s: f64) -> Result<Self, ExperimentError> {
        let mut scenario = linear.clone();
        let period_s = scenario.sample_period_s;
        scenario.environment = match (held, scenario.environment) {
            (Held::Contact, EnvironmentKind::Wall) => {
                let wall = &scenario.environments.wall;
                scenario.environments.spring = SpringParameters {
                    rest_position_m: 0.0,
                    stiffness_n_per_m: wall.stiffness_n_per_m.min(RIGID_STIFFNESS_N_PER_M),
                    damping_ns_per_m: wall.damping_ns_per_m,
                };
                EnvironmentKind::Spring
            }
            (Held::Contact, kind) => kind,
            _ => EnvironmentKind::Nothing,
        };
        // Off its rest, so that the slave is struck, too, and as hard as the master.
        let spring = &mut scenario.environments.spring;
        let stretched_m_per_n = spring.stiffness_n_per_m.max(f64::MIN_POSITIVE).recip();
        let slave_n = struck_m_per_s * scenario.slave.device.mass_kg / period_s;
        spring.rest_position_m = (slave_n * stretched_m_per_n).min(MOST_STRETCHED_M * struck_m_per_s);
        let mass_kg = scenario.hand.mass_kg + scenario.master.device.mass_kg;
        let force_n = struck_m_per_s * mass_kg / period_s;
        let mut phases = vec![HandPhase::Push { start_s: 0.0, end_s: period_s, force_n }];
        if held == Held::Guided {
            phases.push(HandPhase::Hold { start_s: period_s, end_s: f64::INFINITY, target_m: 0.0 });
        }
        let mut rig = Rig::new(period_s);
        let mut channels = [0; 2];
        let mut delay_ticks = 0;
        for (channel, side) in channels.iter_mut().zip([Side::Master, Side::Slave]) {
            let mut dimsart = controller(&scenario, side)?;
            delay_ticks += super::chain::Controller::read(&mut dimsart).delay_ticks.unwrap_or(0) as usize;
            *channel = dimsart.listening_channel(0);
            rig.add(station_held(&scenario, &phases, side, dimsart)?);
        }
        let [backward_channel, forward_channel] = channels;
        let [forward, backward] =
            Carrier::new(&scenario)?.connect(Ends { forward_channel, backward_channel });
        let end = |station| End { station, link: 0 };
        rig.connect(end(0), end(1), forward);
        rig.connect(end(1), end(0), backward);
        Ok(Self { rig, delay_ticks, last_m: [[0.0; 2]; 2], squares: Vec::new(), is_over: false })
    }

    /// Goes on until so many ticks are over, or it has grown.
    fn listen(&mut self, ticks: usize) {
        while self.squares.len() < ticks && !self.is_over {
            self.rig.step();
            let mut square = 0.0;
            for (station, last_m) in self.rig.stations().iter().zip(&mut self.last_m) {
                let now_m = station.plant.position(0);
                let [before_m, last] = *last_m;
                let second = now_m - 2.0 * last + before_m;
                square += second * second;
                *last_m = [last, now_m];
            }
            self.is_over = square.is_nan() || square >= TOP_M * TOP_M;
            self.squares.push(square);
        }
    }

    fn root_mean_square(&self, from: usize, to: usize) -> f64 {
        let squares = self.squares.get(from..to).unwrap_or_default();
        libm::sqrt(squares.iter().sum::<f64>() / count(squares.len().max(1)))
    }

    /// Of what grew beyond doubt: of the largest answer so far, in the second half of the ticks.
    fn fast_growth(&self) -> Option<f64> {
        let mut most = 0.0_f64;
        let largest: Vec<f64> = self
            .squares
            .iter()
            .map(|square| {
                most = most.max(*square);
                0.5 * libm::log(most.max(f64::MIN_POSITIVE))
            })
            .collect();
        (largest.len() > 2).then(|| libm::exp(slope(largest.iter().skip(largest.len() / 2).copied())))
    }
}
