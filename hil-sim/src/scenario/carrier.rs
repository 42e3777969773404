//! `link.carrier` and the sections of the media.

use serde::{Deserialize, Serialize};

/// What carries packets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum CarrierKind {
    /// Nothing but the link's own delay.
    Ideal,
    /// A UART in each direction.
    Uart,
    /// A CAN bus with frames of at most 8 bytes.
    Can,
    /// A CAN bus with CAN FD frames.
    CanFd,
    /// A network path in each direction.
    Udp,
}

/// Where the delays of `[udp]` come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum DelayKind {
    /// Always `delay_s`.
    Constant,
    /// From `delay_s` to `delay_s + spread_s`, as likely anywhere.
    Uniform,
    /// `delay_s` and a gamma-distributed time of mean `spread_s` on top.
    Gamma,
    /// From `delays_file`.
    Recorded,
}

/// `[uart]`: a UART in each direction.
#[expect(missing_docs, reason = "the shipped file has a line for every key")]
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct UartSection {
    pub bits_per_s: u32,
    pub bit_error_rate: f64,
    pub byte_drop: f64,
    pub byte_insert: f64,
    pub queue_bytes: usize,
}

/// `[can]`: a CAN bus for both directions.
#[expect(missing_docs, reason = "the shipped file has a line for every key")]
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct CanSection {
    pub bits_per_s: u32,
    pub data_bits_per_s: u32,
    pub bit_error_rate: f64,
    pub other_nodes: u32,
    pub rejoins: u32,
    pub queue_frames: usize,
}

/// `[udp]`: a network path in each direction.
#[expect(missing_docs, reason = "the shipped file has a line for every key")]
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct UdpSection {
    pub forward_bits_per_s: u32,
    pub backward_bits_per_s: u32,
    pub header_bytes: usize,
    pub queue_bytes: usize,
    pub delay: DelayKind,
    pub delay_s: f64,
    pub spread_s: f64,
    pub gamma_shape: f64,
    pub delays_file: String,
    pub burst_start: f64,
    pub burst_end: f64,
    pub burst_loss: f64,
    pub overtaking: bool,
}
