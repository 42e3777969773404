//! A controller on an emulated or real board.

use std::error::Error;

use dimsart_core::{TickResult, Word};

use super::SimulatedDimsart;

/// Error of a remote controller.
pub type RemoteError = Box<dyn Error + Send + Sync>;

/// A controller outside this process, in lockstep with the rig.
pub trait RemoteController: core::fmt::Debug + Send {
    /// Adds a packet received over `link` to the next tick.
    fn receive(&mut self, link: usize, bytes: &[u8]);

    /// Runs one tick: sends the measured words and returns the commanded words; `copy` then mirrors its Data Base.
    ///
    /// # Errors
    /// [`RemoteError`] on an invalid answer; the controller is then unusable.
    fn tick(
        &mut self,
        measured: &[Word],
        commanded: &mut [Word],
        copy: &mut SimulatedDimsart,
    ) -> Result<TickResult, RemoteError>;

    /// Returns the packets sent over `link` in the last tick.
    fn outgoing(&self, link: usize) -> Box<dyn Iterator<Item = &[u8]> + '_>;

    /// Whether it authenticates its links itself.
    fn is_authenticated(&self) -> bool;

    /// Returns the output of its command line in the last tick.
    fn command_bytes(&self) -> Box<dyn Iterator<Item = &[u8]> + '_>;

    /// Sends bytes to its command line for the next tick.
    fn send_command_bytes(&mut self, bytes: &[u8]);

    /// Returns the instructions from reading sensors to commanding actuators in the last tick, if known.
    fn instructions(&self) -> Option<u32>;

    /// Returns the instructions between the starts of the last two ticks, if known.
    fn instructions_of_all(&self) -> Option<u32>;
}
