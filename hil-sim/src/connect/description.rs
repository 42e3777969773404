//! What a device says of itself, kept beyond the frame it came in.

use std::fmt;

use dimsart_core::protocol::{self, Accepted, DataTypeText, ModuleText, ParameterText, UnitText};
use dimsart_core::{AxisKind, Format};
use serde::{Serialize, Serializer};

/// Who is there.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Identity {
    /// Version of its protocol.
    pub protocol_version: u16,
    /// Name of the device.
    pub device: String,
    /// Name of the image.
    pub image: String,
    /// What moves on each axis.
    #[serde(serialize_with = "axis_names")]
    pub axes: Vec<AxisKind>,
    /// Time between two ticks, `s`.
    pub sample_period_s: f32,
}

impl From<protocol::Identity<'_>> for Identity {
    fn from(found: protocol::Identity<'_>) -> Self {
        Self {
            protocol_version: found.protocol_version,
            device: found.device.to_owned(),
            image: found.image.to_owned(),
            axes: found.axes.to_vec(),
            sample_period_s: found.sample_period_s,
        }
    }
}

pub(super) fn axis_name(axis: AxisKind) -> &'static str {
    match axis {
        AxisKind::Linear => "linear",
        AxisKind::Rotary => "rotary",
    }
}

fn axis_names<S: Serializer>(axes: &[AxisKind], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(axes.iter().copied().map(axis_name))
}

/// A unit's symbol on both kinds of axis.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Units {
    linear: String,
    rotary: String,
}

impl From<UnitText<'_>> for Units {
    fn from(found: UnitText<'_>) -> Self {
        Self { linear: found.linear.to_owned(), rotary: found.rotary.to_owned() }
    }
}

impl Units {
    /// The symbol on these axes; both where they differ.
    pub(super) fn on(&self, axes: &[AxisKind]) -> String {
        let is_all = |kind| axes.iter().all(|axis| *axis == kind);
        if self.linear == self.rotary || is_all(AxisKind::Linear) {
            self.linear.clone()
        } else if is_all(AxisKind::Rotary) {
            self.rotary.clone()
        } else {
            format!("{} or {}", self.linear, self.rotary)
        }
    }
}

/// A kind of module.
#[derive(Debug, Clone)]
pub(super) struct Kind {
    pub(super) name: String,
    /// Learnt when first needed.
    pub(super) parameters: Option<Vec<Parameter>>,
}

impl From<ModuleText<'_>> for Kind {
    fn from(found: ModuleText<'_>) -> Self {
        Self { name: found.name.to_owned(), parameters: None }
    }
}

/// What a parameter takes.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Range {
    Real { min: f32, max: f32, per_axis: bool },
    Count { min: u32, max: u32 },
    Flag,
    Choice(Vec<String>),
    Types,
}

impl From<Accepted<'_>> for Range {
    fn from(found: Accepted<'_>) -> Self {
        match found {
            Accepted::Real { min, max, per_axis } => Self::Real { min, max, per_axis },
            Accepted::Count { min, max } => Self::Count { min, max },
            Accepted::Flag => Self::Flag,
            Accepted::Choice(names) => Self::Choice(names.iter().map(|name| (*name).to_owned()).collect()),
            Accepted::Types => Self::Types,
        }
    }
}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Real { min, max, .. } => write!(f, "{min} to {max}"),
            Self::Count { min, max } => write!(f, "{min} to {max}"),
            Self::Flag => f.write_str("OFF, ON"),
            Self::Choice(names) => f.write_str(&names.join(", ")),
            Self::Types => f.write_str("adds a data type"),
        }
    }
}

/// A parameter of a kind of module.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Parameter {
    pub(super) name: String,
    pub(super) units: Units,
    pub(super) range: Range,
    pub(super) summary: String,
}

impl From<ParameterText<'_>> for Parameter {
    fn from(found: ParameterText<'_>) -> Self {
        Self {
            name: found.name.to_owned(),
            units: found.unit.into(),
            range: found.accepts.into(),
            summary: found.summary.to_owned(),
        }
    }
}

impl Parameter {
    pub(super) fn is_per_axis(&self) -> bool {
        matches!(self.range, Range::Real { per_axis: true, .. })
    }
}

/// A data type.
#[derive(Debug, Clone)]
pub(super) struct DataType {
    pub(super) id: u16,
    pub(super) name: String,
    pub(super) units: Units,
}

impl From<DataTypeText<'_>> for DataType {
    fn from(found: DataTypeText<'_>) -> Self {
        Self { id: found.id, name: found.name.to_owned(), units: found.unit.into() }
    }
}

/// A value as it is shown: a number, or a word of the device's.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum ValueText {
    /// A real number; null in JSON when it is not finite.
    Real(f32),
    /// A whole number.
    Whole(i64),
    /// `OFF` or `ON`.
    Flag(bool),
    /// The name of a choice, a signal or a module.
    Name(String),
}

impl ValueText {
    /// A word of a signal.
    pub(super) fn of_word(word: u32, format: Format) -> Self {
        match format {
            Format::F32 => Self::Real(f32::from_bits(word)),
            Format::I32 => Self::Whole(word.cast_signed().into()),
            Format::U32 => Self::Whole(word.into()),
            Format::Bool => Self::Flag(word != 0),
        }
    }
}

impl fmt::Display for ValueText {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            // Neither a row of zeros nor digits that a float does not have.
            Self::Real(value) => match value.abs() {
                size if size != 0.0 && !(1e-4..1e7).contains(&size) => f.pad(&format!("{value:e}")),
                _ => f.pad(&value.to_string()),
            },
            Self::Whole(value) => f.pad(&value.to_string()),
            Self::Flag(value) => f.pad(if *value { "ON" } else { "OFF" }),
            Self::Name(name) => f.pad(name),
        }
    }
}

/// Values one behind the other.
pub(super) fn joined(values: &[ValueText]) -> String {
    values.iter().map(ToString::to_string).collect::<Vec<_>>().join("  ")
}
