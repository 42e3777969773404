//! The right to move the device: one client's at a time, and for a moment only.
//!
//! ```text
//! nobody ──take──▶ held by one client ──renew, in time──▶ held on
//!   ▲                │ gives it back, or its time is over: from that very tick on the device gets its safe input
//!   └────────────────┘
//! ```
//! Nothing but a renewal by its holder prolongs it: neither questions nor telemetry do. What its holder asks of the kept
//! schemes is a renewal, too, until it is done.

use serde::{Deserialize, Serialize};

use super::response::Refusal;

/// The client that nobody is.
pub const NOBODY: u8 = 0;

/// What a client wants of the lease. Each is answered by how it stands then.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum LeaseAction {
    /// Nothing but to know.
    Look,
    /// Takes it from nobody. For its holder a renewal.
    Take,
    /// Prolongs it. Refused when its time was over: motion begins by a `Take` alone.
    Renew,
    /// Gives it back. Nothing happens when nobody holds it.
    GiveBack,
}

/// How the lease stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LeaseStatus {
    /// The client that holds it, [`NOBODY`] when it is free.
    pub holder: u8,
    /// Ticks that it lasts unless it is renewed.
    pub ticks_left: u32,
}

/// Who may move the device; counts its own time in ticks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Lease {
    status: LeaseStatus,
    length_ticks: u32,
}

impl Lease {
    /// A lease that nobody holds. One of 0 ticks is needed by nobody and given to nobody.
    #[must_use]
    pub const fn new(length_ticks: u32) -> Self {
        Self { status: LeaseStatus { holder: NOBODY, ticks_left: 0 }, length_ticks }
    }

    /// How it stands.
    #[must_use]
    pub fn status(&self) -> LeaseStatus {
        self.status
    }

    /// Does what a client wants.
    ///
    /// # Errors
    /// [`Refusal::Lease`] with the holder when it is another client, or [`NOBODY`] when there is nothing to renew;
    /// [`Refusal::NotThere`] when the device has no lease, or the client has no number. Nothing has changed.
    pub fn carry_out(&mut self, client: u8, action: LeaseAction) -> Result<LeaseStatus, Refusal> {
        if self.length_ticks == 0 || client == NOBODY && action != LeaseAction::Look {
            return Err(Refusal::NotThere);
        }
        let holder = self.status.holder;
        match action {
            LeaseAction::Look => {}
            LeaseAction::Renew if holder != client => return Err(Refusal::Lease { holder }),
            _ => {
                self.admit(client)?;
                let is_held = action != LeaseAction::GiveBack;
                self.status = LeaseStatus {
                    holder: if is_held { client } else { NOBODY },
                    ticks_left: if is_held { self.length_ticks } else { 0 },
                };
            }
        }
        Ok(self.status)
    }

    /// Whether a client may change something.
    ///
    /// # Errors
    /// [`Refusal::Lease`] with the holder, when another client holds it.
    pub fn admit(&self, client: u8) -> Result<(), Refusal> {
        match self.status.holder {
            NOBODY => Ok(()),
            holder if holder == client => Ok(()),
            holder => Err(Refusal::Lease { holder }),
        }
    }

    /// Takes it from whoever holds it.
    pub fn end(&mut self) {
        self.status = LeaseStatus::default();
    }

    /// Whether the device may be moved now.
    #[must_use]
    pub fn is_armed(&self) -> bool {
        self.length_ticks == 0 || self.status.holder != NOBODY
    }

    /// Counts a tick; true when the device may be moved in it.
    pub fn tick(&mut self) -> bool {
        let Some(left) = self.status.ticks_left.checked_sub(1) else {
            self.status.holder = NOBODY;
            return self.is_armed();
        };
        self.status.ticks_left = left;
        true
    }
}
