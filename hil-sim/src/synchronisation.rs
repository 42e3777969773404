//! Synchronises two processes before a run: each waits for the other, then both start on a common beat.
//!
//! Both exchange packets while their plants stand still. With two equal clock rates and nearly equal tick times,
//! small delay variations would cause two packets in one tick and none in the next, and one of the two is lost. One
//! side therefore measures the arrival times of the other's packets and shifts its own ticks by half a period, the
//! maximum distance in both directions.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use dimsart_core::types;

use crate::link::ArrivalPoll;
use crate::rig::{Probe, Rig};

/// Ticks with an answer before the start, to measure the peer's beat.
const ANSWERED_TICKS: usize = 32;
/// Ticks from the handshake to the first tick of the run.
const READY_TICKS: u32 = 20;

/// Synchronisation error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SynchronisationError {
    /// No packet.
    NoPacket,
    /// Packets were refused.
    RejectedPackets,
    /// Stopped by the user.
    Stopped,
}

/// Ticks `rig` without moving its plants until the peer answers or `wait` is over. Returns the time of the run's
/// first tick: on its own beat, or with an `arrival` detector half a period after the peer's packets.
///
/// # Errors
/// [`SynchronisationError`] if the peer does not respond.
pub fn synchronise_with_peer(
    rig: &mut Rig,
    arrival: Option<&ArrivalPoll>,
    wait: Duration,
    stop: &AtomicBool,
) -> Result<Instant, SynchronisationError> {
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
            return Err(SynchronisationError::Stopped);
        }
        if !has_answered && start.elapsed() > wait {
            return Err(if any(&mut refused) {
                SynchronisationError::RejectedPackets
            } else {
                SynchronisationError::NoPacket
            });
        }
        // Arrivals in a late tick do not show the peer's beat.
        let next = due + period;
        let heard = arrival.and_then(|arrival| arrival.wait_for_arrival(next));
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
