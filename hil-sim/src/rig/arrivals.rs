//! Counts packets that come together: of several in a tick a controller takes the newest.

use dimsart_core::limits::MAX_LINKS;

/// What came in the present tick.
#[derive(Debug, Default)]
pub(super) struct Arrivals {
    /// The last packet by link; empty before one has come.
    last: [Vec<u8>; MAX_LINKS],
    superseded: u32,
}

impl Arrivals {
    pub(super) fn begin_tick(&mut self) {
        self.last.iter_mut().for_each(Vec::clear);
    }

    /// One that is the same as the one before it is a duplicate, and takes nobody's place.
    pub(super) fn add(&mut self, link: usize, bytes: &[u8]) {
        let Some(last) = self.last.get_mut(link) else { return };
        self.superseded += u32::from(!last.is_empty() && last.as_slice() != bytes);
        last.clear();
        last.extend_from_slice(bytes);
    }

    pub(super) fn superseded(&self) -> u32 {
        self.superseded
    }
}
