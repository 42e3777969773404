//! What a `[[bus]]` says of its medium. A key that is left out has its default.

use serde::{Deserialize, Serialize};

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

/// `uart`: one in each direction.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct UartSection {
    /// Bit rate; a byte takes 10 bits.
    pub bits_per_s: u32,
    /// Share of bits that arrive wrong, 0 to 1.
    pub bit_error_rate: f64,
    /// Share of bytes that get lost, 0 to 1.
    pub byte_drop: f64,
    /// Share of bytes before which comes one that was never sent, 0 to 1.
    pub byte_insert: f64,
    /// Bytes that can wait to be sent; a packet that does not fit is dropped.
    pub queue_bytes: usize,
}

/// `can` or `can_fd`: one for all links.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct CanSection {
    /// Nominal bit rate.
    pub bits_per_s: u32,
    /// Bit rate of the data of CAN FD.
    pub data_bits_per_s: u32,
    /// Share of bits that all nodes see wrong, 0 to 1.
    pub bit_error_rate: f64,
    /// Nodes besides those of the links: each sends a packet like the first link's whenever that one does.
    pub other_nodes: u32,
    /// How often a node comes back after bus-off.
    pub rejoins: u32,
    /// Frames that can wait in a node; a packet that does not fit is dropped.
    pub queue_frames: usize,
}

/// `udp`: a network path in each direction.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct UdpSection {
    /// Bit rate to a controller further down in the file.
    pub forward_bits_per_s: u32,
    /// Bit rate to one further up.
    pub backward_bits_per_s: u32,
    /// Bytes of each packet besides its content.
    pub header_bytes: usize,
    /// Bytes that can wait to be sent; a packet that does not fit is dropped.
    pub queue_bytes: usize,
    /// The kind of delay.
    pub delay: DelayKind,
    /// The delay, or the minimum of it.
    pub delay_s: f64,
    /// `uniform`: maximum less minimum; `gamma`: the mean of what comes on top.
    pub spread_s: f64,
    /// `gamma`: 1 is exponential, a large one is bell-shaped.
    pub gamma_shape: f64,
    /// `recorded`: delays in s, one a row, in the first column; `lost` is a lost packet.
    pub delays_file: String,
    /// Probability per packet that a burst of losses begins (Gilbert-Elliott), 0 to 1.
    pub burst_start: f64,
    /// Probability per packet that it ends, 0 to 1.
    pub burst_end: f64,
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
            burst_start: 0.0,
            burst_end: 1.0,
            burst_loss: 1.0,
            overtaking: false,
        }
    }
}
