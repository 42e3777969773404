//! Parameters of the medium of a `[[bus]]`; every key has a default.

use serde::{Deserialize, Serialize};

/// Distribution of the delays of `[udp]`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum DelayKind {
    /// Constant `delay_s`.
    Constant,
    /// Uniform from `delay_s` to `delay_s + spread_s`.
    Uniform,
    /// `delay_s` plus a gamma-distributed time with mean `spread_s`.
    Gamma,
    /// Recorded, from `delays_file`.
    Recorded,
}

/// `uart`: one UART in each direction.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct UartSection {
    /// Bit rate; a byte takes 10 bits.
    pub bits_per_s: u32,
    /// Probability of a bit error, 0 to 1.
    pub bit_error_rate: f64,
    /// Share of lost bytes, 0 to 1.
    pub byte_drop: f64,
    /// Share of bytes preceded by a spurious byte, 0 to 1.
    pub byte_insert: f64,
    /// Size of the send queue, bytes; packets that do not fit are dropped.
    pub queue_bytes: usize,
}

/// `can` or `can_fd`: one bus for all links.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct CanSection {
    /// Nominal bit rate.
    pub bits_per_s: u32,
    /// Data bit rate of CAN FD.
    pub data_bits_per_s: u32,
    /// Probability of a bit error seen by all nodes, 0 to 1.
    pub bit_error_rate: f64,
    /// Additional nodes: each sends a packet of equal size with each packet of the first link.
    pub other_nodes: u32,
    /// Maximum number of recoveries of a node from bus-off.
    pub rejoins: u32,
    /// Size of a node's send queue, frames; packets that do not fit are dropped.
    pub queue_frames: usize,
}

/// `udp`: a network path in each direction.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct UdpSection {
    /// Bit rate to a controller further down in the file.
    pub forward_bits_per_s: u32,
    /// Bit rate to a controller further up in the file.
    pub backward_bits_per_s: u32,
    /// Header of each packet, bytes.
    pub header_bytes: usize,
    /// Size of the send queue, bytes; packets that do not fit are dropped.
    pub queue_bytes: usize,
    /// Distribution of the delay.
    pub delay: DelayKind,
    /// Delay or minimum delay, `s`.
    pub delay_s: f64,
    /// `uniform`: maximum minus minimum; `gamma`: mean above the minimum; `s`.
    pub spread_s: f64,
    /// Shape of `gamma`: 1 is exponential, large values are bell-shaped.
    pub gamma_shape: f64,
    /// `recorded`: CSV file, first column: delay in s, or `lost`.
    pub delays_file: String,
    /// Probability per packet that a loss burst starts (Gilbert-Elliott), 0 to 1.
    pub burst_entry_probability: f64,
    /// Probability per packet that a loss burst ends, 0 to 1.
    pub burst_exit_probability: f64,
    /// Share of packets lost in a burst, 0 to 1.
    pub burst_loss: f64,
    /// Whether packets can overtake each other.
    pub overtaking: bool,
}

impl Default for UartSection {
    fn default() -> Self {
        Self { bits_per_s: 921_600, bit_error_rate: 0.0, byte_drop: 0.0, byte_insert: 0.0, queue_bytes: 512 }
    }
}

impl Default for CanSection {
    fn default() -> Self {
        Self {
            bits_per_s: 1_000_000,
            data_bits_per_s: 4_000_000,
            bit_error_rate: 0.0,
            other_nodes: 0,
            rejoins: 3,
            queue_frames: 64,
        }
    }
}

impl Default for UdpSection {
    /// UDP over IPv4 at 100 Mbit/s, without delay and loss.
    fn default() -> Self {
        Self {
            forward_bits_per_s: 100_000_000,
            backward_bits_per_s: 100_000_000,
            header_bytes: 28,
            queue_bytes: 65_536,
            delay: DelayKind::Constant,
            delay_s: 0.0,
            spread_s: 0.0,
            gamma_shape: 2.0,
            delays_file: "delays.csv".to_owned(),
            burst_entry_probability: 0.0,
            burst_exit_probability: 1.0,
            burst_loss: 1.0,
            overtaking: false,
        }
    }
}
