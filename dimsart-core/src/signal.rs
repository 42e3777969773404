//! Signals: words, formats, units and data types.

pub(crate) mod data_type;
pub(crate) mod summary;
pub mod types;
pub(crate) mod unit;
pub(crate) mod unit_constraint;
pub(crate) mod word;
pub mod words;

pub(crate) use data_type::{DataType, Shape, TypeRef};
pub(crate) use summary::Summary;
pub(crate) use unit::{AxisKind, Unit};
pub(crate) use unit_constraint::{UnitConstraint, UnitRelation};
pub(crate) use word::{Format, Scalar, Word};
pub(crate) use words::Words;
