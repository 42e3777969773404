//! What a station made of the packets that were sent to it.

use dimsart_core::{DataType, types};

use crate::outcome::Received;
use crate::rig::{Probe, Station};

/// What it missed and refused; none for one that does not listen.
pub(crate) fn received(station: &Station) -> Option<Received> {
    let [lost, refused] = [types::LINK_LOST, types::LINK_REFUSED].map(|signal| word(station, signal));
    let superseded = station.superseded();
    // The receiver counts each among those it refused, and sees a gap in the numbers.
    let [lost, refused] = [lost?, refused?].map(|count| count.saturating_sub(superseded));
    Some(Received { station: station.name.clone(), lost, superseded, refused })
}

/// In words, that it accepted nothing in all `ticks` of a run; none for one that did, or that does not listen.
pub(crate) fn silence(station: &Station, ticks: u64) -> Option<String> {
    let Received { station: name, refused, .. } = received(station)?;
    (u64::from(word(station, types::LINK_AGE)?) == ticks).then(|| match refused {
        0 => format!("nothing came to the {name} in the whole run; see to the link, and to what the other side sends"),
        refused => format!(
            "the {name} refused all {refused} packets: they are not what it listens for; give both schemes the same \
             types in the same order, one in CTX_ADD_DATA and the other in CRX_ADD_DATA"
        ),
    })
}

fn word(station: &Station, signal: &DataType) -> Option<u32> {
    Probe::new(signal.first()).words(station).first().copied()
}
