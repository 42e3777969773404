//! Two processes meet before they run: each waits until the other answers, then both start on one beat.
//!
//! Both exchange packets while their worlds stand still. Two clocks of the same rate that tick at almost the same
//! moment would, with every small delay, find two packets in one tick and none in the next, and of two packets the
//! older one is lost. So one side listens when the other's packets come and puts its own ticks half a period later;
//! that is as far from trouble as can be, in both directions.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use dimsart_core::types;

use crate::link::ArrivalPoll;
use crate::rig::{Probe, Rig};

/// Ticks in which the other side has answered before the meeting ends: so many moments to learn its beat from.
const ANSWERED_TICKS: usize = 32;
/// From the end of the meeting to the first tick of the run, in ticks: time to get ready.
const READY_TICKS: u32 = 20;

/// Why a meeting came to nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Missed {
    /// Nothing came.
    Silence,
    /// What came was refused.
    Stranger,
    /// The user gave up.
    Stopped,
}

/// Ticks `rig`, whose world stands still, until the other side has answered or `wait` is over. Gives the moment of
/// the run's first tick: on the own beat, or half a period after the other side's packets for who brings an `arrival`.
///
/// # Errors
/// [`Missed`] says how the other side failed to appear.
pub fn meet(
    rig: &mut Rig,
    arrival: Option<&ArrivalPoll>,
    wait: Duration,
    stop: &AtomicBool,
) -> Result<Instant, Missed> {
    let period = Duration::from_secs_f64(rig.period_s());
    let start = Instant::now();
    let mut due = start;
    let mut answered = Probe::new(types::LINK_ROUND_TRIP.first());
    let mut refused = Probe::new(types::LINK_REFUSED.first());
    let mut offsets = Vec::new();
    loop {
        rig.tick();
        let any = |probe: &mut Probe| rig.stations().iter().any(|station| probe.words(station) != [0]);
        let has_answered = any(&mut answered);
        if stop.load(Ordering::Relaxed) {
            return Err(Missed::Stopped);
        }
        if !has_answered && start.elapsed() > wait {
            return Err(if any(&mut refused) { Missed::Stranger } else { Missed::Silence });
        }
        // What came while this side was late says nothing of the other one's beat.
        let next = due + period;
        let heard = arrival.and_then(|arrival| arrival.arrival_before(next));
        if has_answered {
            offsets.push(heard.map(|moment| moment.saturating_duration_since(due)));
        }
        if offsets.len() >= ANSWERED_TICKS {
            let offset = median(offsets.into_iter().flatten().collect());
            let shift = offset.map_or(Duration::ZERO, |offset| offset + period / 2);
            return Ok(due + READY_TICKS * period + shift);
        }
        std::thread::sleep(next.saturating_duration_since(Instant::now()));
        due = next;
    }
}

fn median(mut offsets: Vec<Duration>) -> Option<Duration> {
    offsets.sort_unstable();
    offsets.get(offsets.len() / 2).copied()
}
