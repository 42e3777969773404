//! `[[bus]]`: buses with transmission times.

use serde::{Deserialize, Serialize};

use super::{CanSection, UartSection, UdpSection};

/// `[[bus]]`, of exactly one kind.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct BusSection {
    /// Name.
    pub name: String,
    /// Ideal bus without transmission time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ideal: Option<IdealSection>,
    /// One UART per link.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uart: Option<UartSection>,
    /// One CAN bus for all links, with frames of at most 8 bytes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub can: Option<CanSection>,
    /// One CAN bus for all links, with CAN FD frames.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub can_fd: Option<CanSection>,
    /// One network path per link: forward if the receiver is further down in the file, otherwise backward.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub udp: Option<UdpSection>,
}

/// `ideal`: no keys.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct IdealSection {}

impl BusSection {
    /// Returns its errors.
    pub(super) fn problems(&self) -> Vec<String> {
        let Self { name, ideal, uart, can, can_fd, udp } = self;
        let mut problems = Vec::new();
        let kinds = [ideal.is_some(), uart.is_some(), can.is_some(), can_fd.is_some(), udp.is_some()];
        if kinds.into_iter().filter(|is_it| *is_it).count() != 1 {
            problems.push(format!("bus '{name}': set exactly one of uart, can, can_fd, udp, ideal"));
        }
        let cans = can
            .iter()
            .chain(can_fd)
            .flat_map(|can| [("bits_per_s", can.bits_per_s), ("data_bits_per_s", can.data_bits_per_s)]);
        let uarts = uart.iter().map(|uart| ("bits_per_s", uart.bits_per_s));
        let udps = udp.iter().map(|udp| ("forward_bits_per_s", udp.forward_bits_per_s));
        for (key, _) in cans.chain(uarts).chain(udps).filter(|(_, rate)| *rate == 0) {
            problems.push(format!("bus '{name}': {key} is 0 bit/s, must be > 0"));
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
            [
                ("burst_entry_probability", udp.burst_entry_probability),
                ("burst_exit_probability", udp.burst_exit_probability),
                ("burst_loss", udp.burst_loss),
            ]
        }));
        for (key, share) in shares.filter(|(_, share)| !(0.0..=1.0).contains(share)) {
            problems.push(format!("bus '{name}': {key} is {share}, must be 0 to 1"));
        }
        let times = udp.iter().flat_map(|udp| [("delay_s", udp.delay_s), ("spread_s", udp.spread_s)]);
        for (key, time_s) in times.filter(|(_, time_s)| !(0.0..=100.0).contains(time_s)) {
            problems.push(format!("bus '{name}': {key} is {time_s} s, must be 0 s to 100 s"));
        }
        problems
    }
}
