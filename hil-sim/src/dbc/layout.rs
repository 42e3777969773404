//! Where the words of a packet lie in CAN frames.

use std::fmt::{self, Display, Formatter};

use dimsart_core::carrier::{can, can_fd};
use dimsart_core::{DeviceDescriptor, PACKET_OVERHEAD, TypeRef, Unit};

use super::Frames;

/// How the bits of a signal are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A whole number.
    Whole,
    /// An IEEE 754 number of 32 bits.
    Real,
    /// A whole number that tells what else is in the frame.
    Multiplexer,
}

/// A signal in a message. Bits count from the low one of the frame's first byte.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Signal {
    /// Name, such as `CH1_TD_WAVES_1` for the first axis.
    pub name: String,
    /// Value of the multiplexer in the frames that it is in; none when it is in every one.
    pub index: Option<usize>,
    /// First bit.
    pub start_bit: usize,
    /// Number of bits.
    pub bits: usize,
    /// How they are read.
    pub kind: Kind,
    /// Physical unit.
    pub unit: String,
}

impl Display for Signal {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self { name, index, start_bit, bits, kind, unit } = self;
        write!(f, " SG_ {name}")?;
        match (kind, index) {
            (Kind::Multiplexer, _) => write!(f, " M")?,
            (_, Some(index)) => write!(f, " m{index}")?,
            (_, None) => {}
        }
        let sign = if *kind == Kind::Real { '-' } else { '+' };
        write!(f, " : {start_bit}|{bits}@1{sign} (1,0) [0|0] \"{unit}\" Vector__XXX")
    }
}

/// A word of a packet: its name, and how it is read.
pub(super) struct PacketWord {
    name: String,
    kind: Kind,
    unit: String,
}

/// The words of a packet of these types; those behind the samples are counters of the first wave, two per axis.
pub(super) fn words(device: &DeviceDescriptor, types: &[TypeRef], count: usize) -> Vec<PacketWord> {
    let axes = || (1..).zip(device.axes());
    let samples = types.iter().flat_map(|signal| {
        let unit = device.data_type(signal.id).map_or(Unit::Any, |found| found.unit);
        let name = device.signal_name(*signal).to_string().replace('.', "_");
        axes().map(move |(axis, kind)| PacketWord {
            name: format!("{name}_{axis}"),
            kind: Kind::Real,
            // The format is older than UTF-8.
            unit: unit.symbol(*kind).replace('·', " "),
        })
    });
    let counters = axes().flat_map(|(axis, _)| {
        ["SENT_WAVES", "SENT_ENERGY"].map(|what| PacketWord {
            name: format!("{what}_{axis}"),
            kind: Kind::Whole,
            unit: String::new(),
        })
    });
    samples.chain(counters).take(count).collect()
}

/// Bytes of the longest frame of a packet of so many words, and most words that fit.
pub(super) fn limits(frames: Frames, words: usize) -> (usize, usize) {
    match frames {
        Frames::Can => (can::MAX_DATA_BYTES, can::MAX_WORDS),
        Frames::CanFd => {
            let content = vec![0; PACKET_OVERHEAD + 4 * words];
            let bytes = can_fd::pack(&content).map_or(can_fd::MAX_DATA_BYTES, |data| data.len());
            (bytes, (can_fd::MAX_CONTENT_BYTES - PACKET_OVERHEAD) / 4)
        }
    }
}

/// The signals of the frames that carry these words.
pub(super) fn signals(frames: Frames, words: Vec<PacketWord>) -> Vec<Signal> {
    match frames {
        Frames::Can => in_can(words),
        Frames::CanFd => in_can_fd(words),
    }
}

fn in_can(words: Vec<PacketWord>) -> Vec<Signal> {
    let head = [
        whole("CRC", None, 0, 8),
        whole("COUNTER_LOW", None, 8, 4),
        Signal { kind: Kind::Multiplexer, ..whole("INDEX", None, 12, 4) },
        whole("LAST_INDEX", Some(0), 16, 4),
        whole("COUNTER_HIGH", Some(0), 20, 12),
        whole("ECHO", Some(1), 16, 16),
        whole("CONTENT", Some(2), 16, 16),
    ];
    let heads = 3;
    let words = (0..).zip(words).map(|(index, word)| {
        let start_bit = if index < heads { 32 } else { 16 };
        Signal { name: word.name, index: Some(index), start_bit, bits: 32, kind: word.kind, unit: word.unit }
    });
    head.into_iter().chain(words).collect()
}

fn in_can_fd(words: Vec<PacketWord>) -> Vec<Signal> {
    let first_bit = 64;
    let crc = whole("CRC", None, first_bit + 32 * words.len(), 32);
    let head = [
        whole("LENGTH", None, 0, 8),
        whole("CLASS", None, 8, 8),
        whole("COUNTER", None, 16, 16),
        whole("ECHO", None, 32, 16),
        whole("CONTENT", None, 48, 16),
    ];
    let words = (0..).zip(words).map(|(place, word)| {
        let start_bit = first_bit + 32 * place;
        Signal { name: word.name, index: None, start_bit, bits: 32, kind: word.kind, unit: word.unit }
    });
    head.into_iter().chain(words).chain([crc]).collect()
}

fn whole(name: &str, index: Option<usize>, start_bit: usize, bits: usize) -> Signal {
    Signal { name: name.to_owned(), index, start_bit, bits, kind: Kind::Whole, unit: String::new() }
}
