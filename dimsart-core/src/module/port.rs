//! Ports: the signals a module reads and writes, declared when it is plugged in.

use heapless::Vec;

use crate::limits::MAX_PORTS;
use crate::signal::{DataType, TypeRef, UnitTie};

/// What a port is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Direction {
    /// Reads a signal.
    Read,
    /// Writes a signal.
    Write,
    /// Holds so many words of the module's own memory.
    Memory(usize),
}

/// When in the tick a port is used.
///
/// A module that sits on both sides of a controller, such as a wave transformer, has two stages: the
/// early one runs at its place in the plug-in order, the late one as soon as everything it reads has
/// been written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Stage {
    /// In [`Module::compute`](crate::Module::compute).
    Early,
    /// In [`Module::compute_late`](crate::Module::compute_late).
    Late,
}

/// How a signal differs from what a port expects.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Difference {
    /// Another physical unit.
    Unit,
    /// Another number format.
    Format,
    /// Another shape.
    Shape,
    /// Cartesian coordinates where others of the module's ports have those of joints, or the other way round.
    Coordinates,
}

/// The sending or the receiving end of a link. Only one module can have it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct LinkEnd {
    pub(crate) link: u8,
    pub(crate) channel: u16,
    pub(crate) is_sending: bool,
}

impl LinkEnd {
    /// Whether it is the same end of the same link, whatever the channel.
    pub(crate) fn is_same(self, other: Self) -> bool {
        (self.link, self.is_sending) == (other.link, other.is_sending)
    }

    /// Whether it is the receiving end of a link.
    pub(crate) fn listens_to(self, link: usize) -> bool {
        !self.is_sending && usize::from(self.link) == link
    }
}

/// A port as its module declares it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PortSpec {
    /// Name, unique in the module; `PORT_<name>` is the command that binds it to another type.
    pub name: &'static str,
    /// Type it is bound to unless a command says otherwise; none for memory.
    pub data_type: Option<(&'static DataType, TypeRef)>,
    /// Reads, writes or holds memory.
    pub direction: Direction,
    /// Stage that uses it.
    pub stage: Stage,
    /// Declares that data one tick old is what this port wants (read) or gives (write).
    pub is_delayed: bool,
    /// How the data type differs from what the module's handle can take; none if it fits.
    pub mismatch: Option<Difference>,
    /// Whether it can be bound to a signal of another unit.
    pub takes_any_unit: bool,
    /// Whether it can be bound to a signal of another unit, format or shape.
    pub takes_any_type: bool,
    /// What its unit follows from, if that of another port.
    pub tie: Option<UnitTie>,
}

impl PortSpec {
    /// Whether it takes a coordinate, of a joint or a Cartesian one.
    pub(crate) fn takes_coordinate(&self) -> bool {
        let takes_any = self.takes_any_unit || self.takes_any_type;
        !takes_any && self.data_type.is_some_and(|(expected, _)| expected.unit.cartesian().is_some())
    }

    /// How a signal of type `found` differs from what the port expects, if it does.
    pub(crate) fn difference(&self, found: &DataType) -> Option<Difference> {
        let (expected, _) = self.data_type?;
        if self.takes_any_type {
            None
        } else if !self.takes_any_unit && !expected.unit.takes(found.unit) {
            Some(Difference::Unit)
        } else if expected.format != found.format {
            Some(Difference::Format)
        } else if expected.shape != found.shape {
            Some(Difference::Shape)
        } else {
            self.mismatch
        }
    }
}

/// Ports as a module declares them.
pub(crate) type PortSpecs = Vec<PortSpec, MAX_PORTS>;
