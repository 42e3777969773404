//! Cached self-description of a device.

use std::cell::Cell;
use std::fmt;

use dimsart_core::scheme::{SWITCH, switch};
use dimsart_core::{
    AxisKind, DataTypeDescription, Format, KindId, ModuleKinds, ModuleRef, ParameterDescription,
    ParameterShape, ParameterTypeDescription, PortDescription, Shape, Unit, Value, Vocabulary,
};
use dimsart_link::protocol::{self, Request, Response, decode_response};
use hil_sim::recording::indices;
use serde::{Serialize, Serializer};

/// Identity of a device.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Identity {
    /// Version of its protocol.
    pub protocol_version: u16,
    /// Name of the device.
    pub device: String,
    /// Name of the image.
    pub image: String,
    /// Kind of each axis.
    #[serde(serialize_with = "axis_names")]
    pub axes: Vec<AxisKind>,
    /// Sample period, `s`.
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

/// Cached answers of a device about itself.
///
/// A lookup that misses the cache records the request, which [`Device::know`](super::Device::know) then sends.
#[derive(Debug)]
pub(super) struct Description {
    pub(super) identity: Identity,
    /// Module kinds of this program.
    pub(super) kinds: ModuleKinds,
    answers: Vec<Answer>,
    missing: Cell<Option<Request>>,
}

/// The content of an answer; `None` where the device has no such index.
#[derive(Debug)]
struct Answer {
    request: Request,
    content: Option<Vec<u8>>,
}

impl Description {
    pub(super) fn new(identity: Identity, kinds: ModuleKinds) -> Self {
        Self { identity, kinds, answers: Vec::new(), missing: Cell::new(None) }
    }

    /// Takes the first request that missed the cache.
    pub(super) fn take_missing(&self) -> Option<Request> {
        self.missing.take()
    }

    pub(super) fn learn(&mut self, request: Request, content: Option<Vec<u8>>) {
        self.answers.push(Answer { request, content });
    }

    /// Forgets the ports, which depend on parameters.
    pub(super) fn forget_ports(&mut self) {
        self.answers.retain(|answer| !matches!(answer.request, Request::Port { .. }));
    }

    fn answer(&self, request: Request) -> Option<Response<'_>> {
        match self.answers.iter().find(|answer| answer.request == request) {
            Some(Answer { content, .. }) => Some(decode_response(content.as_deref()?).ok()?.1),
            None => {
                // Only the first miss counts: later lookups may depend on it.
                self.missing.set(self.missing.get().or(Some(request)));
                None
            }
        }
    }

    /// Returns the help text of a parameter; empty if this program does not have its module.
    pub(super) fn summary(&self, kind: KindId, parameter: &str) -> &'static str {
        let index = self.kinds.parameter(kind, parameter);
        let found = index.and_then(|index| self.kinds.describe_parameter(kind, index));
        found.map_or("", |found| found.summary.text())
    }

    /// Converts a value to text with the names of the device.
    pub(super) fn value_text(&self, value: Value, accepts: &ParameterTypeDescription<'_>) -> DisplayValue {
        match (value, accepts) {
            (Value::Real(value), _) => DisplayValue::Real(value),
            (Value::Count(value), _) => DisplayValue::Whole(value.into()),
            (Value::Integer(value), _) => DisplayValue::Whole(value.into()),
            (Value::Flag(value), _) => DisplayValue::Flag(value),
            (Value::Choice(index), ParameterTypeDescription::Choice(names)) => names
                .get(usize::from(index))
                .map_or(DisplayValue::Whole(index.into()), |name| DisplayValue::Name((*name).to_owned())),
            (Value::Choice(index), _) => DisplayValue::Whole(index.into()),
            (Value::Type(signal), _) => DisplayValue::Name(self.signal_name(signal).to_string()),
        }
    }
}

impl Vocabulary for Description {
    fn device_name(&self) -> &str {
        &self.identity.device
    }

    fn axes(&self) -> &[AxisKind] {
        &self.identity.axes
    }

    fn kind_at(&self, place: u8) -> Option<&str> {
        match self.answer(Request::Module { place })? {
            Response::Module(found) => Some(found.name),
            _ => None,
        }
    }

    fn kind_name(&self, kind: KindId) -> Option<&str> {
        // Ids are derived from names, so kinds of this program are not read from the device.
        let known = self.kinds.kind(kind).map(|known| known.name);
        known.or_else(|| self.kind_names().find(|name| KindId::from_name(name) == kind))
    }

    fn parameter_text(&self, kind: KindId, index: u8) -> Option<ParameterDescription<'_>> {
        match self.answer(Request::Parameter { kind, index })? {
            Response::Parameter(found) => Some(found),
            _ => None,
        }
    }

    fn port_text(&self, module: ModuleRef, index: u8) -> Option<PortDescription<'_>> {
        match self.answer(Request::Port { module, index })? {
            Response::Port(found) => Some(found),
            _ => None,
        }
    }

    fn type_text(&self, index: u16) -> Option<DataTypeDescription<'_>> {
        match self.answer(Request::DataType { index })? {
            Response::DataType(found) => Some(found),
            _ => None,
        }
    }
}

/// Indices and unit of a word of a signal; the unit of a pure number is empty.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(crate) struct WordText {
    pub(crate) indices: Vec<usize>,
    pub(crate) unit: String,
}

impl WordText {
    /// Lists the words of a signal.
    pub(super) fn of_all(unit: Unit, shape: Shape, axes: &[AxisKind]) -> Vec<Self> {
        let word = |word| Self {
            indices: indices(shape, word, axes.len()),
            unit: unit.for_word(shape, word, axes).to_string(),
        };
        (0..shape.words(axes.len())).map(word).collect()
    }
}

/// Describes the range of a parameter, and its number of entries.
pub(crate) fn range_text(parameter: &ParameterDescription<'_>) -> String {
    let takes = match &parameter.accepts {
        // Above 1e12 in scientific notation.
        ParameterTypeDescription::Real { min, max } if max.abs() > 1e12 => format!("{min:e} to {max:e}"),
        ParameterTypeDescription::Real { min, max } => format!("{min} to {max}"),
        ParameterTypeDescription::Count { min, max } => format!("{min} to {max}"),
        ParameterTypeDescription::Integer { min, max } => format!("{min} to {max}"),
        ParameterTypeDescription::Flag => SWITCH.join(", "),
        ParameterTypeDescription::Choice(names) => names.join(", "),
        ParameterTypeDescription::Types => "a data type".to_owned(),
    };
    let or_axes = |count: u8| if count == 0 { "axes".to_owned() } else { count.to_string() };
    match parameter.entries {
        ParameterShape::ONE => takes,
        ParameterShape::AXES => format!("{takes}, per axis"),
        ParameterShape { rows, columns } => format!("{takes}, {} × {}", or_axes(rows), or_axes(columns)),
    }
}

/// A value for display: a number, or a name on the device.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum DisplayValue {
    /// A real number; null in JSON if it is NaN or infinite.
    Real(f32),
    /// A whole number.
    Whole(i64),
    /// `OFF` or `ON`.
    Flag(bool),
    /// The name of a choice, a signal or a module.
    Name(String),
}

impl DisplayValue {
    /// Converts a word of a signal.
    pub(super) fn of_word(word: u32, format: Format) -> Self {
        match format {
            Format::F32 => Self::Real(f32::from_bits(word)),
            Format::I32 => Self::Whole(word.cast_signed().into()),
            Format::U32 => Self::Whole(word.into()),
            Format::Bool => Self::Flag(word != 0),
        }
    }
}

impl fmt::Display for DisplayValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            // Scientific notation for very small and very large values.
            Self::Real(value) => match value.abs() {
                size if size != 0.0 && !(1e-4..1e7).contains(&size) => f.pad(&format!("{value:e}")),
                _ => f.pad(&value.to_string()),
            },
            Self::Whole(value) => f.pad(&value.to_string()),
            Self::Flag(value) => f.pad(switch(*value)),
            Self::Name(name) => f.pad(name),
        }
    }
}

/// Joins values, separated by spaces.
pub(super) fn joined(values: &[DisplayValue]) -> String {
    values.iter().map(ToString::to_string).collect::<Vec<_>>().join("  ")
}
