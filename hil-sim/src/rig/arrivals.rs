//! Counts packets that come together: of several in a tick a controller takes the newest.

use crate::link::Carried;

/// What came in the present tick.
#[derive(Debug, Default)]
pub(super) struct Arrivals {
    /// The last packet of each link that one came over.
    last: Vec<(usize, Carried)>,
    superseded: u32,
}

impl Arrivals {
    pub(super) fn begin_tick(&mut self) {
        self.last.clear();
    }

    /// One that is the same as the one before it is a duplicate, and takes nobody's place.
    pub(super) fn add(&mut self, link: usize, carried: Carried) {
        match self.last.iter_mut().find(|(other, _)| *other == link) {
            Some((_, last)) => {
                self.superseded += u32::from(*last != carried);
                *last = carried;
            }
            None => self.last.push((link, carried)),
        }
    }

    pub(super) fn superseded(&self) -> u32 {
        self.superseded
    }
}
