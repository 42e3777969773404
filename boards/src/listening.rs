//! Which channel is listened to on each link.

use core::sync::atomic::{AtomicU16, Ordering::Relaxed};

use dimsart_core::limits::MAX_LINKS;

/// The channel that is listened to on each link: the tick says so, the links read it.
pub struct Listening([AtomicU16; MAX_LINKS]);

impl Default for Listening {
    fn default() -> Self {
        Self::new()
    }
}

impl Listening {
    /// Channel 0 on every link.
    #[must_use]
    pub const fn new() -> Self {
        Self([const { AtomicU16::new(0) }; MAX_LINKS])
    }

    /// Says which channel is listened to on a link.
    pub fn set(&self, link: usize, channel: u16) {
        if let Some(place) = self.0.get(link) {
            place.store(channel, Relaxed);
        }
    }

    /// The channel that is listened to on a link.
    pub fn get(&self, link: usize) -> u16 {
        self.0.get(link).map_or(0, |channel| channel.load(Relaxed))
    }
}
