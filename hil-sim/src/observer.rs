//! Observers: each watches a rig tick by tick, and adds its figures to the run's [`Outcome`].
//!
//! An observer never changes the rig. A new one is a file here, a field of [`Outcome`], and a line where experiments are
//! made: [`response`](crate::response).

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

/// Watches a rig.
pub trait Observer: core::fmt::Debug {
    /// Starts what takes as long as the run.
    fn begin(&mut self) {}

    /// Observes a tick: what controllers have measured and commanded, before the world moves on. Breaks where the run has
    /// to end.
    fn observe(&mut self, rig: &Rig) -> ControlFlow<()>;

    /// Adds the figures to those of a run that has ended, early or not.
    fn report(&mut self, rig: &Rig, outcome: &mut Outcome);
}
