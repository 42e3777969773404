//! A ring of three elements in message RAM: an RX FIFO, or the TX event FIFO.

/// Number of elements.
const ROOM: u32 = 3;

/// Occupied elements.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Fifo {
    get: u32,
    level: u32,
    /// Whether an element was lost since the flag was cleared.
    pub(super) has_lost: bool,
}

impl Fifo {
    pub(super) fn is_full(self) -> bool {
        self.level == ROOM
    }

    /// Adds an element and returns its index; `None` if the FIFO is full and does not overwrite its oldest
    /// element.
    pub(super) fn put(&mut self, overwrites: bool) -> Option<u32> {
        if self.is_full() {
            if !overwrites {
                self.has_lost = true;
                return None;
            }
            self.get = (self.get + 1) % ROOM;
            self.level -= 1;
        }
        let place = (self.get + self.level) % ROOM;
        self.level += 1;
        Some(place)
    }

    /// Frees all elements up to this index; `false` if this element is empty.
    pub(super) fn acknowledge(&mut self, place: u32) -> bool {
        let taken = (place + ROOM - self.get) % ROOM + 1;
        if place >= ROOM || taken > self.level {
            return false;
        }
        self.level -= taken;
        self.get = (place + 1) % ROOM;
        true
    }

    /// `RXF0S`, `RXF1S` or `TXEFS`.
    pub(super) fn register(self) -> u32 {
        let put = (self.get + self.level) % ROOM;
        self.level
            | self.get << 8
            | put << 16
            | u32::from(self.is_full()) << 24
            | u32::from(self.has_lost) << 25
    }
}
