//! The channel received on each link.

use core::sync::atomic::{AtomicU16, Ordering::Relaxed};

use dimsart_core::limits::MAX_LINKS;

/// The channel received on each link: set by the tick, read by the links.
pub struct ReceiveChannels([AtomicU16; MAX_LINKS]);

impl Default for ReceiveChannels {
    fn default() -> Self {
        Self::new()
    }
}

impl ReceiveChannels {
    /// Creates the initial state: channel 0 on every link.
    #[must_use]
    pub const fn new() -> Self {
        Self([const { AtomicU16::new(0) }; MAX_LINKS])
    }

    /// Sets the channel received on a link.
    pub fn set(&self, link: usize, channel: u16) {
        if let Some(place) = self.0.get(link) {
            place.store(channel, Relaxed);
        }
    }

    /// Returns the channel received on a link.
    pub fn get(&self, link: usize) -> u16 {
        self.0.get(link).map_or(0, |channel| channel.load(Relaxed))
    }
}
