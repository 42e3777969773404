//! What a tick of a controller takes while nothing moves and nothing comes in, and at most.

use std::collections::BTreeSet;

use ::cycles::timing::Timing;
use dimsart_core::Dimsart;
use dimsart_core::limits::MAX_LINKS;
use dimsart_link::saved_scheme;

use super::controller::Lengths;
use super::worst::Worst;
use super::{Controller, CyclesError, Firmware};

/// Ticks until what happens once has happened.
const TICKS: usize = 30;

/// Cycles of a tick.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Steady {
    /// Of the last of some ticks with every measurement 0.
    pub emulated: u64,
    /// That no tick exceeds, whatever is measured and comes in.
    pub bound: u64,
    /// Addresses of all instructions that a tick can execute.
    pub visited: BTreeSet<u32>,
}

impl Steady {
    /// Of the scheme that a controller here has, in an image.
    ///
    /// # Errors
    /// [`CyclesError`].
    pub fn of(firmware: &Firmware, timing: Timing, dimsart: &mut Dimsart) -> Result<Self, CyclesError> {
        let mut controller = Controller::new(firmware, timing, dimsart.engine().device().dof())?;
        let scheme = saved_scheme::save(dimsart.engine_mut()).map_err(|_| CyclesError::SchemeTooLong)?;
        controller.load(&scheme)?;
        let channels = channels(dimsart).map(Some);
        let worst = Worst::of_ticks(firmware, &timing, &controller, channels, Lengths::Each)?;
        let mut emulated = 0;
        for _ in 0..TICKS {
            emulated = controller.tick(&[])?.cycles;
            for link in 0..MAX_LINKS {
                controller.take(link)?;
            }
        }
        Ok(Self { emulated, bound: worst.tick.cycles, visited: worst.visited })
    }
}

/// The channels that a controller listens to.
pub(super) fn channels(dimsart: &Dimsart) -> [u16; MAX_LINKS] {
    let mut channels = [0; MAX_LINKS];
    for (link, channel) in channels.iter_mut().enumerate() {
        *channel = dimsart.listening_channel(link);
    }
    channels
}
