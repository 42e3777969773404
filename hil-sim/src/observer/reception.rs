//! Packets received, superseded, refused and lost by a station.
//!
//! A packet is used, superseded (arrived with a newer one in the same tick), refused (old, repeated, damaged,
//! different content) or lost (missing when a newer one arrived). `LINK_LOST` counts lost and superseded packets:
//! gaps in the sequence. `LINK_REFUSED` counts refused and superseded packets: received but not used.

use core::ops::ControlFlow;

use dimsart_core::{DataType, LinkState, types};
use serde::Serialize;

use super::Observer;
use crate::outcome::Outcome;
use crate::rig::{Rig, Station};

/// Packets received, superseded, refused and lost by a station.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Received {
    /// Station.
    pub station: String,
    /// Lost packets: missing when a newer one arrived.
    pub lost: u32,
    /// Superseded packets: arrived in the same tick as a newer one.
    pub superseded: u32,
    /// Refused packets: damaged, old, repeated, or of different content.
    pub refused: u32,
}

/// Reads the counters of the receivers at the end.
#[derive(Debug)]
pub(crate) struct Reception {
    /// Whether a link without packets is a fault; a single station has already received a packet from its peer.
    pub(crate) reports_silence: bool,
}

impl Observer for Reception {
    fn observe(&mut self, _rig: &Rig) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    fn report(&mut self, rig: &Rig, outcome: &mut Outcome) {
        let stations = rig.stations().iter().filter(|_| self.reports_silence);
        for silence in stations.flat_map(|station| silences(station, rig.ticks())) {
            outcome.stable &= !silence.is_refusal;
            outcome.faults.push(silence.text);
        }
        let received: Vec<Received> = rig.stations().iter().filter_map(received).collect();
        let sum = |count: fn(&Received) -> u32| received.iter().map(|each| u64::from(count(each))).sum();
        outcome.lost_packets = sum(|each| each.lost);
        outcome.superseded_packets = sum(|each| each.superseded);
        outcome.refused_packets = sum(|each| each.refused);
        outcome.received = received;
    }
}

/// Returns the counters of all its links; `None` without receivers.
fn received(station: &Station) -> Option<Received> {
    let sum = |signal| words(station, signal).map(|(_, count)| count).reduce(u32::wrapping_add);
    let superseded = station.superseded();
    let [lost, refused] = [sum(types::LINK_LOST)?, sum(types::LINK_REFUSED)?];
    let [lost, refused] = [lost, refused].map(|count| count.saturating_sub(superseded));
    Some(Received { station: station.name.clone(), lost, superseded, refused })
}

/// A link without accepted packets.
struct Silence {
    /// Describes it with the reason.
    text: String,
    /// Whether packets were refused; without packets, the run may be shorter than the delay of the link.
    is_refusal: bool,
}

/// Returns the links of a station without accepted packets in all `ticks` of a run.
fn silences(station: &Station, ticks: u64) -> Vec<Silence> {
    let own_ticks = ticks.div_ceil(station.ticks_per_step() as u64);
    let of =
        |signal, number| words(station, signal).find(|(found, _)| *found == number).map(|(_, word)| word);
    let links = words(station, types::LINK_AGE).filter(|(_, age)| ticks > 0 && u64::from(*age) >= own_ticks);
    let silent = links.map(|(number, _)| {
        let name = &station.name;
        let module = if number == 1 { "COMM_RXMOD".to_owned() } else { format!("COMM_RXMOD.{number}") };
        let link = format!("the link to {module} of the {name} never came up");
        let refused = of(types::LINK_REFUSED, number).unwrap_or_default();
        let text = match (refused, station.authentication_failure()) {
            (0, _) => format!("{link}: no packet received; check the link and the peer's CTX_ADD_DATA"),
            (_, Some(failure)) => format!("{link}: all {refused} packets were refused: {failure}"),
            (_, None) if of(types::LINK_STATE, number) == Some(LinkState::WrongSequence as u32) => {
                format!("{link}: all {refused} packets were old or out of order; restart the peer")
            }
            (_, None) => format!(
                "{link}: all {refused} packets contained other signals than expected; list the same types in the same order in \
                CTX_ADD_DATA and the peer's CRX_ADD_DATA, with equal CTX_EVERY and CRX_EVERY"
            ),
        };
        Silence { text, is_refusal: refused > 0 }
    });
    silent.collect()
}

/// Returns the numbers of all signals of a type, with their first words.
fn words(station: &Station, signal: &'static DataType) -> impl Iterator<Item = (u8, u32)> {
    let data_base = station.dimsart.engine().data_base();
    data_base
        .signals()
        .filter(|(_, entry)| entry.signal.id == signal.id)
        .filter_map(move |(slot, entry)| Some((entry.signal.number, data_base.words(slot).first().copied()?)))
}
