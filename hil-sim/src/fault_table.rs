//! How soon faults are noticed in the shipped scheme, and what the actuators get meanwhile, as a table.
//!
//! Both sides of the shipped experiment run as boards run them: calls are timed, and a client holds each side's lease. A
//! fault begins in some tick, drawn anew for each time it is tried, at either side in turn. Then it ends, and what is
//! needed for both sides to move again is done.
//!
//! Three modules that can fail pass the shipped scheme's signals on, in three places of it. They change no bit while they
//! do not fail ([`forces_without_a_fault`]).

mod controller;
mod failing;
mod fault;
mod pair;

use std::collections::BTreeSet;
use std::fmt::Write as _;

use dimsart_core::protocol::Refusal;
use dimsart_core::{DescriptorError, Tick};

use crate::bus::Random;
use crate::experiment::ExperimentError;
use crate::schemes::SchemeFileError;
use fault::{Case, Fault, cases};
use pair::Pair;

/// How often each fault is tried.
pub const TRIES: u32 = 24;
/// Ticks before the first fault: the hand has begun to move.
const START_TICKS: u32 = 200;
/// Ticks in which a fault can be noticed; a lease ends after 200.
const WATCH_TICKS: u32 = 1_000;
/// Ticks that the other side has behind this one: a link is lost after 20.
const OTHER_TICKS: u32 = 60;
/// Ticks without the fault, in which the actuators reach their safe values: it lasts, whatever the sensors show.
const REST_TICKS: u32 = 40;
/// Ticks that both sides run, after all.
const HEALTHY_TICKS: u32 = 50;

/// Why there is no table.
#[derive(Debug, thiserror::Error)]
pub enum FaultTableError {
    /// The experiment cannot be made.
    #[error("{0}")]
    Experiment(#[from] ExperimentError),
    /// The device cannot be described.
    #[error("{0}")]
    Device(#[from] DescriptorError),
    /// The scheme cannot be read.
    #[error("{0}")]
    SchemeFile(#[from] SchemeFileError),
    /// A row of the scheme was refused.
    #[error("a row is refused: {0}")]
    Scheme(String),
    /// The client was refused something.
    #[error("refused: {0:?}")]
    Refused(Refusal),
    /// A force was not finite, not in its range, or faster than its rate.
    #[error("{now_n} N after {last_n} N: not in its range, or faster than its rate")]
    LimitBroken {
        /// In the tick before.
        last_n: f32,
        /// What it was.
        now_n: f32,
    },
    /// A side did not run while nothing was wrong.
    #[error("{case}: in tick {tick} nothing is wrong, and a side came to {came:?}")]
    Unhealthy {
        /// The fault that was before it.
        case: String,
        /// When.
        tick: u32,
        /// What it came to.
        came: Tick,
    },
}

/// Ticks after which something happened, in every try.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct After(pub Vec<Option<u32>>);

impl std::fmt::Display for After {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let happened = || self.0.iter().flatten();
        let (Some(least), Some(most)) = (happened().min(), happened().max()) else {
            return f.write_str("never");
        };
        write!(f, "{least}")?;
        if least != most {
            write!(f, " to {most}")?;
        }
        let never = self.0.iter().filter(|after| after.is_none()).count();
        if never > 0 { write!(f, "; never in {never} of {}", self.0.len()) } else { Ok(()) }
    }
}

/// What a fault came to.
#[derive(Debug, Clone, Default)]
pub struct Row {
    /// The fault.
    pub fault: String,
    /// Ticks until it was told.
    pub noticed: After,
    /// The numbers that it was told by.
    pub reasons: BTreeSet<u8>,
    /// What was named.
    pub named: BTreeSet<String>,
    /// Tries in which something else was named than what was wrong.
    pub misnamed: u32,
    /// Ticks until the device got the scheme's command no more.
    pub held_back: After,
    /// Ticks until the other side's device got it no more.
    pub other_held_back: After,
    /// The largest force from the fault on, on either side, N.
    pub largest_n: f32,
    /// The largest change of one in a tick, N.
    pub largest_step_n: f32,
    /// What was needed for this side to move again, when the fault was over.
    pub ended_by: BTreeSet<&'static str>,
}

/// Tries every fault.
///
/// # Errors
/// [`FaultTableError`], among them a force beyond its limits, and a side that does not run when nothing is wrong.
pub fn rows() -> Result<Vec<Row>, FaultTableError> {
    (1..).zip(cases()).map(|(seed, case)| row(&case, seed)).collect()
}

/// The rows as a Markdown table.
#[must_use]
pub fn markdown(rows: &[Row]) -> String {
    let mut text = "\
| Fault | Noticed | Number | Named | Held back | Other side held back | Largest force, N | Largest step, N | Ended by |
|---|---:|---:|---|---:|---:|---:|---:|---|
"
    .to_owned();
    for row in rows {
        let Row { fault, noticed, held_back, other_held_back, largest_n, largest_step_n, .. } = row;
        let reasons: Vec<String> = row.reasons.iter().map(u8::to_string).collect();
        let named: Vec<&str> = row.named.iter().map(String::as_str).collect();
        let ended_by: Vec<&str> = row.ended_by.iter().copied().collect();
        let _ = writeln!(
            text,
            "| {fault} | {noticed} | {} | {} | {held_back} | {other_held_back} | {largest_n:.1} | {largest_step_n:.2} | {} |",
            reasons.join(", "),
            named.join(", "),
            ended_by.join(", "),
        );
    }
    text
}

/// The forces of master and slave in so many ticks without any fault, N: those of the shipped experiment.
///
/// # Errors
/// As [`rows`].
pub fn forces_without_a_fault(ticks: u32) -> Result<Vec<[Vec<f32>; 2]>, FaultTableError> {
    let (mut pair, mut random) = (Pair::new(0)?, Random::new(0));
    let step = |_| {
        pair.step(&mut random)?;
        Ok(pair.force_n().map(<[f32]>::to_vec))
    };
    (0..ticks).map(step).collect()
}

fn row(case: &Case, seed: u64) -> Result<Row, FaultTableError> {
    let mut random = Random::new(seed);
    let mut pair = Pair::new(case.spare_cycles)?;
    let mut row = Row { fault: case.name.clone(), ..Row::default() };
    let spacing = (pair.end_tick - START_TICKS) / TRIES;
    for number in 0..TRIES {
        #[expect(clippy::cast_possible_truncation, reason = "no more than the spacing")]
        let begin = START_TICKS + number * spacing + random.up_to(spacing - 1) as u32;
        while pair.ticks() < begin {
            run(&mut pair, 1, case, &mut random)?;
        }
        let side = if number % 2 == 0 { 0 } else { 1 };
        let turn = usize::try_from(number / 2).unwrap_or_default() % case.faults.len().max(1);
        let fault = case.faults.get(turn).copied().unwrap_or(Fault::None);
        let axis = usize::try_from(random.up_to(2)).unwrap_or_default();
        if try_once(&mut pair, side, fault, axis, &mut row, &mut random)? {
            run(&mut pair, HEALTHY_TICKS, case, &mut random)?;
        } else {
            // What moved on meanwhile can be anywhere.
            pair = Pair::new(case.spare_cycles)?;
        }
    }
    Ok(row)
}

/// So many ticks in which both sides must run.
fn run(pair: &mut Pair, ticks: u32, case: &Case, random: &mut Random) -> Result<(), FaultTableError> {
    for _ in 0..ticks {
        let tick = pair.ticks();
        pair.step(random)?;
        for controller in pair.of(0) {
            if controller.last_tick != Tick::Ran || controller.is_cut() {
                let (case, came) = (case.name.clone(), controller.last_tick);
                return Err(FaultTableError::Unhealthy { case, tick, came });
            }
        }
    }
    Ok(())
}

/// A fault begins, is watched, and ends; then both sides are made to move again. Says whether it was noticed.
fn try_once(
    pair: &mut Pair,
    side: usize,
    fault: Fault,
    axis: usize,
    row: &mut Row,
    random: &mut Random,
) -> Result<bool, FaultTableError> {
    pair.begin(side, fault, axis)?;
    let (mut noticed, mut held_back, mut other_held_back) = (None, None, None);
    for tick in 0..WATCH_TICKS {
        pair.step(random)?;
        let [own, other] = pair.of(side);
        if own.last_tick != Tick::Ran {
            held_back.get_or_insert(tick);
        }
        if other.last_tick != Tick::Ran {
            other_held_back.get_or_insert(tick);
        }
        if noticed.is_none() && (held_back.is_some() || own.is_cut()) {
            noticed = Some(tick);
            row.reasons.insert(own.reason());
            let named = own.named();
            let is_right = fault.named(axis).is_none_or(|expected| expected == named);
            row.misnamed += u32::from(!is_right);
            row.named.insert(named.split(" of ").next().unwrap_or_default().to_owned());
        }
        if noticed.is_some_and(|noticed| tick >= noticed + OTHER_TICKS) {
            break;
        }
    }
    row.noticed.0.push(noticed);
    row.held_back.0.push(held_back);
    row.other_held_back.0.push(other_held_back);
    row.largest_n = row.largest_n.max(pair.largest_n);
    row.largest_step_n = row.largest_step_n.max(pair.largest_step_n);
    pair.begin(side, Fault::None, axis)?;
    for _ in 0..REST_TICKS {
        pair.step(random)?;
    }
    let [own, other] = pair.of(side);
    let ended_by = own.make_move()?;
    other.make_move()?;
    if noticed.is_some() {
        row.ended_by.insert(ended_by);
    }
    Ok(noticed.is_some())
}
