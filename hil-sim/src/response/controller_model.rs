//! Answers of a rig's controllers to a measurement disturbed in one tick, with devices at rest.
//!
//! ```text
//!   h[k] = taps[k] + level + slope k
//! ```
//! An integrator keeps a level, two integrators in series a slope; other answers decay. Controllers, links and buses
//! are those of the rig; two rigs are compared, one of them disturbed. Half of the disturbance with opposite sign
//! must give half the answer with opposite sign; otherwise the controllers are nonlinear and the next smaller
//! disturbance is tried.

use std::borrow::Cow;

use super::build;
use super::series::{BLOCK_TICKS, Moments, Series, moments};
use crate::experiment::ExperimentError;
use crate::rig::{FrameOverride, Rig};
use crate::rig_file::{LinkSection, RigFile};
use dimsart_core::TickResult;

/// Disturbances in the unit of the measurement, largest first, for the best resolution in `f32`.
const SIZES: [f32; 4] = [1.0 / 64.0, 1.0 / 1024.0, 1.0 / 16_384.0, 1.0 / 262_144.0];
/// Maximum share of an answer that does not scale with the disturbance.
const LINEAR: f64 = 0.01;
/// Relative level of a decayed answer: initial value, and maximum growth after these ticks each. Rounding of a
/// controller may never decay.
const MIN_OVER: f64 = 1e-9;
const OVER_TICKS: usize = 1_000;
const MAX_OVER: f64 = 1e-6;
/// Relative rounding of a command.
const ROUNDING: f64 = 3e-7;
/// Tolerances below which a level counts as 0: for this disturbance and the previous one.
const LEFT: f64 = 8.0;
/// Additional ticks for which an answer must have decayed, beyond the memory of the controllers.
const QUIET_TICKS: usize = 32;
/// Ticks before linear growth counts as two integrators.
const SLOPE_TICKS: usize = 2_000;
/// Maximum ticks of a packet on a bus.
const BUS_TICKS: usize = 16;
/// Maximum length of an answer, and of the memory.
const MAX_TICKS: usize = 60_000;
const MAX_QUIET_TICKS: usize = 20_000;
/// Maximum cycle of controllers with different rates.
const MAX_CYCLE_TICKS: usize = 200;

/// Index in a controller's frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Place {
    pub(super) station: usize,
    pub(super) place: usize,
}

/// Answer of one command to one measurement.
#[derive(Debug, Clone, Default)]
pub(super) struct Answer {
    taps: Vec<f64>,
    /// Sums of blocks.
    moments: Vec<Moments>,
    level: f64,
    slope: f64,
    /// Perturbs it by rounding.
    rounding: f64,
}

/// Controllers of a rig, disturbed one measurement at a time.
#[derive(Debug)]
pub(super) struct Controllers<'f> {
    file: &'f RigFile,
    commands: Vec<Place>,
    /// Ticks after which the same modules run again.
    pub(super) cycle_ticks: usize,
    quiet_ticks: usize,
    pair: Option<Pair>,
}

/// Two rigs at rest, one of them disturbed.
#[derive(Debug)]
struct Pair {
    still: Rig,
    disturbed: Rig,
    /// Commands of the undisturbed rig, and for how many ticks they have been constant: beyond the memory they cannot
    /// change.
    commands: Vec<f64>,
    unchanged_ticks: usize,
    quiet_ticks: usize,
    /// Difference of the disturbed rig's commands, by tick.
    differences: Vec<Vec<f64>>,
    /// Magnitude of the commands, for their rounding.
    sizes: Vec<f64>,
    /// Upper bound of the residue of the last disturbance.
    settled: Vec<f64>,
}

impl<'f> Controllers<'f> {
    /// Creates the model of a rig and its commands; `None` without a sufficiently short cycle.
    ///
    /// # Errors
    /// As [`Experiment::new`](super::Experiment::new).
    pub(super) fn new(file: &'f RigFile, commands: Vec<Place>) -> Result<Option<Self>, ExperimentError> {
        let rig = build::rig(file, &[])?;
        let (mut cycle_ticks, mut memory_ticks) = (1, 0);
        for station in rig.stations() {
            let engine = station.dimsart.engine();
            let rates = engine.instances().filter_map(|module| engine.module_rate(module));
            let own = rates.map(|rate| usize::from(rate.every_ticks)).fold(1, least_common_multiple);
            let cycle = own.saturating_mul(station.ticks_per_step());
            cycle_ticks = least_common_multiple(cycle_ticks, cycle);
            // A delay line uses one word per sample; other modules delay by at most one tick.
            let data_base = engine.data_base();
            let is_signal = |slot: u8| data_base.signals().any(|(signal, _)| signal == slot);
            let lines = (0..=u8::MAX).filter(|slot| !is_signal(*slot));
            memory_ticks += lines.map(|slot| data_base.words(slot).len()).sum::<usize>();
            memory_ticks += engine.instances().count();
        }
        // Round trip over a bus.
        let link_ticks = |link: &LinkSection| link.carrier.delay_ticks as usize + BUS_TICKS;
        let on_the_way: usize = file.links.iter().map(link_ticks).sum();
        let quiet_ticks = memory_ticks.saturating_mul(cycle_ticks).saturating_add(on_the_way + QUIET_TICKS);
        let quiet_ticks = quiet_ticks.min(MAX_QUIET_TICKS);
        let is_short = cycle_ticks <= MAX_CYCLE_TICKS;
        Ok(is_short.then_some(Self { file, commands, cycle_ticks, quiet_ticks, pair: None }))
    }

    /// Returns the answers of all commands to a measurement disturbed in one tick of a cycle; `None` if nonlinear or
    /// not decaying.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub(super) fn answers(
        &mut self,
        place: Place,
        phase: usize,
    ) -> Result<Option<Vec<Option<Answer>>>, ExperimentError> {
        for size in SIZES {
            let mut pair = match self.pair.take() {
                Some(pair) => pair,
                None => match Pair::new(self.file, &self.commands, self.quiet_ticks)? {
                    Some(pair) => pair,
                    None => return Ok(None),
                },
            };
            let mut answers = |size: f32| {
                pair.answers(&self.commands, place, size, |tick| tick % self.cycle_ticks == phase)
            };
            // Two halves restore the initial state.
            let found = answers(size).and_then(|whole| {
                let half = answers(-0.5 * size)?;
                let is_kept = |answer: &Answer| answer.level.abs() > 0.0 || answer.slope.abs() > 0.0;
                let again = match whole.iter().chain(&half).any(is_kept) {
                    true => answers(-0.5 * size)?,
                    false => half.clone(),
                };
                let all = whole.into_iter().zip(half.into_iter().zip(again));
                all.map(|(whole, (half, again))| Answer::mean([whole, half, again])).collect()
            });
            if found.is_some() {
                self.pair = Some(pair);
                return Ok(found);
            }
        }
        Ok(None)
    }
}

impl Pair {
    /// Two rigs in operation; `None` if they cannot be started.
    fn new(file: &RigFile, commands: &[Place], quiet_ticks: usize) -> Result<Option<Self>, ExperimentError> {
        let (still, disturbed) = (build::rig(file, &[])?, build::rig(file, &[])?);
        let (differences, sizes) = (Vec::new(), vec![0.0; commands.len()]);
        let (settled, unchanged) = (sizes.clone(), sizes.clone());
        let mut pair = Self {
            still,
            disturbed,
            commands: unchanged,
            unchanged_ticks: 0,
            quiet_ticks,
            differences,
            sizes,
            settled,
        };
        let mut ran_ticks = 0;
        while ran_ticks < quiet_ticks {
            pair.tick(commands);
            ran_ticks = if pair.is_running() { ran_ticks + 1 } else { 0 };
            if pair.differences.len() > MAX_TICKS {
                return Ok(None);
            }
        }
        Ok(Some(pair))
    }

    fn is_running(&self) -> bool {
        let is_running = |rig: &Rig| {
            rig.stations()
                .iter()
                .all(|station| matches!(station.last_tick, TickResult::Ran | TickResult::Idle))
        };
        is_running(&self.still) && is_running(&self.disturbed)
    }

    fn tick(&mut self, places: &[Place]) {
        if self.unchanged_ticks < self.quiet_ticks {
            self.still.tick();
            let commands = commands(&self.still, places);
            let is_same =
                commands.iter().zip(&self.commands).all(|(new, old)| new.to_bits() == old.to_bits());
            self.unchanged_ticks = if is_same { self.unchanged_ticks + 1 } else { 0 };
            self.commands = commands;
            self.still.advance_without_motion();
        }
        self.disturbed.tick();
        let disturbed = commands(&self.disturbed, places);
        for (size, (still, disturbed)) in self.sizes.iter_mut().zip(self.commands.iter().zip(&disturbed)) {
            *size = still.abs().max(disturbed.abs());
        }
        let differences = disturbed.iter().zip(&self.commands).map(|(disturbed, still)| disturbed - still);
        self.differences.push(differences.collect());
        self.disturbed.advance_without_motion();
    }

    /// Answers of each command, per unit of the disturbance.
    fn answers(
        &mut self,
        commands: &[Place],
        Place { station, place }: Place,
        size: f32,
        is_due: impl Fn(usize) -> bool,
    ) -> Option<Vec<Answer>> {
        let quiet_ticks = self.quiet_ticks;
        self.differences.drain(..self.differences.len().saturating_sub(quiet_ticks));
        let before = lines(&self.differences, &self.settled, &self.sizes)?;
        while !is_due(usize::try_from(self.disturbed.ticks()).ok()?) {
            self.tick(commands);
        }
        let from = self.differences.len();
        let shown = self.disturbed.stations().get(station)?.entry_value(place)?;
        let disturbed = shown + size;
        self.show(station, place, disturbed);
        self.tick(commands);
        self.show(station, place, shown);
        let unit = f64::from(disturbed) - f64::from(shown);
        #[expect(clippy::cast_precision_loss, reason = "far fewer ticks than 2^53")]
        let expected = |at: usize, tick: usize| {
            before.get(at).map_or(0.0, |(level, slope)| level + slope * (from + tick) as f64)
        };
        let mut most = vec![0.0_f64; commands.len()];
        loop {
            let (ticks, last) = (self.differences.len() - from, self.differences.last()?);
            for (at, (most, difference)) in most.iter_mut().zip(last).enumerate() {
                *most = most.max((difference - expected(at, ticks - 1)).abs());
            }
            if !self.is_running() || ticks > MAX_TICKS || most.iter().any(|most| most.is_nan()) {
                return None;
            }
            if ticks < quiet_ticks || !ticks.is_multiple_of(QUIET_TICKS) {
                self.tick(commands);
                continue;
            }
            let relaxed = i32::try_from(ticks / OVER_TICKS).unwrap_or(i32::MAX);
            let over = (MIN_OVER * 10.0_f64.powi(relaxed)).min(MAX_OVER);
            let tolerances: Vec<f64> = most.iter().map(|most| over * most).collect();
            let rows = self.differences.get((from + ticks).saturating_sub(quiet_ticks)..).unwrap_or_default();
            if let Some(found) = lines(rows, &tolerances, &self.sizes)
                && (ticks >= SLOPE_TICKS || found.iter().all(|(_, slope)| slope.abs() <= 0.0))
            {
                let kept = ticks - quiet_ticks;
                let answer = |(at, (level, slope)): (usize, &(f64, f64))| {
                    let [base, rise] = [expected(at, 0), expected(at, 1) - expected(at, 0)];
                    let slope = slope - rise;
                    #[expect(clippy::cast_precision_loss, reason = "far fewer ticks than 2^53")]
                    let level = level - base - rise * kept as f64 - slope * kept as f64;
                    let rounding = ROUNDING * self.sizes.get(at).copied().unwrap_or_default();
                    let tolerance = tolerances.get(at).copied().unwrap_or_default().max(rounding);
                    let level = if level.abs() <= LEFT * tolerance { 0.0 } else { level };
                    let tap = |(tick, row): (u32, &Vec<f64>)| {
                        let tick = f64::from(tick);
                        let now = row.get(at).copied().unwrap_or_default();
                        (now - base - rise * tick - level - slope * tick) / unit
                    };
                    let rows = self.differences.get(from..from + kept).unwrap_or_default();
                    let taps = (0..).zip(rows).map(tap).collect();
                    let [level, slope, rounding] = [level / unit, slope / unit, rounding / unit.abs()];
                    Answer { taps, moments: Vec::new(), level, slope, rounding }
                };
                let answers = found.iter().enumerate().map(answer).collect();
                self.settled = tolerances;
                return Some(answers);
            }
            self.tick(commands);
        }
    }

    fn show(&mut self, station: usize, place: usize, value: f32) {
        if let Some(station) = self.disturbed.stations_mut().get_mut(station) {
            station.override_entry(place, FrameOverride::Value(value));
        }
    }
}

fn commands(rig: &Rig, places: &[Place]) -> Vec<f64> {
    let command = |at: &Place| {
        let station = rig.stations().get(at.station);
        station.and_then(|station| station.command().get(at.place)).copied().map_or(0.0, f64::from)
    };
    places.iter().map(command).collect()
}

/// Fits lines to rows (level at the first one, and slope); `None` if a row is not a line.
fn lines(rows: &[Vec<f64>], tolerances: &[f64], sizes: &[f64]) -> Option<Vec<(f64, f64)>> {
    let (first, last) = rows.first().zip(rows.last())?;
    #[expect(clippy::cast_precision_loss, reason = "far fewer ticks than 2^53")]
    let steps = (rows.len() - 1).max(1) as f64;
    let line = |at: usize| {
        let tolerance = tolerances.get(at)?.max(ROUNDING * sizes.get(at)?);
        let [first, last] = [*first.get(at)?, *last.get(at)?];
        let slope = if (last - first).abs() <= tolerance { 0.0 } else { (last - first) / steps };
        let follows = |(tick, row): (u32, &Vec<f64>)| {
            row.get(at).is_some_and(|value| (value - first - slope * f64::from(tick)).abs() <= tolerance)
        };
        (0..).zip(rows).all(follows).then_some((first, slope))
    };
    (0..first.len()).map(line).collect()
}

fn least_common_multiple(a: usize, b: usize) -> usize {
    let (mut x, mut y) = (a, b);
    while y > 0 {
        (x, y) = (y, x % y);
    }
    (a / x.max(1)).saturating_mul(b)
}

impl Answer {
    /// Combines the answers to a disturbance and twice to its half with opposite sign, which cancels the quadratic
    /// part. `None` if they disagree; an empty answer without any response.
    fn mean(answers: [Self; 3]) -> Option<Option<Self>> {
        let ticks = answers.iter().map(|answer| answer.taps.len()).max().unwrap_or_default();
        let value = |answer: &Self, tick: usize| {
            #[expect(clippy::cast_precision_loss, reason = "far fewer ticks than 2^53")]
            let line = answer.level + answer.slope * tick as f64;
            answer.taps.get(tick).map_or(line, |tap| tap + line)
        };
        let (mut most, mut off) = (0.0_f64, 0.0_f64);
        for tick in 0..=ticks {
            let [whole, half, again] = answers.each_ref().map(|answer| value(answer, tick));
            most = most.max(whole.abs());
            off = off.max((whole - half).abs()).max((whole - again).abs());
        }
        let rounding = answers.iter().map(|answer| answer.rounding).sum::<f64>();
        if most <= rounding {
            return Some(None);
        }
        if off > LINEAR * most + rounding {
            return None;
        }
        let mean = |of: fn(&Self) -> f64| answers.iter().map(of).sum::<f64>() / 3.0;
        let tap = |tick: usize| answers.iter().filter_map(|answer| answer.taps.get(tick)).sum::<f64>() / 3.0;
        let taps: Vec<f64> = (0..ticks).map(tap).collect();
        let moments = taps.chunks(BLOCK_TICKS).map(moments).collect();
        let [level, slope] = [mean(|answer| answer.level), mean(|answer| answer.slope)];
        Some(Some(Self { taps, moments, level, slope, rounding }))
    }

    /// Ticks until it has decayed.
    pub(super) fn ticks(&self) -> usize {
        self.taps.len()
    }

    /// Returns the tick at this offset, possibly negative, of every cycle of `N` ticks.
    pub(super) fn series(&self, cycle_ticks: usize, offset: isize) -> Series<'_> {
        let is_before = offset < 0;
        let first = if is_before { offset + cycle_ticks.cast_signed() } else { offset };
        let first = usize::try_from(first).unwrap_or_default();
        let taps = match cycle_ticks {
            1 => Cow::Borrowed(self.taps.as_slice()),
            _ => self.taps.iter().skip(first).step_by(cycle_ticks).copied().collect(),
        };
        #[expect(clippy::cast_precision_loss, reason = "a few hundred ticks")]
        let [first, cycle_ticks] = [first, cycle_ticks].map(|ticks| ticks as f64);
        let [level, slope] = [self.level + self.slope * first, self.slope * cycle_ticks];
        let moments = if cycle_ticks > 1.0 { &[] } else { self.moments.as_slice() };
        Series { taps, moments, level, slope, is_before }
    }
}
