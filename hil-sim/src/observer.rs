//! Observers: each reads a rig tick by tick and adds its figures to the run's [`Outcome`].
//!
//! Observers never change the rig. To add an observer, create a file here, a field of [`Outcome`], and a line in
//! [`response`](crate::response).

pub mod channel_energy;
pub mod creep;
pub mod following;
pub mod growth;
pub mod limit_cycles;
pub(crate) mod peer;
pub mod perceived;
pub mod port_energy;
pub mod reception;
pub mod round_trip;
pub mod saturation;
mod settled_contact;
mod step_response;
pub mod watch;

use core::ops::ControlFlow;

use crate::outcome::Outcome;
use crate::rig::Rig;

/// Observes a rig.
pub trait Observer: core::fmt::Debug {
    /// Starts work in parallel to the run.
    fn begin(&mut self) {}

    /// Observes the measurements and commands of a tick, before the plants advance. Breaks to end the run.
    fn observe(&mut self, rig: &Rig) -> ControlFlow<()>;

    /// Adds its figures to the outcome, also after an early end.
    fn report(&mut self, rig: &Rig, outcome: &mut Outcome);
}
