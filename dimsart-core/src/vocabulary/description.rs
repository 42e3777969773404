//! Descriptions of parameters, ports and data types, in the image's flash or borrowed from a received frame.
//!
//! Help texts are not included: a host finds them by name in its own list of modules.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use crate::module::{Direction, Stage};
use crate::parameter::{Parameter, ParameterShape, ParameterType, Value};
use crate::signal::{DataType, Format, Shape, TypeRef, Unit};

/// Maximum number of names of a choice in a description. It affects memory, not the wire format.
pub const MAX_CHOICES: usize = 8;

/// A choice has more than [`MAX_CHOICES`] names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TooManyChoices;

/// Values that a parameter accepts; see [`ParameterType`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum ParameterTypeDescription<'a> {
    /// A finite number from `min` to `max`.
    Real {
        /// Minimum.
        min: f32,
        /// Maximum.
        max: f32,
    },
    /// A whole number from `min` to `max`.
    Count {
        /// Minimum.
        min: u32,
        /// Maximum.
        max: u32,
    },
    /// A signed whole number from `min` to `max`.
    Integer {
        /// Minimum.
        min: i32,
        /// Maximum.
        max: i32,
    },
    /// `OFF` or `ON`.
    Flag,
    /// One of these names.
    Choice(#[serde(borrow)] Vec<&'a str, MAX_CHOICES>),
    /// A data type, appended to a list.
    Types,
}

/// A parameter of a module kind.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ParameterDescription<'a> {
    /// Name in schemes.
    pub name: &'a str,
    /// Physical unit.
    pub unit: Unit,
    /// Type and range.
    #[serde(borrow)]
    pub accepts: ParameterTypeDescription<'a>,
    /// Number and arrangement of its values.
    pub entries: ParameterShape,
    /// Value of each entry after `INIT`; none for a list, which starts empty.
    pub default: Option<Value>,
    /// Whether it can be set only while the module is not plugged in.
    pub is_structural: bool,
}

impl TryFrom<Parameter> for ParameterDescription<'static> {
    type Error = TooManyChoices;

    fn try_from(parameter: Parameter) -> Result<Self, TooManyChoices> {
        let accepts = match parameter.accepts {
            ParameterType::Real { min, max } => ParameterTypeDescription::Real { min, max },
            ParameterType::Count { min, max } => ParameterTypeDescription::Count { min, max },
            ParameterType::Integer { min, max } => ParameterTypeDescription::Integer { min, max },
            ParameterType::Flag => ParameterTypeDescription::Flag,
            ParameterType::Choice(names) => {
                ParameterTypeDescription::Choice(Vec::from_slice(names).map_err(|_| TooManyChoices)?)
            }
            ParameterType::Types => ParameterTypeDescription::Types,
        };
        let Parameter { name, unit, entries, default, is_structural, .. } = parameter;
        Ok(Self { name, unit, accepts, entries, default, is_structural })
    }
}

/// A port of a module.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct PortDescription<'a> {
    /// Name in schemes, after `PORT_`.
    pub name: &'a str,
    /// Reads, writes or holds memory.
    pub direction: Direction,
    /// Stage that uses it.
    pub stage: Stage,
    /// Whether the data are one tick old.
    pub is_delayed: bool,
    /// Default signal; none for memory.
    pub default: Option<TypeRef>,
    /// Signal that is bound now.
    pub bound: Option<TypeRef>,
}

/// A data type.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct DataTypeDescription<'a> {
    /// Stable number.
    pub id: u16,
    /// Name in schemes.
    pub name: &'a str,
    /// Physical unit.
    pub unit: Unit,
    /// Format of every word.
    pub format: Format,
    /// Rows and columns.
    pub shape: Shape,
}

impl From<&DataType> for DataTypeDescription<'static> {
    fn from(found: &DataType) -> Self {
        let DataType { id, name, unit, format, shape, .. } = *found;
        Self { id, name, unit, format, shape }
    }
}
