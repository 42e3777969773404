//! Reasons why the scheme does not command the device.

use serde::{Deserialize, Serialize};

use dimsart_core::{Finding, SafetyReason, TickResult};

/// The reason why the scheme does not command the device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum NotCommandedReason {
    /// The scheme does not match; contains the first fault.
    Mismatch(Finding),
    /// The outcome of the last tick, other than [`TickResult::Ran`].
    Tick(TickResult),
}

impl NotCommandedReason {
    /// Returns the reason's number and texts.
    #[must_use]
    pub const fn reason(&self) -> SafetyReason {
        match self {
            Self::Mismatch(_) => SafetyReason::Stopped,
            Self::Tick(tick) => tick.reason(),
        }
    }
}

/// The first tick that was refused, or in which a link was lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FirstFault {
    /// Number of the tick, from 1.
    pub tick: u64,
    /// The reason.
    pub reason: NotCommandedReason,
}
