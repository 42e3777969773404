//! Parameters of modules.
//!
//! A module lists its parameters in [`Module::parameters`](crate::Module::parameters), one call per
//! parameter. This list sets defaults, checks and applies commands, answers queries and provides the help
//! texts.

mod choice;
mod entries;
mod set;
mod visit;

pub use choice::Choice;
pub use entries::ParameterShape;
pub use set::ParameterSet;
pub(crate) use visit::Found;
pub use visit::Parameters;

use core::cell::Cell;

use crate::limits::MAX_CHANNEL_TYPES;
use crate::signal::words::{read_next, write_next};
use crate::signal::{Summary, TypeRef, Unit, Words};

/// Data types of a comm channel, in the order in which they were added.
#[derive(Debug, Clone, Copy, Default)]
pub struct TypeList {
    count: u8,
    signals: [TypeRef; MAX_CHANNEL_TYPES],
}

impl TypeList {
    /// Appends a type; returns it as the error if the list is full.
    pub(crate) fn push(&mut self, signal: TypeRef) -> Result<(), TypeRef> {
        *self.signals.get_mut(usize::from(self.count)).ok_or(signal)? = signal;
        self.count += 1;
        Ok(())
    }
}

impl core::ops::Deref for TypeList {
    type Target = [TypeRef];

    fn deref(&self) -> &[TypeRef] {
        self.signals.get(..usize::from(self.count)).unwrap_or_default()
    }
}

impl Words for TypeRef {
    const COUNT: usize = 1;

    #[inline(always)]
    fn load(words: &[Cell<u32>]) -> Self {
        let [id, id_high, number, _] = u32::load(words).to_le_bytes();
        Self { id: u16::from_le_bytes([id, id_high]), number }
    }

    #[inline(always)]
    fn store(self, words: &[Cell<u32>]) {
        (u32::from(self.number) << 16 | u32::from(self.id)).store(words);
    }
}

impl Words for TypeList {
    const COUNT: usize = 1 + MAX_CHANNEL_TYPES;

    #[inline(always)]
    fn load(mut words: &[Cell<u32>]) -> Self {
        let [count, ..] = read_next::<u32>(&mut words).to_le_bytes();
        Self { count, signals: read_next(&mut words) }
    }

    #[inline(always)]
    fn store(self, mut words: &[Cell<u32>]) {
        write_next(u32::from(self.count), &mut words);
        write_next(self.signals, &mut words);
    }
}

/// A parameter's value.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Value {
    /// A real number.
    Real(f32),
    /// A whole number.
    Count(u32),
    /// Boolean.
    Flag(bool),
    /// Index in the names of a choice.
    Choice(u8),
    /// A data type.
    Type(TypeRef),
    /// A signed whole number.
    Integer(i32),
}

/// Values that a parameter accepts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ParameterType {
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
    Choice(&'static [&'static str]),
    /// A data type, appended to a list of at most [`MAX_CHANNEL_TYPES`].
    Types,
}

/// Description of a parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter {
    /// Name in schemes, `UPPER_CASE`.
    pub name: &'static str,
    /// Physical unit.
    pub unit: Unit,
    /// Type and range.
    pub accepts: ParameterType,
    /// Number and arrangement of its values.
    pub entries: ParameterShape,
    /// Value of each entry after `INIT`; none for a list, which starts empty.
    pub default: Option<Value>,
    /// Whether it changes ports or memory, so that it can be set only while the module is not plugged in.
    pub is_structural: bool,
    /// One sentence for help texts.
    pub summary: Summary,
}

/// Reason why a value was refused. The parameter keeps its old value.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ParameterError {
    /// The module has no parameter of this number.
    Unknown,
    /// Wrong type of value, for example a name instead of a number.
    WrongKind,
    /// Out of range, NaN or infinite; or a link that the controller does not have.
    OutOfRange,
    /// The list is full, [`MAX_CHANNEL_TYPES`].
    ListFull,
    /// The axis, the link or the element does not exist, or the parameter is not per axis.
    NoSuchEntry,
    /// The parameter changes ports or memory: unplug the module first.
    WhilePluggedIn,
    /// `STALE LIMITED` and `INTEGRAL` need the packet counters, which are switched off.
    NeedsCounters,
    /// Rounding the values to `f32` loses too much precision.
    Imprecise {
        /// Possible error, %.
        percent: u16,
    },
}

impl ParameterError {
    /// Creates [`Imprecise`](Self::Imprecise) with this error, in percent.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a cast saturates")]
    #[must_use]
    pub fn imprecise(percent: f32) -> Self {
        Self::Imprecise { percent: (percent + 0.999) as u16 }
    }
}

impl ParameterType {
    pub(crate) fn admit(&self, value: Value) -> Result<(), ParameterError> {
        let is_inside = match (self, value) {
            (Self::Real { min, max }, Value::Real(value)) => (*min..=*max).contains(&value),
            (Self::Count { min, max }, Value::Count(value)) => (*min..=*max).contains(&value),
            (Self::Integer { min, max }, Value::Integer(value)) => (*min..=*max).contains(&value),
            (Self::Choice(names), Value::Choice(index)) => usize::from(index) < names.len(),
            (Self::Flag, Value::Flag(_)) | (Self::Types, Value::Type(_)) => true,
            _ => return Err(ParameterError::WrongKind),
        };
        if is_inside { Ok(()) } else { Err(ParameterError::OutOfRange) }
    }
}

impl Value {
    /// Compares the bits.
    pub(crate) fn is_same(self, other: Self) -> bool {
        match (self, other) {
            (Self::Real(one), Self::Real(other)) => one.to_bits() == other.to_bits(),
            _ => self == other,
        }
    }
}
