//! Where packets wait at the edge of the Data Base.
//!
//! Outside the tick a link puts a received packet in and takes the one to send out; in the tick the
//! comm modules read and write them. Neither side ever waits for the other.

use core::cell::Cell;

use crate::limits::MAX_PACKET_WORDS;
use crate::packet::Packet;
use crate::packet::content::Content;
use crate::signal::Words;

/// One direction's packet. Interior cells let several modules share it within a tick.
#[derive(Debug)]
pub struct Mailbox {
    channel: Cell<u16>,
    counter: Cell<u16>,
    echo: Cell<u16>,
    words: [Cell<u32>; MAX_PACKET_WORDS],
    content: Cell<Content>,
    finite_words: Cell<u8>,
    is_full: Cell<bool>,
}

impl Mailbox {
    const fn new() -> Self {
        Self {
            channel: Cell::new(0),
            counter: Cell::new(0),
            echo: Cell::new(0),
            words: [const { Cell::new(0) }; MAX_PACKET_WORDS],
            content: Cell::new(Content::new(0, 0)),
            finite_words: Cell::new(0),
            is_full: Cell::new(false),
        }
    }

    /// Whether a packet waits here.
    #[must_use]
    pub fn is_full(&self) -> bool {
        self.is_full.get()
    }

    /// The packet's counter; 0 before the first one.
    #[must_use]
    pub fn counter(&self) -> u16 {
        self.counter.get()
    }

    /// The newest counter that its sender had accepted; 0 for none.
    #[must_use]
    pub fn echo(&self) -> u16 {
        self.echo.get()
    }

    /// The packet's words.
    #[must_use]
    pub fn words(&self) -> &[Cell<u32>] {
        self.words.get(..usize::from(self.content().words())).unwrap_or_default()
    }

    /// Marks the waiting packet as used.
    pub fn clear(&self) {
        self.is_full.set(false);
    }

    /// What the packet carries.
    #[must_use]
    pub fn content(&self) -> Content {
        self.content.get()
    }

    /// How many words of a received packet, up to the first that is not, are finite numbers if they are
    /// read as such. Looked at where the packet is put in, so that the tick need not.
    #[must_use]
    pub fn finite_words(&self) -> u8 {
        self.finite_words.get()
    }

    /// All there is room for, the packet's words first.
    #[must_use]
    pub fn room(&self) -> &[Cell<u32>; MAX_PACKET_WORDS] {
        &self.words
    }

    /// Opens the mailbox for a packet of this content (at most [`MAX_PACKET_WORDS`]), to be put into
    /// its [`room`](Self::room).
    pub fn open(&self, channel: u16, counter: u16, echo: u16, content: Content) {
        self.channel.set(channel);
        self.counter.set(counter);
        self.echo.set(echo);
        self.content.set(content);
        self.is_full.set(true);
    }

    pub(crate) fn put(&self, packet: &Packet) {
        let length = u8::try_from(packet.words.len()).unwrap_or(u8::MAX);
        self.open(packet.channel, packet.counter, packet.echo, Content::new(length, packet.content));
        for (cell, word) in self.words.iter().zip(&packet.words) {
            cell.set(*word);
        }
        let is_finite = |word: &u32| f32::from_bits(*word).is_finite();
        let odd = packet.words.iter().position(|word| !is_finite(word)).unwrap_or(packet.words.len());
        self.finite_words.set(u8::try_from(odd).unwrap_or(u8::MAX));
    }

    pub(crate) fn take(&self) -> Option<Packet> {
        if !self.is_full.replace(false) {
            return None;
        }
        let mut words = heapless::Vec::new();
        for word in self.words() {
            // There are no more than there is room for; to collect them would leave a panic in the image.
            let _ = words.push(word.get());
        }
        Some(Packet {
            channel: self.channel.get(),
            content: self.content().id(),
            counter: self.counter(),
            echo: self.echo(),
            words,
        })
    }
}

/// Whether a receiving module misses packets for too long.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Silence {
    /// It does not.
    None,
    /// No packet has arrived since the module began: over with the first one.
    Down,
    /// Packets have stopped: until a reset.
    Lost,
}

/// Both directions of one link, and what its two comm modules tell each other.
#[derive(Debug)]
pub struct LinkPort {
    /// Filled by the link before a tick, emptied by the receiving module.
    pub received: Mailbox,
    /// Filled by the sending module, emptied by the link after the tick.
    pub outgoing: Mailbox,
    /// Newest counter accepted from the other side; sent back as the echo.
    pub accepted_counter: Cell<u16>,
    /// Number of the last packet sent, of which its counter is the low half.
    pub sent_number: Cell<u32>,
    /// Ticks from a packet sent to the next one.
    pub sent_every_ticks: Cell<u32>,
    /// Ticks since the last packet was sent.
    pub since_sent_ticks: Cell<u32>,
    /// Whether something came in that was refused at the door, since the receiving module looked.
    pub is_damaged: Cell<bool>,
    /// Set by the receiving module in every tick in which it misses packets for too long.
    pub silence: Cell<Silence>,
    /// Ticks that computed nothing, since the receiving module looked.
    pub missed_ticks: Cell<u32>,
    /// Packets replaced in `received` before a module saw them, or refused at the door.
    pub superseded: Cell<u32>,
}

impl LinkPort {
    pub(crate) const fn new() -> Self {
        Self {
            received: Mailbox::new(),
            outgoing: Mailbox::new(),
            accepted_counter: Cell::new(0),
            sent_number: Cell::new(0),
            sent_every_ticks: Cell::new(0),
            since_sent_ticks: Cell::new(0),
            is_damaged: Cell::new(false),
            silence: Cell::new(Silence::None),
            missed_ticks: Cell::new(0),
            superseded: Cell::new(0),
        }
    }

    /// Counts a tick that computed nothing; what came for it will be old in the next one.
    pub(crate) fn miss_tick(&self) {
        let unused = u32::from(self.received.is_full());
        self.superseded.set(self.superseded.get().wrapping_add(unused));
        self.received.clear();
        self.missed_ticks.set(self.missed_ticks.get().saturating_add(1));
    }

    /// Forgets what came while nobody took it: it may be long past.
    pub(crate) fn forget_received(&self) {
        self.received.clear();
        self.accepted_counter.set(0);
        self.is_damaged.set(false);
        self.missed_ticks.set(0);
    }
}

/// Counters up to this one belong to a sender's first packets alone: 101 follows 65 535. A receiver tells by them that
/// its sender has started anew.
pub const START_COUNTERS: u16 = 100;

/// How many packets after counter `b` the one with counter `a` was sent.
#[must_use]
pub fn counters_ahead(a: u16, b: u16) -> u16 {
    let left_out = if a < b { START_COUNTERS + 1 } else { 0 };
    a.wrapping_sub(b).wrapping_sub(left_out)
}

/// The number of the packet after number `number`. Its counter is the low half.
#[must_use]
pub fn next_number(number: u32) -> u32 {
    let next = number.wrapping_add(1);
    if low_half(next) == 0 { next.wrapping_add(1 + u32::from(START_COUNTERS)) } else { next }
}

/// The counter of the packet with this number.
#[must_use]
pub fn low_half(number: u32) -> u16 {
    let [low, high, ..] = number.to_le_bytes();
    u16::from_le_bytes([low, high])
}

/// Whether the packet with counter `a` was sent after that with counter `b`: less than half a round after it.
#[must_use]
pub fn is_newer(a: u16, b: u16) -> bool {
    a != b && counters_ahead(a, b) <= u16::MAX / 2
}

/// What came in over a link in a tick, as [`LINK_STATE`](crate::types::LINK_STATE) has it: the states of AUTOSAR's E2E
/// profile 4. Packets that were not accepted have changed nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u32)]
pub enum LinkState {
    /// Nothing, though a packet was due; or nothing yet.
    #[default]
    NoData = 0,
    /// The newest packet is the next one. Stays between packets that come in every so many ticks.
    Ok = 1,
    /// A packet was accepted after one or two lost ones: its counter has gone on by at most 3.
    OkSomeLost = 2,
    /// The packet that was accepted last came once more, and was refused.
    Repeated = 3,
    /// The counter has jumped. An older packet was refused; one with more than two lost before it, or the first one of
    /// a sender that has started anew, was accepted.
    WrongSequence = 4,
    /// What came was damaged, not for this channel, of another content or not finite, and was refused.
    Error = 5,
    /// Nothing for so long that the link is lost, until a reset.
    Timeout = 6,
}

impl Words for LinkState {
    const COUNT: usize = 1;

    #[inline(always)]
    fn load(words: &[Cell<u32>]) -> Self {
        match u32::load(words) {
            1 => Self::Ok,
            2 => Self::OkSomeLost,
            3 => Self::Repeated,
            4 => Self::WrongSequence,
            5 => Self::Error,
            6 => Self::Timeout,
            _ => Self::NoData,
        }
    }

    #[inline(always)]
    fn store(self, words: &[Cell<u32>]) {
        (self as u32).store(words);
    }
}
