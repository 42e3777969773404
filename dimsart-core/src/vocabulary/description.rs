//! Descriptions of parameters, ports and data types: texts of the image's flash, or borrowed from a frame on a host.
//!
//! Help texts are not part of them: a host has those of the modules it knows, by their names.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use crate::module::{Direction, Stage};
use crate::parameter::{Accepts, Entries, Parameter, Value};
use crate::signal::{DataType, Format, Shape, TypeRef, Unit};

/// Most names of a choice that one description holds. No matter of the wire: more take more memory.
pub const MAX_CHOICES: usize = 8;

/// A choice has more than [`MAX_CHOICES`] names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TooManyChoices;

/// What a parameter accepts; see [`Accepts`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Accepted<'a> {
    /// A finite number from `min` to `max`.
    Real {
        /// Smallest value.
        min: f32,
        /// Largest value.
        max: f32,
    },
    /// A whole number from `min` to `max`.
    Count {
        /// Smallest value.
        min: u32,
        /// Largest value.
        max: u32,
    },
    /// A whole number of either sign from `min` to `max`.
    Integer {
        /// Smallest value.
        min: i32,
        /// Largest value.
        max: i32,
    },
    /// `OFF` or `ON`.
    Flag,
    /// One of these names.
    Choice(#[serde(borrow)] Vec<&'a str, MAX_CHOICES>),
    /// A data type, added to a list.
    Types,
}

/// A parameter of a kind of module.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ParameterText<'a> {
    /// Name in schemes.
    pub name: &'a str,
    /// Physical unit.
    pub unit: Unit,
    /// Kind and range.
    #[serde(borrow)]
    pub accepts: Accepted<'a>,
    /// How many values it has.
    pub entries: Entries,
    /// Value after `INIT`, of each entry; none for a list, which starts empty.
    pub default: Option<Value>,
    /// Whether it can be set only while the module is not plugged in.
    pub is_structural: bool,
}

impl TryFrom<Parameter> for ParameterText<'static> {
    type Error = TooManyChoices;

    fn try_from(parameter: Parameter) -> Result<Self, TooManyChoices> {
        let accepts = match parameter.accepts {
            Accepts::Real { min, max } => Accepted::Real { min, max },
            Accepts::Count { min, max } => Accepted::Count { min, max },
            Accepts::Integer { min, max } => Accepted::Integer { min, max },
            Accepts::Flag => Accepted::Flag,
            Accepts::Choice(names) => Accepted::Choice(Vec::from_slice(names).map_err(|_| TooManyChoices)?),
            Accepts::Types => Accepted::Types,
        };
        let Parameter { name, unit, entries, default, is_structural, .. } = parameter;
        Ok(Self { name, unit, accepts, entries, default, is_structural })
    }
}

/// A port of a module.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct PortText<'a> {
    /// Name in schemes, behind `PORT_`.
    pub name: &'a str,
    /// Reads, writes or holds memory.
    pub direction: Direction,
    /// Stage that uses it.
    pub stage: Stage,
    /// Whether data one tick old is what it wants or gives.
    pub is_delayed: bool,
    /// Signal it is bound to unless a command says otherwise; none for memory.
    pub default: Option<TypeRef>,
    /// Signal it is bound to now.
    pub bound: Option<TypeRef>,
}

/// A data type.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct DataTypeText<'a> {
    /// Stable number.
    pub id: u16,
    /// Name in schemes.
    pub name: &'a str,
    /// Physical unit.
    pub unit: Unit,
    /// Format of every word.
    pub format: Format,
    /// Number and arrangement of words.
    pub shape: Shape,
}

impl From<&DataType> for DataTypeText<'static> {
    fn from(found: &DataType) -> Self {
        let DataType { id, name, unit, format, shape, .. } = *found;
        Self { id, name, unit, format, shape }
    }
}
