//! `[[bus]]`: what links go over, and take time on.

use serde::de::{DeserializeOwned, Error};
use serde::{Deserialize, Deserializer, Serialize};
use toml::{Table, Value};

use crate::scenario::{CanSection, SHIPPED, UartSection, UdpSection};

/// `[[bus]]`, of exactly one kind. What a kind leaves out is as in the shipped scenario; so are its keys.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct BusSection {
    /// What it is called.
    pub name: String,
    /// A UART for each link.
    #[serde(default, deserialize_with = "uart", skip_serializing_if = "Option::is_none")]
    pub uart: Option<UartSection>,
    /// A CAN bus that all links share, with frames of at most 8 bytes.
    #[serde(default, deserialize_with = "can", skip_serializing_if = "Option::is_none")]
    pub can: Option<CanSection>,
    /// A CAN bus that all links share, with CAN FD frames.
    #[serde(default, deserialize_with = "can", skip_serializing_if = "Option::is_none")]
    pub can_fd: Option<CanSection>,
    /// A network path for each link: forward to a controller further down in the file, else backward.
    #[serde(default, deserialize_with = "udp", skip_serializing_if = "Option::is_none")]
    pub udp: Option<UdpSection>,
}

impl BusSection {
    /// What is wrong with it.
    pub(super) fn problems(&self) -> Vec<String> {
        let Self { name, uart, can, can_fd, udp } = self;
        let mut problems = Vec::new();
        let kinds = [uart.is_some(), can.is_some(), can_fd.is_some(), udp.is_some()];
        if kinds.into_iter().filter(|is_it| *is_it).count() != 1 {
            problems.push(format!("bus '{name}': give it one of uart, can, can_fd, udp"));
        }
        for can in can.iter().chain(can_fd).filter(|can| can.other_nodes > 0) {
            let count = can.other_nodes;
            problems
                .push(format!("bus '{name}': other_nodes is {count}: give it 0, and links of those nodes"));
        }
        let cans = can
            .iter()
            .chain(can_fd)
            .flat_map(|can| [("bits_per_s", can.bits_per_s), ("data_bits_per_s", can.data_bits_per_s)]);
        let uarts = uart.iter().map(|uart| ("bits_per_s", uart.bits_per_s));
        let udps = udp.iter().map(|udp| ("forward_bits_per_s", udp.forward_bits_per_s));
        for (key, _) in cans.chain(uarts).chain(udps).filter(|(_, rate)| *rate == 0) {
            problems.push(format!("bus '{name}': {key} is 0: give it a rate"));
        }
        let shares = can.iter().chain(can_fd).map(|can| ("bit_error_rate", can.bit_error_rate));
        let shares = shares.chain(uart.iter().flat_map(|uart| {
            [
                ("bit_error_rate", uart.bit_error_rate),
                ("byte_drop", uart.byte_drop),
                ("byte_insert", uart.byte_insert),
            ]
        }));
        let shares = shares.chain(udp.iter().flat_map(|udp| {
            [("burst_start", udp.burst_start), ("burst_end", udp.burst_end), ("burst_loss", udp.burst_loss)]
        }));
        for (key, share) in shares.filter(|(_, share)| !(0.0..=1.0).contains(share)) {
            problems.push(format!("bus '{name}': {key} is {share}: give it 0 to 1"));
        }
        let times = udp.iter().flat_map(|udp| [("delay_s", udp.delay_s), ("spread_s", udp.spread_s)]);
        for (key, time_s) in times.filter(|(_, time_s)| !(0.0..=100.0).contains(time_s)) {
            problems.push(format!("bus '{name}': {key} is {time_s}: give it 0 to 100"));
        }
        problems
    }
}

/// A section with what it leaves out as a scenario ships it.
fn over_shipped<'de, D: Deserializer<'de>, S: DeserializeOwned>(
    key: &str,
    deserializer: D,
) -> Result<Option<S>, D::Error> {
    let given = Table::deserialize(deserializer)?;
    let shipped: Table = toml::from_str(SHIPPED).map_err(D::Error::custom)?;
    let mut whole = shipped.get(key).and_then(Value::as_table).cloned().unwrap_or_default();
    whole.extend(given);
    whole.try_into().map(Some).map_err(|error: toml::de::Error| D::Error::custom(error.message()))
}

fn uart<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<UartSection>, D::Error> {
    over_shipped("uart", deserializer)
}

fn can<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<CanSection>, D::Error> {
    over_shipped("can", deserializer)
}

fn udp<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<UdpSection>, D::Error> {
    over_shipped("udp", deserializer)
}
