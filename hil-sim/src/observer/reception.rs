//! What a station made of the packets that were sent to it.
//!
//! A packet that a peer has sent is used, superseded (it came with a newer one in the same tick), refused (old, repeated,
//! damaged, of another content) or lost (it was missing when a newer one came). The signals of a receiver count what it sees:
//! `LINK_LOST` is lost and superseded together, the gaps in the sequence; `LINK_REFUSED` is refused and superseded together,
//! what came and was not used.

use core::ops::ControlFlow;

use dimsart_core::{DataType, LinkState, types};
use serde::Serialize;

use super::Observer;
use crate::outcome::Outcome;
use crate::rig::{Rig, Station};

/// What a station made of the packets that were sent to it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Received {
    /// Its name.
    pub station: String,
    /// Packets that were missing when a newer one came.
    pub lost: u32,
    /// Packets that came together with a newer one: a tick uses one.
    pub superseded: u32,
    /// Packets refused: damaged, old, repeated, or of another content.
    pub refused: u32,
}

/// Reads at the end what receivers have counted.
#[derive(Debug)]
pub(crate) struct Reception {
    /// Whether a link that never came up is a fault here: a station alone has met the other one before.
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

/// What it missed and refused on all its links; none for one that does not listen.
fn received(station: &Station) -> Option<Received> {
    let sum = |signal| words(station, signal).map(|(_, count)| count).reduce(u32::wrapping_add);
    let superseded = station.superseded();
    let [lost, refused] = [sum(types::LINK_LOST)?, sum(types::LINK_REFUSED)?];
    let [lost, refused] = [lost, refused].map(|count| count.saturating_sub(superseded));
    Some(Received { station: station.name.clone(), lost, superseded, refused })
}

/// A link over which a station accepted nothing.
struct Silence {
    /// In words, with the reason.
    text: String,
    /// Whether packets came and were refused: a run can be shorter than the delay of a link that works.
    is_refusal: bool,
}

/// The links of a station over which it accepted nothing in all `ticks` of a run.
fn silences(station: &Station, ticks: u64) -> Vec<Silence> {
    let own_ticks = ticks.div_ceil(station.every_ticks() as u64);
    let of =
        |signal, number| words(station, signal).find(|(found, _)| *found == number).map(|(_, word)| word);
    let links = words(station, types::LINK_AGE).filter(|(_, age)| ticks > 0 && u64::from(*age) >= own_ticks);
    let silent = links.map(|(number, _)| {
        let name = &station.name;
        let module = if number == 1 { "COMM_RXMOD".to_owned() } else { format!("COMM_RXMOD.{number}") };
        let link = format!("the link to {module} of the {name} never came up");
        let refused = of(types::LINK_REFUSED, number).unwrap_or_default();
        let text = match (refused, station.authentication_failure()) {
            (0, _) => format!("{link}: no packet arrived; check the link, and what the other side sends"),
            (_, Some(failure)) => format!("{link}: all {refused} packets were refused: {failure}"),
            (_, None) if of(types::LINK_STATE, number) == Some(LinkState::WrongSequence as u32) => {
                format!("{link}: all {refused} packets were refused as old or out of order; restart the other side")
            }
            (_, None) => format!(
                "{link}: all {refused} packets were refused, as their content differs; give both schemes the same types in \
                 the same order, one in CTX_ADD_DATA and the other in CRX_ADD_DATA, and the same CTX_EVERY and CRX_EVERY"
            ),
        };
        Silence { text, is_refusal: refused > 0 }
    });
    silent.collect()
}

/// The numbers of all signals of a type, with their first words.
fn words(station: &Station, signal: &'static DataType) -> impl Iterator<Item = (u8, u32)> {
    let data_base = station.dimsart.engine().data_base();
    data_base
        .signals()
        .filter(|(_, entry)| entry.signal.id == signal.id)
        .filter_map(move |(slot, entry)| Some((entry.signal.number, data_base.words(slot).first().copied()?)))
}
