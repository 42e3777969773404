//! Findings of the matching check.

use crate::module::{ModuleRef, TypeMismatch};
use crate::signal::{TypeRef, UnitRelation};

/// Reader or writer of a signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Endpoint {
    /// The frame: the device's measurements and commands.
    Frame,
    /// A module.
    Module(ModuleRef),
}

/// A finding of the matching check.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Finding {
    /// Fault: a signal is read, but has no writer.
    NoWriter {
        /// The signal.
        signal: TypeRef,
        /// Its reader.
        reader: Endpoint,
    },
    /// Fault: a signal has two writers.
    MultipleWriters {
        /// The signal.
        signal: TypeRef,
        /// First writer in a tick.
        first: Endpoint,
        /// Second writer, which overwrites the signal.
        second: Endpoint,
    },
    /// Fault: a port is bound to a signal of wrong unit, format or shape.
    Mismatch {
        /// The module.
        module: ModuleRef,
        /// The port's number.
        port: u8,
        /// The bound signal.
        signal: TypeRef,
        /// The difference.
        mismatch: TypeMismatch,
    },
    /// A signal is read before it is written in the tick, so the reader gets the value of the previous tick.
    /// A fault unless the reader or the writer declares the delay.
    Delay {
        /// The signal.
        signal: TypeRef,
        /// Its writer.
        writer: Endpoint,
        /// The reader.
        reader: Endpoint,
        /// Whether the delay is declared.
        is_declared: bool,
    },
    /// Fault: the units of two signals, or their formats and shapes, violate a [tie](crate::Declarations::constrain_unit) of
    /// the module's ports.
    UnitsDiffer {
        /// The module.
        module: ModuleRef,
        /// Port whose unit follows from the other port's unit.
        port: u8,
        /// The bound signal.
        signal: TypeRef,
        /// The other port.
        other_port: u8,
        /// The signal bound to the other port.
        other_signal: TypeRef,
        /// The required relation.
        relation: UnitRelation,
    },
    /// Fault: two modules use the same end of a link.
    DuplicateLinkEnd {
        /// The link.
        link: u8,
        /// First module in a tick.
        first: ModuleRef,
        /// Second module, which takes or overwrites the first one's packets.
        second: ModuleRef,
    },
    /// A module that does not run in every tick writes a signal: its readers get values up to
    /// `every_ticks - 1` ticks old.
    SlowWriter {
        /// The signal.
        signal: TypeRef,
        /// Its writer.
        writer: ModuleRef,
        /// Period of the writer in ticks.
        every_ticks: u8,
    },
    /// Fault: a module needs a signal's value of the previous tick, but reads it after it was written.
    MissingDelay {
        /// The signal.
        signal: TypeRef,
        /// The writer.
        writer: ModuleRef,
        /// The reader.
        reader: ModuleRef,
    },
    /// Fault: a late stage depends on a module that follows its early stage and does not run whenever the
    /// late stage does.
    LateStageRate {
        /// The module with the late stage.
        reader: ModuleRef,
        /// The module that it waits for.
        writer: ModuleRef,
        /// `EVERY_TICKS` of that module.
        every_ticks: u8,
    },
}

impl Finding {
    /// Returns whether a scheme with this finding must not run.
    #[must_use]
    pub fn is_fault(&self) -> bool {
        !matches!(self, Self::Delay { is_declared: true, .. } | Self::SlowWriter { .. })
    }
}
