//! A controller that runs elsewhere: on an emulated board, or on a real one.

use std::error::Error;

use dimsart_core::{Tick, Word};

use super::SimulatedDimsart;

/// What a remote controller ended with.
pub type RemoteError = Box<dyn Error + Send + Sync>;

/// A controller outside of this process, in lockstep with the rig.
pub trait RemoteController: core::fmt::Debug + Send {
    /// Gives a packet that came in over `link` to the next tick.
    fn receive(&mut self, link: usize, bytes: &[u8]);

    /// One tick: the words that are measured there, those that are commanded back. `copy` holds its Data Base afterwards.
    ///
    /// # Errors
    /// [`RemoteError`] when it does not answer as it should; it is of no further use then.
    fn tick(
        &mut self,
        measured: &[Word],
        commanded: &mut [Word],
        copy: &mut SimulatedDimsart,
    ) -> Result<Tick, RemoteError>;

    /// The packets that the last tick left for `link`.
    fn outgoing(&self, link: usize) -> Box<dyn Iterator<Item = &[u8]> + '_>;

    /// Whether it authenticates its links by itself.
    fn is_authenticated(&self) -> bool;

    /// What came back on its command line in the last tick.
    fn command_bytes(&self) -> Box<dyn Iterator<Item = &[u8]> + '_>;

    /// Puts bytes on its command line, for the next tick.
    fn send_command_bytes(&mut self, bytes: &[u8]);

    /// Instructions from reading the sensors to commanding the actuators in the last tick, where that is known.
    fn instructions(&self) -> Option<u32>;

    /// Instructions from the beginning of the tick before the last one to that of the last one, where that is known.
    fn instructions_of_all(&self) -> Option<u32>;
}
