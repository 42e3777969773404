//! The three TX buffers, as a FIFO or as a queue that sends the message with the highest priority first.

use super::message::Message;

pub(super) const COUNT: usize = 3;

/// A frame whose transmission a program has requested.
#[derive(Debug, Clone)]
pub(super) struct Request {
    pub(super) message: Message,
    /// Cycle of the request.
    pub(super) since: u64,
    /// Whether the program has cancelled the request while the frame may be on the bus.
    pub(super) is_cancelled: bool,
}

/// State of the TX buffers.
#[derive(Debug, Clone, Default)]
pub(super) struct Buffers {
    pub(super) requests: [Option<Request>; COUNT],
    /// `TXBTO` and `TXBCF`.
    pub(super) sent: u32,
    pub(super) cancelled: u32,
    /// Oldest buffer of the FIFO (`get`), and number of occupied buffers (`level`).
    get: usize,
    level: usize,
    pub(super) on_wire: Option<usize>,
}

impl Buffers {
    /// `TXBRP`.
    pub(super) fn pending(&self) -> u32 {
        self.requests.iter().zip(0..).map(|(request, bit)| u32::from(request.is_some()) << bit).sum()
    }

    pub(super) fn get(&self, place: usize) -> Option<&Request> {
        self.requests.get(place)?.as_ref()
    }

    /// Whether the next request of a FIFO may be for this buffer.
    pub(super) fn is_next(&self, place: usize) -> bool {
        self.level < COUNT && place == (self.get + self.level) % COUNT
    }

    pub(super) fn request(&mut self, place: usize, request: Request, is_queue: bool) {
        self.sent &= !(1 << place);
        self.cancelled &= !(1 << place);
        if let Some(room) = self.requests.get_mut(place) {
            *room = Some(request);
        }
        if !is_queue {
            self.level += 1;
        }
    }

    /// Buffer to be sent next.
    pub(super) fn next(&self, is_queue: bool) -> Option<usize> {
        if self.on_wire.is_some() {
            return self.on_wire;
        }
        if !is_queue {
            return self.get(self.get).map(|_| self.get);
        }
        let waiting = self.requests.iter().enumerate();
        let waiting =
            waiting.filter_map(|(place, request)| Some((request.as_ref()?.message.priority(), place)));
        waiting.min().map(|(_, place)| place)
    }

    /// Frees a buffer. A FIFO continues with the next pending buffer.
    pub(super) fn finish(&mut self, place: usize, is_queue: bool) {
        if let Some(room) = self.requests.get_mut(place) {
            *room = None;
        }
        if self.on_wire == Some(place) {
            self.on_wire = None;
        }
        if !is_queue && place == self.get {
            while self.level > 0 && self.get(self.get).is_none() {
                self.get = (self.get + 1) % COUNT;
                self.level -= 1;
            }
        }
    }

    /// `TXFQS`.
    pub(super) fn register(&self, is_queue: bool) -> u32 {
        let small = |number: usize| u32::try_from(number).unwrap_or(0);
        if is_queue {
            let free = self.requests.iter().position(Option::is_none);
            return small(free.unwrap_or(0)) << 16 | u32::from(free.is_none()) << 21;
        }
        let put = (self.get + self.level) % COUNT;
        small(COUNT - self.level)
            | small(self.get) << 8
            | small(put) << 16
            | u32::from(self.level == COUNT) << 21
    }
}
