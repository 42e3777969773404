//! Stability of the loop of hand, controllers, link and environment as a linear system, by its largest eigenvalue,
//! independent of the run.
//!
//! One axis is simulated with the rig's controllers, links and plants, without nonlinear and random effects: Coulomb
//! friction, encoder quantisation, voltage limits, jitter, loss, bit errors. Hand and environment are struck, and the
//! second difference of both positions, which removes constant offsets and speeds, is evaluated. The largest
//! eigenvalue is its final growth per tick.

use core::ops::ControlFlow;
use std::panic::resume_unwind;
use std::thread::JoinHandle;

use serde::Serialize;

use super::{build, chain, moved_by};
use crate::experiment::ExperimentError;
use crate::link::{InProcessParameters, round_trip_ticks};
use crate::loop_figures::UNDECIDED;
use crate::observer::Observer;
use crate::outcome::Outcome;
use crate::plant::JointMotorParameters;
use crate::rig::Rig;
use crate::rig_file::{AxisSection, AxisSpring, DeviceSection, LOAD, MoveSection, RigFile, Step};

/// Speed of the master after the strike, `m/s`.
const STRUCK_M_PER_S: f64 = 0.1;
/// Maximum stretch of the slave's spring, `m`, per `m/s` of the strike.
const MAX_STRETCHED_M: f64 = 0.01;
/// Minimum and maximum evaluation time, ticks.
const MIN_TICKS: usize = 1_500;
const MAX_TICKS: usize = 64_000;
/// Minimum and maximum evaluation time in blocks, for long round trips.
const MIN_BLOCKS: usize = 8;
/// Minimum block length in ticks, and in round trips.
const MIN_BLOCK_TICKS: usize = 100;
const BLOCK_ROUND_TRIPS: usize = 2;
/// Relative RMS below which a block contains only rounding.
const ROUNDING: f64 = 1e-5;
/// Second difference at which growth is certain, and above which the controllers' numbers saturate, `m`.
const TOP_M: f64 = 0.1;
/// Ticks of the linearity test with half the strike, and its tolerance.
const HALF_TICKS: usize = 400;
const LINEAR_WITHIN: f64 = 0.02;

/// Conditions at both ends of the loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LoopCondition {
    /// The hand guides the master with its spring; the slave is free.
    Guided,
    /// The hand adds only its mass and damping; the slave is free.
    Free,
    /// As [`Free`](Self::Free), with the slave in permanent contact.
    Contact,
}

/// A linear loop.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LinearLoop {
    /// Its conditions.
    pub held: LoopCondition,
    /// Largest eigenvalue, the growth per tick: unstable if > 1. `None` for a nonlinear loop, which does not respond
    /// proportionally to half the strike.
    pub growth_per_tick: Option<f64>,
}

impl LoopCondition {
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
    /// Whether it is unstable.
    #[must_use]
    pub fn is_unstable(&self) -> bool {
        self.growth_per_tick.is_some_and(|growth| growth > 1.0 + UNDECIDED)
    }

    /// Whether its stability is undecided.
    #[must_use]
    pub fn is_undecided(&self) -> bool {
        self.growth_per_tick.is_some_and(|growth| (growth - 1.0).abs() <= UNDECIDED)
    }

    /// Fault message of an unstable loop.
    fn fault(&self, period_s: f64) -> Option<String> {
        let growth = self.growth_per_tick.filter(|_| self.is_unstable())?;
        let doubles_s = period_s * core::f64::consts::LN_2 / libm::log(growth);
        let held = self.held.words();
        Some(format!(
            "the loop ({held}) is unstable: disturbances grow by a factor of {growth:.6} per tick and double in \
        {doubles_s:.3} s"
        ))
    }

    /// Warning of an undecided loop.
    fn warning(&self) -> Option<String> {
        let held = self.held.words();
        let text =
            format!("the loop ({held}) is at its stability limit (growth within 1e-5 per tick): undecided");
        self.is_undecided().then_some(text)
    }
}

/// Computes the loops of a rig on a separate thread during the run.
#[derive(Debug)]
pub(super) struct Loops {
    file: RigFile,
    worked_out: Option<JoinHandle<Vec<LinearLoop>>>,
}

impl Loops {
    pub(super) fn new(file: &RigFile) -> Self {
        Self { file: file.clone(), worked_out: None }
    }
}

impl Observer for Loops {
    fn begin(&mut self) {
        let file = self.file.clone();
        // The rig was built before.
        self.worked_out = Some(std::thread::spawn(move || linear_loops(&file).unwrap_or_default()));
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
        outcome.stable &= !outcome.loops.iter().any(LinearLoop::is_unstable);
    }
}

/// Computes the loops of a rig with a [press](crate::rig_file::PressSection): guided, free, and in contact if it has
/// an obstacle. Empty for other rigs.
///
/// # Errors
/// As [`Experiment::new`](crate::experiment::Experiment::new).
pub fn linear_loops(file: &RigFile) -> Result<Vec<LinearLoop>, ExperimentError> {
    let Some(linear) = Linear::of(file) else { return Ok(Vec::new()) };
    let is_of_interest = |held: &LoopCondition| match held {
        LoopCondition::Guided => linear.hand_stiffness > 0.0,
        LoopCondition::Free => true,
        LoopCondition::Contact => linear.met.is_some(),
    };
    LoopCondition::ALL
        .into_iter()
        .filter(is_of_interest)
        .map(|held| Ok(LinearLoop { held, growth_per_tick: growth_per_tick(&linear, held)? }))
        .collect()
}

/// One axis of a rig without nonlinear and random effects, hand spring and obstacle.
struct Linear {
    file: RigFile,
    /// Devices of the hand and its peer, and their controllers.
    devices: [String; 2],
    controllers: [String; 2],
    hand_stiffness: f64,
    /// Stiffness and damping of the contact.
    met: Option<[f64; 2]>,
}

impl Linear {
    fn of(file: &RigFile) -> Option<Self> {
        let parts = file.press_pair()?;
        let devices = parts.each_ref().map(|part| part.device.name.clone());
        let controllers = parts.each_ref().map(|part| part.name().to_owned());
        let [held, other] = parts.each_ref().map(|part| part.sections().next().map(|(_, section)| section));
        let met = other.and_then(|section| {
            let wall = section.active_wall().map(|wall| [wall.stiffness(), wall.damping]);
            wall.or(section.active_spring().map(|spring| [spring.stiffness, spring.damping]))
        });
        let hand_stiffness = held.map_or(0.0, AxisSection::hand_stiffness);
        let mut file = file.clone();
        file.devices.iter_mut().for_each(|device| *device = of_one_axis(device));
        for link in &mut file.links {
            let delay_ticks = link.carrier.delay_ticks;
            link.carrier = InProcessParameters { delay_ticks, ..InProcessParameters::default() };
            link.key_file = None;
        }
        for bus in &mut file.buses {
            bus.uart
                .iter_mut()
                .for_each(|uart| (uart.bit_error_rate, uart.byte_drop, uart.byte_insert) = (0.0, 0.0, 0.0));
            bus.can.iter_mut().chain(&mut bus.can_fd).for_each(|can| can.bit_error_rate = 0.0);
            bus.udp.iter_mut().for_each(|udp| udp.burst_entry_probability = 0.0);
        }
        (file.experiment.press, file.experiment.moves) = (None, Vec::new());
        Some(Self { file, devices, controllers, hand_stiffness, met })
    }
}

fn of_one_axis(device: &DeviceSection) -> DeviceSection {
    let mut linear = device.linear(false);
    linear.axes.truncate(1);
    for axis in &mut linear.axes {
        (axis.environment, axis.spring) = (None, None);
        axis.hand.iter_mut().for_each(|hand| hand.stiffness = 0.0);
        if let Some(plant) = &mut axis.plant {
            plant.load.start_position = 0.0;
            match &mut plant.motor {
                JointMotorParameters::Ideal {} => {}
                JointMotorParameters::Brushed(motor) => motor.voltage_limit_v = f64::INFINITY,
                JointMotorParameters::ThreePhase(motor) => motor.current_limit_a = f64::INFINITY,
            }
        }
    }
    linear
}

fn growth_per_tick(linear: &Linear, held: LoopCondition) -> Result<Option<f64>, ExperimentError> {
    let mut whole = Struck::new(linear, held, STRUCK_M_PER_S)?;
    let mut half = Struck::new(linear, held, 0.5 * STRUCK_M_PER_S)?;
    let names = linear.controllers.each_ref().map(String::as_str);
    let round_trip_ticks = round_trip_ticks(&linear.file, names)? as usize + whole.delay_ticks;
    whole.listen(HALF_TICKS);
    let ticks = whole.squares.len();
    half.listen(ticks);
    let [whole_root, half_root] = [&whole, &half].map(|struck| struck.root_mean_square(0, ticks));
    if (0.5 * whole_root - half_root).abs() > LINEAR_WITHIN * half_root {
        return Ok(None);
    }
    let block_ticks = MIN_BLOCK_TICKS.max(BLOCK_ROUND_TRIPS * round_trip_ticks);
    let min_blocks = MIN_TICKS.div_ceil(block_ticks).max(MIN_BLOCKS);
    let max_blocks = MAX_TICKS.div_ceil(block_ticks).max(2 * MIN_BLOCKS);
    let mut blocks: Vec<f64> = Vec::new();
    while blocks.len() < max_blocks {
        let from = blocks.len() * block_ticks;
        whole.listen(from + block_ticks);
        blocks.push(whole.root_mean_square(from, from + block_ticks));
        if whole.is_over {
            blocks.pop();
            break;
        }
        let largest = blocks.iter().copied().fold(0.0, f64::max);
        if blocks.len() >= min_blocks && blocks.last().is_some_and(|last| *last < ROUNDING * largest) {
            break;
        }
    }
    let is_fast = whole.is_over && blocks.len() < MIN_BLOCKS;
    Ok(if is_fast { whole.fast_growth() } else { growth_of(&blocks, block_ticks) })
}

/// Growth of the second half of the blocks above rounding.
fn growth_of(blocks: &[f64], block_ticks: usize) -> Option<f64> {
    let largest = blocks.iter().copied().fold(0.0, f64::max);
    let is_heard = |block: &f64| *block > 3.0 * ROUNDING * largest;
    let heard = blocks.iter().rposition(is_heard).map_or(0, |last| last + 1);
    let Some(from) = heard.checked_sub(2).map(|before| (heard / 2).min(before)) else { return Some(0.0) };
    let logarithms = blocks.iter().take(heard).skip(from).map(|block| libm::log(*block));
    Some(libm::exp(slope(logarithms) / count(block_ticks)))
}

/// Slope of a least-squares line through values at 0, 1, 2, ....
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

/// A loop at rest, struck by the hand.
struct Struck {
    rig: Rig,
    delay_ticks: usize,
    /// Last two positions by station, `m`.
    last_m: [[f64; 2]; 2],
    /// Squared second difference of both positions by tick, `m²`.
    squares: Vec<f64>,
    /// Whether it has reached [`TOP_M`].
    is_over: bool,
}

impl Struck {
    fn new(linear: &Linear, held: LoopCondition, struck_m_per_s: f64) -> Result<Self, ExperimentError> {
        let mut file = linear.file.clone();
        let period_s = file.sample_period_s;
        let [hand, other] = &linear.devices;
        let axis =
            |file: &RigFile, name: &str| file.device(name).and_then(|device| device.axes.first().cloned());
        let (mut held_axis, mut met_axis) =
            (axis(&file, hand).unwrap_or_default(), axis(&file, other).unwrap_or_default());
        let [(mass_kg, _), (other_kg, _)] = [&held_axis, &met_axis].map(moved_by);
        let force_n = struck_m_per_s * mass_kg / period_s;
        let strike = |at_s: f64, size: f64| MoveSection {
            step: Some(Step { at_s, amplitude: size }),
            ..MoveSection::nothing(hand, LOAD)
        };
        file.experiment.moves = vec![strike(0.0, force_n), strike(period_s, -force_n)];
        if held == LoopCondition::Guided {
            held_axis.hand.iter_mut().for_each(|of| of.stiffness = linear.hand_stiffness);
        }
        if let Some([stiffness, damping]) = linear.met.filter(|_| held == LoopCondition::Contact) {
            // Displaced from rest, to strike the slave as hard as the master.
            let stretched = stiffness.max(f64::MIN_POSITIVE).recip() * struck_m_per_s * other_kg / period_s;
            let rest_position = stretched.min(MAX_STRETCHED_M * struck_m_per_s);
            met_axis.spring = Some(AxisSpring { rest_position, stiffness, damping });
        }
        for (name, axis) in [(hand, held_axis), (other, met_axis)] {
            let of_device = file.devices.iter_mut().find(|device| device.name == *name);
            of_device.into_iter().for_each(|device| device.axes = vec![axis.clone()]);
        }
        let mut rig = build::rig(&file, &[])?;
        let mut delay_ticks = 0;
        for station in rig.stations_mut() {
            let read = chain::Controller::read(&mut station.dimsart);
            delay_ticks += read.delay_ticks.unwrap_or(0) as usize;
        }
        Ok(Self { rig, delay_ticks, last_m: [[0.0; 2]; 2], squares: Vec::new(), is_over: false })
    }

    /// Runs for this number of ticks, or until it has grown.
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

    /// Growth of an unstable loop: of the maximum so far, in the second half of the ticks.
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
