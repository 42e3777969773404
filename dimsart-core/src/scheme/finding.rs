//! Findings of the matching check.

use crate::module::{Difference, ModuleRef};
use crate::signal::{TypeRef, UnitRelation};

/// Who reads or writes a signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Party {
    /// The frame: the device and what it is commanded by.
    Frame,
    /// A module.
    Module(ModuleRef),
}

/// A finding of the matching check.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Finding {
    /// A fault: somebody reads a signal that nobody writes.
    NoProvider {
        /// The signal.
        signal: TypeRef,
        /// Who reads it.
        reader: Party,
    },
    /// A fault: two parties write the same signal.
    TwoProviders {
        /// The signal.
        signal: TypeRef,
        /// Who writes it first in a tick.
        first: Party,
        /// Who overwrites it.
        second: Party,
    },
    /// A fault: a port is bound to a signal of another unit, format or shape.
    Mismatch {
        /// The module.
        module: ModuleRef,
        /// The port's number.
        port: u8,
        /// The signal it is bound to.
        signal: TypeRef,
        /// What is wrong.
        difference: Difference,
    },
    /// A signal is read before it is written in the tick, so the reader sees the value of the tick
    /// before. A fault unless the reader or the writer declared it.
    Delay {
        /// The signal.
        signal: TypeRef,
        /// Who writes it.
        writer: Party,
        /// Who reads it too early.
        reader: Party,
        /// Whether it is meant to be so.
        is_declared: bool,
    },
    /// A fault: the units of two signals, or their formats and shapes, are not as the module's ports are
    /// [tied](crate::Declare::tie).
    UnitsDiffer {
        /// The module.
        module: ModuleRef,
        /// Number of the port whose unit follows from the other's.
        port: u8,
        /// The signal it is bound to.
        signal: TypeRef,
        /// Number of the other port.
        other_port: u8,
        /// The signal that one is bound to.
        other_signal: TypeRef,
        /// What they should be to each other.
        relation: UnitRelation,
    },
    /// A fault: two modules send over the same link, or listen to it.
    LinkTaken {
        /// The link.
        link: u8,
        /// Who comes first in a tick.
        first: ModuleRef,
        /// Who takes its packets away, or overwrites them.
        second: ModuleRef,
    },
    /// A module that does not run in every tick writes a signal: it is held meanwhile, and up to `every_ticks - 1` ticks
    /// old where it is read.
    Held {
        /// The signal.
        signal: TypeRef,
        /// Who writes it.
        writer: ModuleRef,
        /// In one of so many ticks.
        every_ticks: u8,
    },
    /// A fault: a module computes with a signal's value of the tick before, and reads it after it was written.
    NotDelayed {
        /// The signal.
        signal: TypeRef,
        /// The module that writes it.
        writer: ModuleRef,
        /// The module that reads it too late.
        reader: ModuleRef,
    },
    /// A fault: a late stage waits for what a module makes of its early stage, and that module rests in some of its
    /// ticks.
    LateStageWaits {
        /// The module with the late stage.
        reader: ModuleRef,
        /// The module it waits for.
        writer: ModuleRef,
        /// `EVERY_TICKS` of the module it waits for.
        every_ticks: u8,
    },
}

impl Finding {
    /// Whether a scheme with this finding must not run.
    #[must_use]
    pub fn is_fault(&self) -> bool {
        !matches!(self, Self::Delay { is_declared: true, .. } | Self::Held { .. })
    }
}
