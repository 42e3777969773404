//! A ring of three elements in message RAM: an RX FIFO, or the events of what was sent.

/// Elements.
const ROOM: u32 = 3;

/// Which elements hold something.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Fifo {
    get: u32,
    level: u32,
    /// Whether something was lost since the flag was cleared.
    pub(super) has_lost: bool,
}

impl Fifo {
    pub(super) fn is_full(self) -> bool {
        self.level == ROOM
    }

    /// The element that something new goes to; none when all are taken and the oldest is not to be given up.
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

    /// The program has taken everything up to an element; false when that one holds nothing.
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
