//! Ports: the signals that a module reads and writes, declared when it is plugged in.

use heapless::Vec;

use crate::limits::MAX_PORTS;
use crate::signal::{DataType, TypeRef, UnitConstraint};

/// Direction of a port.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Direction {
    /// Reads a signal.
    Read,
    /// Writes a signal.
    Write,
    /// Words of the module's own memory.
    Memory(usize),
}

/// Stage of the tick in which a port is used.
///
/// A module on both sides of a controller, such as a wave transformer, has two stages: the early stage runs
/// in plug-in order, the late stage as soon as all its inputs have been written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Stage {
    /// In [`Module::compute`](crate::Module::compute).
    Early,
    /// In [`Module::compute_late`](crate::Module::compute_late).
    Late,
}

/// Difference between a signal and the type that a port expects.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum TypeMismatch {
    /// Different physical unit.
    Unit,
    /// Different number format.
    Format,
    /// Different shape.
    Shape,
    /// Cartesian coordinates, although other ports of the module have joint coordinates, or vice versa.
    Coordinates,
}

/// Sending or receiving end of a link, for one module only.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct LinkEnd {
    pub(crate) link: u8,
    pub(crate) channel: u16,
    pub(crate) is_sending: bool,
}

impl LinkEnd {
    /// Returns whether it is the same end of the same link, on any channel.
    pub(crate) fn is_same(self, other: Self) -> bool {
        (self.link, self.is_sending) == (other.link, other.is_sending)
    }

    /// Returns whether it is the receiving end of a link.
    pub(crate) fn receives_from(self, link: usize) -> bool {
        !self.is_sending && usize::from(self.link) == link
    }
}

/// A port as its module declares it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PortSpec {
    /// Name, unique in the module; the command `PORT_<name>` binds it to another signal.
    pub name: &'static str,
    /// Default signal and its type; none for memory.
    pub data_type: Option<(&'static DataType, TypeRef)>,
    /// Reads, writes or holds memory.
    pub direction: Direction,
    /// Stage that uses it.
    pub stage: Stage,
    /// Declares that the data are one tick old.
    pub is_delayed: bool,
    /// Difference between the data type and the type of the module's handle; none if they match.
    pub mismatch: Option<TypeMismatch>,
    /// Whether it accepts a signal of another unit.
    pub accepts_any_unit: bool,
    /// Whether it accepts a signal of another unit, format or shape.
    pub accepts_any_type: bool,
    /// Tie to the unit of another port.
    pub unit_constraint: Option<UnitConstraint>,
}

impl PortSpec {
    /// Returns whether it accepts coordinates (joint or Cartesian).
    pub(crate) fn takes_coordinate(&self) -> bool {
        let takes_any = self.accepts_any_unit || self.accepts_any_type;
        !takes_any && self.data_type.is_some_and(|(expected, _)| expected.unit.cartesian().is_some())
    }

    /// Returns the difference between type `found` and the type that the port expects.
    pub(crate) fn difference(&self, found: &DataType) -> Option<TypeMismatch> {
        let (expected, _) = self.data_type?;
        if self.accepts_any_type {
            None
        } else if !self.accepts_any_unit && !expected.unit.accepts(found.unit) {
            Some(TypeMismatch::Unit)
        } else if expected.format != found.format {
            Some(TypeMismatch::Format)
        } else if expected.shape != found.shape {
            Some(TypeMismatch::Shape)
        } else {
            self.mismatch
        }
    }
}

/// The ports that a module declares.
pub(crate) type PortSpecs = Vec<PortSpec, MAX_PORTS>;
