//! What the caller of the tick knows of a controller and the controller itself does not.

use serde::{Deserialize, Serialize};

use crate::dimsart::Tick;
use crate::frame::FrameError;
use crate::matching::Finding;
use crate::timing::Timing;

/// Why the device is not commanded by the scheme.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Blocked {
    /// The scheme does not match; this is its first fault.
    Fault(Finding),
    /// The scheme matches, or is empty, and waits for `MATCHING_CHECK`.
    Stopped,
    /// The scheme runs and the last measurement was refused.
    Measurement(FrameError),
    /// The scheme runs and its last command to the device was refused.
    Command(FrameError),
    /// The scheme runs and nothing has come over a link for too long, until a reset.
    LinkLost {
        /// The link.
        link: u8,
    },
}

/// The first tick that was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FirstFault {
    /// Number of the tick, from 1.
    pub tick: u64,
    /// Why.
    pub reason: Blocked,
}

/// The image's name and what its ticks came to; kept by whoever calls
/// [`Dimsart::tick`](crate::Dimsart::tick).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DeviceInfo {
    pub(super) image: &'static str,
    pub(super) ticks: u64,
    pub(super) refused: Option<Blocked>,
    pub(super) first_fault: Option<FirstFault>,
    pub(super) timing: Option<Timing>,
}

impl DeviceInfo {
    /// An image before its first tick. `image` tells it from every other one, for example by board,
    /// version and commit; a host may remember descriptions by it. At most 100 bytes.
    #[must_use]
    pub const fn new(image: &'static str) -> Self {
        Self { image, ticks: 0, refused: None, first_fault: None, timing: None }
    }

    /// Takes note of how well the ticks keep their time, where there is a clock to tell.
    pub fn set_timing(&mut self, timing: Timing) {
        self.timing = Some(timing);
    }

    /// Counts a tick.
    pub fn count(&mut self, tick: Tick) {
        self.ticks = self.ticks.saturating_add(1);
        self.refused = match tick {
            Tick::Ran | Tick::Idle => None,
            Tick::MeasurementRefused(error) => Some(Blocked::Measurement(error)),
            Tick::CommandRefused(error) => Some(Blocked::Command(error)),
            Tick::LinkLost { link } => Some(Blocked::LinkLost { link }),
        };
        if self.first_fault.is_none() {
            self.first_fault = self.refused.map(|reason| FirstFault { tick: self.ticks, reason });
        }
    }
}
