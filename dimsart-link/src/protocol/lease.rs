//! The lease: the right to move the device, held by one client for a short time.
//!
//! ```text
//! free   ──take──▶ held by one client ──renew, in time──▶ held
//!   ▲                │ released or expired: from the same tick on the device goes to its safe value
//!   └────────────────┘
//! ```
//! Only a renewal by the holder extends the lease; requests and telemetry do not. The holder's requests to
//! the scheme storage also extend the lease.

use serde::{Deserialize, Serialize};

use super::client::NO_CLIENT;
use super::motor::{MotorAction, MotorRefusal};
use super::refusal::Refusal;

/// Requests about the lease. The response is the resulting [`LeaseStatus`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum LeaseAction {
    /// Reads the state.
    Read,
    /// Takes a free lease. Renews it for its holder.
    Take,
    /// Renews the lease. Refused after it expired: motion starts with a `Take` only.
    Renew,
    /// Releases the lease. No effect on a free lease.
    Release,
}

/// State of the lease.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LeaseStatus {
    /// The client that holds it, [`NO_CLIENT`] when it is free.
    pub holder: u8,
    /// Ticks until it expires.
    pub ticks_left: u32,
}

/// The lease; counts its time in ticks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Lease {
    status: LeaseStatus,
    length_ticks: u32,
}

impl Lease {
    /// Creates a free lease. With 0 ticks, motion needs no lease and no client can take it.
    #[must_use]
    pub const fn new(length_ticks: u32) -> Self {
        Self { status: LeaseStatus { holder: NO_CLIENT, ticks_left: 0 }, length_ticks }
    }

    /// Returns the state.
    #[must_use]
    pub fn status(&self) -> LeaseStatus {
        self.status
    }

    /// Handles a client's request.
    ///
    /// # Errors
    /// [`Refusal::Lease`] with the holder if another client holds it, or [`NO_CLIENT`] if there is no lease
    /// to renew; [`Refusal::NotFound`] if the device has no lease, or the client has no number. The lease is
    /// unchanged.
    pub fn handle(&mut self, client: u8, action: LeaseAction) -> Result<LeaseStatus, Refusal> {
        if self.length_ticks == 0 || client == NO_CLIENT && action != LeaseAction::Read {
            return Err(Refusal::NotFound);
        }
        let holder = self.status.holder;
        match action {
            LeaseAction::Read => {}
            LeaseAction::Renew if holder != client => return Err(Refusal::Lease { holder }),
            _ => {
                self.check(client)?;
                let is_held = action != LeaseAction::Release;
                self.status = LeaseStatus {
                    holder: if is_held { client } else { NO_CLIENT },
                    ticks_left: if is_held { self.length_ticks } else { 0 },
                };
            }
        }
        Ok(self.status)
    }

    /// Checks whether a client may change something.
    ///
    /// # Errors
    /// [`Refusal::Lease`] with the holder, if another client holds the lease.
    pub fn check(&self, client: u8) -> Result<(), Refusal> {
        match self.status.holder {
            NO_CLIENT => Ok(()),
            holder if holder == client => Ok(()),
            holder => Err(Refusal::Lease { holder }),
        }
    }

    /// Ends the lease.
    pub fn end(&mut self) {
        self.status = LeaseStatus::default();
    }

    /// Returns whether motion is permitted.
    #[must_use]
    pub fn is_armed(&self) -> bool {
        self.length_ticks == 0 || self.status.holder != NO_CLIENT
    }

    /// Counts a tick; returns whether motion is permitted in it.
    pub fn tick(&mut self) -> bool {
        let Some(left) = self.status.ticks_left.checked_sub(1) else {
            self.status.holder = NO_CLIENT;
            return self.is_armed();
        };
        self.status.ticks_left = left;
        true
    }

    /// Checks whether a client may perform a motor action, given the lease and the scheme.
    pub(super) fn admit_motor(
        &self,
        action: MotorAction,
        client: u8,
        is_running: bool,
    ) -> Result<(), Refusal> {
        let holder = self.status().holder;
        match action {
            MotorAction::Store { .. } | MotorAction::Delete if self.is_armed() => {
                Err(Refusal::Motor(MotorRefusal::InUse))
            }
            MotorAction::Identify { .. } if holder != client || holder == NO_CLIENT => {
                Err(Refusal::Lease { holder })
            }
            MotorAction::Identify { .. } if !is_running => Err(Refusal::Motor(MotorRefusal::NotRunning)),
            MotorAction::Identify { current_a } if !(current_a > 0.0 && current_a.is_finite()) => {
                Err(Refusal::Motor(MotorRefusal::Current))
            }
            MotorAction::Read
            | MotorAction::PutWord { .. }
            | MotorAction::Store { .. }
            | MotorAction::Delete
            | MotorAction::Identify { .. }
            | MotorAction::ReadIdentification => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_kept_at_rest_and_identified_under_the_lease_alone() {
        let mut lease = Lease::new(200);
        let keep = MotorAction::Store { layout: 1, count: 3, checksum: 0 };
        let identify = MotorAction::Identify { current_a: 2.0 };
        assert_eq!(lease.admit_motor(keep, 7, true), Ok(()));
        assert_eq!(lease.admit_motor(identify, 7, true), Err(Refusal::Lease { holder: NO_CLIENT }));
        assert_eq!(lease.admit_motor(identify, NO_CLIENT, true), Err(Refusal::Lease { holder: NO_CLIENT }));
        lease.handle(7, LeaseAction::Take).unwrap();
        for action in [keep, MotorAction::Delete] {
            assert_eq!(lease.admit_motor(action, 7, true), Err(Refusal::Motor(MotorRefusal::InUse)));
        }
        assert_eq!(lease.admit_motor(identify, 7, true), Ok(()));
        assert_eq!(lease.admit_motor(identify, 8, true), Err(Refusal::Lease { holder: 7 }));
        assert_eq!(lease.admit_motor(identify, 7, false), Err(Refusal::Motor(MotorRefusal::NotRunning)));
        for current_a in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            let identify = MotorAction::Identify { current_a };
            assert_eq!(lease.admit_motor(identify, 7, true), Err(Refusal::Motor(MotorRefusal::Current)));
        }
        assert_eq!(lease.admit_motor(MotorAction::Read, 8, true), Ok(()));
    }
}
