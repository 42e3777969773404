//! How soon faults are noticed in the shipped scheme, and what the actuators get meanwhile, as a table.
//!
//! Both sides of the shipped experiment run as boards run them: calls are timed, and a client holds each side's lease. A
//! fault begins in some tick, drawn anew for each time it is tried, at either side in turn. Then it ends, and what is
//! needed for both sides to move again is done.

mod cases;

use std::collections::BTreeSet;
use std::fmt::Write as _;

use dimsart_core::TickResult;

use crate::faulty_pair::{Fault, LIMITS, Pair, PairError};
use cases::{Case, cases};
use hil_sim::bus::Random;

/// How often each fault is tried.
pub(crate) const TRIES: u32 = 24;
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
pub(crate) enum FaultTableError {
    /// There is no pair, or it was refused something.
    #[error("{0}")]
    Pair(#[from] PairError),
    /// A force was not finite, not in its range, or faster than its rate.
    #[error("{now_n} N after {last_n} N: not in its range, or faster than its rate")]
    LimitBroken {
        /// Force in the previous tick.
        last_n: f32,
        /// Force in this tick.
        now_n: f32,
    },
    /// A side did not run while nothing was wrong.
    #[error("{case}: in tick {tick} nothing is wrong, and a side came to {came:?}")]
    Unhealthy {
        /// The fault that was before it.
        case: String,
        /// When.
        tick: u32,
        /// The outcome.
        came: TickResult,
    },
}

/// Ticks after which something happened, in every try.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct After(pub(crate) Vec<Option<u32>>);

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

/// Outcome of a fault.
#[derive(Debug, Clone, Default)]
pub(crate) struct Row {
    /// The fault.
    pub(crate) fault: String,
    /// Ticks until the fault was reported.
    pub(crate) noticed: After,
    /// Numbers in the report.
    pub(crate) reasons: BTreeSet<u8>,
    /// The reported item.
    pub(crate) named: BTreeSet<String>,
    /// Tries in which something else was named than what was wrong.
    pub(crate) misnamed: u32,
    /// Ticks until the device got the scheme's command no more.
    pub(crate) held_back: After,
    /// Ticks until the other side's device got it no more.
    pub(crate) other_held_back: After,
    /// The largest force from the fault on, on either side, N.
    pub(crate) largest_n: f32,
    /// The largest change of one in a tick, N.
    pub(crate) largest_step_n: f32,
    /// What was needed for this side to move again, when the fault was over.
    pub(crate) ended_by: BTreeSet<&'static str>,
}

/// Tries every fault.
///
/// # Errors
/// [`FaultTableError`], among them a force beyond its limits, and a side that does not run when nothing is wrong.
pub(crate) fn rows() -> Result<Vec<Row>, FaultTableError> {
    (1..).zip(cases()).map(|(seed, case)| row(&case, seed)).collect()
}

/// The rows as a Markdown table.
pub(crate) fn markdown(rows: &[Row]) -> String {
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
pub(crate) fn forces_without_a_fault(ticks: u32) -> Result<Vec<[Vec<f32>; 2]>, FaultTableError> {
    let mut both = Both::new(0, Random::new(0))?;
    let step = |_| {
        both.step()?;
        Ok(both.pair.force_n().map(<[f32]>::to_vec))
    };
    (0..ticks).map(step).collect()
}

/// The pair, and what was measured of its forces since the last fault began or ended.
struct Both {
    pair: Pair,
    end_tick: u32,
    largest_n: f32,
    largest_step_n: f32,
}

impl Both {
    fn new(spare_cycles: u32, random: Random) -> Result<Self, FaultTableError> {
        let (mut pair, end_tick) = Pair::shipped(spare_cycles, 0)?;
        pair.random = random;
        Ok(Self { pair, end_tick, largest_n: 0.0, largest_step_n: 0.0 })
    }

    fn uniform_integer(&mut self, most: u32) -> u64 {
        self.pair.random.uniform_integer(most)
    }

    /// A tick. No force leaves the range or is faster than the rate.
    fn step(&mut self) -> Result<(), FaultTableError> {
        let before = self.pair.force_n().map(<[f32]>::to_vec);
        self.pair.step();
        // That of all axes is the same, in ticks of a millisecond.
        let max_n = LIMITS.rate_per_s * 1e-3;
        for (now_n, last_n) in self.pair.force_n().into_iter().flatten().zip(before.iter().flatten()) {
            let step_n = (now_n - last_n).abs();
            // Rounding in f32: the sum of the last value and the step.
            let rounding_n = f32::EPSILON * (now_n.abs() + last_n.abs());
            if !(LIMITS.min..=LIMITS.max).contains(now_n) || step_n > max_n + rounding_n {
                return Err(FaultTableError::LimitBroken { last_n: *last_n, now_n: *now_n });
            }
            self.largest_n = self.largest_n.max(now_n.abs());
            self.largest_step_n = self.largest_step_n.max(step_n);
        }
        Ok(())
    }

    fn begin(&mut self, side: usize, fault: Fault, axis: usize) {
        (self.largest_n, self.largest_step_n) = (0.0, 0.0);
        self.pair.begin(side, fault, axis, u32::MAX);
    }

    fn end(&mut self, side: usize) {
        (self.largest_n, self.largest_step_n) = (0.0, 0.0);
        self.pair.end(side);
    }
}

fn row(case: &Case, seed: u64) -> Result<Row, FaultTableError> {
    let mut both = Both::new(case.spare_cycles, Random::new(seed))?;
    let mut row = Row { fault: case.name.clone(), ..Row::default() };
    let spacing = (both.end_tick - START_TICKS) / TRIES;
    for number in 0..TRIES {
        #[expect(clippy::cast_possible_truncation, reason = "no more than the spacing")]
        let begin = START_TICKS + number * spacing + both.uniform_integer(spacing - 1) as u32;
        while both.pair.ticks() < begin {
            run(&mut both, 1, case)?;
        }
        let side = if number % 2 == 0 { 0 } else { 1 };
        let turn = usize::try_from(number / 2).unwrap_or_default() % case.faults.len().max(1);
        let fault = case.faults.get(turn).copied().unwrap_or(Fault::None);
        let axis = usize::try_from(both.uniform_integer(2)).unwrap_or_default();
        if try_once(&mut both, side, fault, axis, &mut row)? {
            run(&mut both, HEALTHY_TICKS, case)?;
        } else {
            // What moved on meanwhile can be anywhere.
            both = Both::new(case.spare_cycles, both.pair.random)?;
        }
    }
    Ok(row)
}

/// So many ticks in which both sides must run.
fn run(both: &mut Both, ticks: u32, case: &Case) -> Result<(), FaultTableError> {
    for _ in 0..ticks {
        let tick = both.pair.ticks();
        both.step()?;
        for controller in both.pair.of(0) {
            if controller.last_tick() != TickResult::Ran || controller.is_cut() {
                let (case, came) = (case.name.clone(), controller.last_tick());
                return Err(FaultTableError::Unhealthy { case, tick, came });
            }
        }
    }
    Ok(())
}

/// A fault begins, is watched, and ends; then both sides are made to move again. Says whether it was noticed.
fn try_once(
    both: &mut Both,
    side: usize,
    fault: Fault,
    axis: usize,
    row: &mut Row,
) -> Result<bool, FaultTableError> {
    both.begin(side, fault, axis);
    let (mut noticed, mut held_back, mut other_held_back) = (None, None, None);
    for tick in 0..WATCH_TICKS {
        both.step()?;
        let [own, other] = both.pair.of(side);
        if own.last_tick() != TickResult::Ran {
            held_back.get_or_insert(tick);
        }
        if other.last_tick() != TickResult::Ran {
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
    row.largest_n = row.largest_n.max(both.largest_n);
    row.largest_step_n = row.largest_step_n.max(both.largest_step_n);
    both.end(side);
    for _ in 0..REST_TICKS {
        both.step()?;
    }
    let [own, other] = both.pair.of(side);
    let ended_by = own.make_move()?;
    other.make_move()?;
    if noticed.is_some() {
        row.ended_by.insert(ended_by);
    }
    Ok(noticed.is_some())
}
