//! Cycles of a controller's tick at rest without packets, and their bound.

use std::collections::BTreeSet;

use ::cycles::timing::Timing;
use dimsart_core::Dimsart;
use dimsart_core::limits::MAX_LINKS;
use dimsart_link::saved_scheme;

use super::controller::Lengths;
use super::worst::Worst;
use super::{Controller, CyclesError, Firmware};

/// Ticks until one-time work is done.
const TICKS: usize = 30;

/// Cycles of a tick.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SteadyTick {
    /// Last of several ticks with all measurements 0.
    pub emulated: u64,
    /// Upper bound for all inputs.
    pub bound: u64,
    /// Addresses of all instructions that a tick can execute.
    pub visited: BTreeSet<u32>,
}

impl SteadyTick {
    /// Computes the cycles of a controller's scheme in an image.
    ///
    /// # Errors
    /// [`CyclesError`].
    pub fn of(firmware: &Firmware, timing: Timing, dimsart: &mut Dimsart) -> Result<Self, CyclesError> {
        let mut controller = Controller::new(firmware, timing, dimsart.engine().device().dof())?;
        let scheme = saved_scheme::save(dimsart.engine_mut()).map_err(|_| CyclesError::SchemeTooLong)?;
        controller.load(&scheme)?;
        let channels = channels(dimsart).map(Some);
        let worst = Worst::of_ticks(firmware, &timing, &controller, channels, Lengths::PerLength)?;
        let mut emulated = 0;
        for _ in 0..TICKS {
            emulated = controller.tick(&[])?.cycles;
            for link in 0..MAX_LINKS {
                controller.take_packet(link)?;
            }
        }
        Ok(Self { emulated, bound: worst.tick.cycles, visited: worst.visited })
    }
}

/// Channels on which a controller listens.
pub(super) fn channels(dimsart: &Dimsart) -> [u16; MAX_LINKS] {
    let mut channels = [0; MAX_LINKS];
    for (link, channel) in channels.iter_mut().enumerate() {
        *channel = dimsart.receive_channel(link);
    }
    channels
}
