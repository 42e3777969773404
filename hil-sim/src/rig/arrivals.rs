//! Counts packets that come together: of several in a tick a controller takes the newest.

use dimsart_core::limits::MAX_LINKS;

use crate::link::Carried;

/// What came in the present tick.
#[derive(Debug, Default)]
pub(super) struct Arrivals {
    /// The last packet by link.
    last: [Option<Carried>; MAX_LINKS],
    superseded: u32,
}

impl Arrivals {
    pub(super) fn begin_tick(&mut self) {
        self.last.iter_mut().for_each(|last| *last = None);
    }

    /// One that is the same as the one before it is a duplicate, and takes nobody's place.
    pub(super) fn add(&mut self, link: usize, carried: Carried) {
        let Some(last) = self.last.get_mut(link) else { return };
        self.superseded += u32::from(last.as_ref().is_some_and(|last| *last != carried));
        *last = Some(carried);
    }

    pub(super) fn superseded(&self) -> u32 {
        self.superseded
    }
}
