//! Layout of a packet's words in CAN frames.

use std::fmt::{self, Display, Formatter};

use dimsart_core::{DeviceDescriptor, Format, PACKET_OVERHEAD, TypeRef};
use dimsart_link::carrier::{can, can_fd};
use serde::Serialize;

use super::FrameFormat;
use hil_sim::recording::indices;

/// Number format of a signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum NumberFormat {
    /// Unsigned integer.
    Whole,
    /// Signed integer.
    Signed,
    /// 32-bit IEEE 754 number.
    Real,
    /// Unsigned integer that selects the other signals of the frame.
    Multiplexer,
}

/// A signal in a message. Bit 0 is the lowest bit of the frame's first byte.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Signal {
    /// Name, such as `CH1_TD_WAVES_1` for the first axis, `INERTIA_1_2` for an element of a matrix.
    pub name: String,
    /// Value of the multiplexer in its frames; none if it is in every frame.
    pub index: Option<usize>,
    /// First bit.
    pub start_bit: usize,
    /// Number of bits.
    pub bits: usize,
    /// Number format.
    pub kind: NumberFormat,
    /// Physical unit.
    pub unit: String,
}

impl Display for Signal {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self { name, index, start_bit, bits, kind, unit } = self;
        write!(f, " SG_ {name}")?;
        match (kind, index) {
            (NumberFormat::Multiplexer, _) => write!(f, " M")?,
            (_, Some(index)) => write!(f, " m{index}")?,
            (_, None) => {}
        }
        let sign = if matches!(kind, NumberFormat::Real | NumberFormat::Signed) { '-' } else { '+' };
        write!(f, " : {start_bit}|{bits}@1{sign} (1,0) [0|0] \"{unit}\" Vector__XXX")
    }
}

/// A word of a packet.
pub(super) struct PacketWord {
    name: String,
    kind: NumberFormat,
    unit: String,
}

/// The words of a packet of these types: samples, then counters of the first wave, two per axis.
pub(super) fn words(device: &DeviceDescriptor, types: &[TypeRef], count: usize) -> Vec<PacketWord> {
    let axes = || (1..).zip(device.axes());
    let found = types.iter().filter_map(|signal| Some((*signal, device.data_type(signal.id)?)));
    let samples = found.flat_map(|(signal, data_type)| {
        let name = device.signal_name(signal).to_string().replace('.', "_");
        let kind = match data_type.format {
            Format::F32 => NumberFormat::Real,
            Format::I32 => NumberFormat::Signed,
            Format::U32 | Format::Bool => NumberFormat::Whole,
        };
        (0..data_type.shape.words(device.dof())).map(move |word| {
            let indices = indices(data_type.shape, word, device.dof());
            let suffix: String = indices.iter().map(|index| format!("_{}", index + 1)).collect();
            let unit = data_type.unit.for_word(data_type.shape, word, device.axes());
            // DBC is not UTF-8.
            let unit = unit.to_string().replace('·', " ");
            PacketWord { name: format!("{name}{suffix}"), kind, unit }
        })
    });
    let counters = axes().flat_map(|(axis, _)| {
        ["SENT_WAVES", "SENT_ENERGY"].map(|what| PacketWord {
            name: format!("{what}_{axis}"),
            kind: NumberFormat::Whole,
            unit: String::new(),
        })
    });
    samples.chain(counters).take(count).collect()
}

/// Longest frame of a packet with `words`, bytes, and maximum words.
pub(super) fn limits(frames: FrameFormat, words: usize) -> (usize, usize) {
    match frames {
        FrameFormat::Can => (can::MAX_DATA_BYTES, can::MAX_WORDS),
        FrameFormat::CanFd => {
            let content = vec![0; PACKET_OVERHEAD + 4 * words];
            let bytes = can_fd::pack(&content).map_or(can_fd::MAX_DATA_BYTES, |data| data.len());
            (bytes, (can_fd::MAX_CONTENT_BYTES - PACKET_OVERHEAD) / 4)
        }
    }
}

/// The signals of frames with these words.
pub(super) fn signals(frames: FrameFormat, words: Vec<PacketWord>) -> Vec<Signal> {
    match frames {
        FrameFormat::Can => in_can(words),
        FrameFormat::CanFd => in_can_fd(words),
    }
}

fn in_can(words: Vec<PacketWord>) -> Vec<Signal> {
    let head = [
        whole("CRC", None, 0, 8),
        whole("COUNTER_LOW", None, 8, 4),
        Signal { kind: NumberFormat::Multiplexer, ..whole("INDEX", None, 12, 4) },
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
    Signal { name: name.to_owned(), index, start_bit, bits, kind: NumberFormat::Whole, unit: String::new() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dimsart_core::{AxisKind, DataType, Shape, Summary, Unit, types};

    const fn own(id: u16, name: &'static str, format: Format, shape: Shape) -> DataType {
        DataType { id, name, unit: Unit::Force, format, shape, summary: Summary::new("") }
    }

    const COUNT: &DataType = &own(0x8000, "COUNT", Format::I32, Shape::Scalar);
    const BRAKES: &DataType = &own(0x8001, "BRAKES", Format::Bool, Shape::Matrix(1, 2));
    const INERTIA: &DataType = &own(0x8002, "INERTIA", Format::F32, Shape::Square);

    #[test]
    fn every_word_of_every_format_and_shape_has_a_name_and_a_kind() {
        let axes = [AxisKind::Linear, AxisKind::Rotary];
        let device =
            DeviceDescriptor::new("arm", &axes, 1e-3, &[COUNT, BRAKES, INERTIA, types::CH1_WAVES], &[])
                .unwrap();
        let types = [COUNT, types::CH1_WAVES, BRAKES, INERTIA].map(DataType::first);
        let words = words(&device, &types, 9 + 4);
        let found: Vec<_> =
            words.iter().map(|word| (word.name.as_str(), word.kind, word.unit.as_str())).collect();
        assert_eq!(
            found,
            [
                ("COUNT", NumberFormat::Signed, "N or N m"),
                ("CH1_WAVES_1", NumberFormat::Real, "sqrt(W)"),
                ("CH1_WAVES_2", NumberFormat::Real, "sqrt(W)"),
                ("BRAKES_1_1", NumberFormat::Whole, "N"),
                ("BRAKES_1_2", NumberFormat::Whole, "N"),
                ("INERTIA_1_1", NumberFormat::Real, "N"),
                ("INERTIA_1_2", NumberFormat::Real, "N"),
                ("INERTIA_2_1", NumberFormat::Real, "N m"),
                ("INERTIA_2_2", NumberFormat::Real, "N m"),
                ("SENT_WAVES_1", NumberFormat::Whole, ""),
                ("SENT_ENERGY_1", NumberFormat::Whole, ""),
                ("SENT_WAVES_2", NumberFormat::Whole, ""),
                ("SENT_ENERGY_2", NumberFormat::Whole, ""),
            ]
        );
    }
}
