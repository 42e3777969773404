//! Mailboxes between links and comm modules.
//!
//! Outside the tick a link puts in the received packet and takes out the packet to send; in the tick the comm
//! modules read and write them. Neither side waits for the other.

use core::cell::Cell;

use crate::limits::MAX_PACKET_WORDS;
use crate::packet::Packet;
use crate::packet::content::Content;
use crate::signal::Words;

/// The packet of one direction. Cells allow several modules to share it within a tick.
#[derive(Debug)]
pub struct Mailbox {
    channel: Cell<u16>,
    counter: Cell<u16>,
    echo: Cell<u16>,
    words: [Cell<u32>; MAX_PACKET_WORDS],
    content: Cell<Content>,
    finite_word_count: Cell<u8>,
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
            finite_word_count: Cell::new(0),
            is_full: Cell::new(false),
        }
    }

    /// Returns whether a packet is waiting.
    #[must_use]
    pub fn is_full(&self) -> bool {
        self.is_full.get()
    }

    /// Returns the packet's counter; 0 before the first packet.
    #[must_use]
    pub fn counter(&self) -> u16 {
        self.counter.get()
    }

    /// Returns the newest counter that the packet's sender had accepted; 0 for none.
    #[must_use]
    pub fn echo(&self) -> u16 {
        self.echo.get()
    }

    /// Returns the packet's words.
    #[must_use]
    pub fn words(&self) -> &[Cell<u32>] {
        self.words.get(..usize::from(self.content().words())).unwrap_or_default()
    }

    /// Marks the waiting packet as used.
    pub fn clear(&self) {
        self.is_full.set(false);
    }

    /// Returns the packet's content.
    #[must_use]
    pub fn content(&self) -> Content {
        self.content.get()
    }

    /// Returns how many words of a received packet, up to the first that is NaN or infinite, are finite as
    /// `f32`. Computed when the packet is put in, to save time in the tick.
    #[must_use]
    pub fn finite_word_count(&self) -> u8 {
        self.finite_word_count.get()
    }

    /// Returns all words of the buffer, the packet's words first.
    #[must_use]
    pub fn buffer(&self) -> &[Cell<u32>; MAX_PACKET_WORDS] {
        &self.words
    }

    /// Prepares the mailbox for a packet of this content (at most [`MAX_PACKET_WORDS`]), whose words are then
    /// written into [`buffer`](Self::buffer).
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
        self.finite_word_count.set(u8::try_from(odd).unwrap_or(u8::MAX));
    }

    pub(crate) fn take(&self) -> Option<Packet> {
        if !self.is_full.replace(false) {
            return None;
        }
        let mut words = heapless::Vec::new();
        for word in self.words() {
            // Never fails: the sizes are equal. `collect` would add a panic to the image.
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

/// Timeout state of a receiving module.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LinkTimeout {
    /// No timeout.
    None,
    /// No packet has arrived since the module began; ends with the first packet.
    Down,
    /// Packets have stopped; lasts until a reset.
    Lost,
}

/// Both directions of one link, and the state that its two comm modules share.
#[derive(Debug)]
pub struct LinkPort {
    /// Filled by the link before a tick, emptied by the receiving module.
    pub received: Mailbox,
    /// Filled by the sending module, emptied by the link after the tick.
    pub outgoing: Mailbox,
    /// Newest counter accepted from the peer; sent back as the echo.
    pub accepted_counter: Cell<u16>,
    /// Number of the last packet sent; its low half is the counter.
    pub sent_number: Cell<u32>,
    /// Ticks between packets sent.
    pub send_period_ticks: Cell<u32>,
    /// Ticks since the last packet was sent.
    pub ticks_since_sent: Cell<u32>,
    /// Whether a received packet was refused since the receiving module last checked.
    pub has_refused: Cell<bool>,
    /// Set by the receiving module in every tick of a timeout.
    pub timeout: Cell<LinkTimeout>,
    /// Ticks without computation since the receiving module last checked.
    pub skipped_ticks: Cell<u32>,
    /// Packets replaced in `received` before a module read them, or refused.
    pub superseded: Cell<u32>,
}

impl LinkPort {
    pub(crate) const fn new() -> Self {
        Self {
            received: Mailbox::new(),
            outgoing: Mailbox::new(),
            accepted_counter: Cell::new(0),
            sent_number: Cell::new(0),
            send_period_ticks: Cell::new(0),
            ticks_since_sent: Cell::new(0),
            has_refused: Cell::new(false),
            timeout: Cell::new(LinkTimeout::None),
            skipped_ticks: Cell::new(0),
            superseded: Cell::new(0),
        }
    }

    /// Counts a tick without computation: a packet received for it is old in the next tick.
    pub(crate) fn miss_tick(&self) {
        let unused = u32::from(self.received.is_full());
        self.superseded.set(self.superseded.get().wrapping_add(unused));
        self.received.clear();
        self.skipped_ticks.set(self.skipped_ticks.get().saturating_add(1));
    }

    /// Drops the received packet: it may be old.
    pub(crate) fn forget_received(&self) {
        self.received.clear();
        self.accepted_counter.set(0);
        self.has_refused.set(false);
        self.skipped_ticks.set(0);
    }
}

/// Counters up to this value occur only in a sender's first packets: 65 535 is followed by 101. They show a
/// receiver that its sender has restarted.
pub const START_COUNTERS: u16 = 100;

/// Returns how many packets after counter `b` the packet with counter `a` was sent.
#[must_use]
pub fn counter_distance(a: u16, b: u16) -> u16 {
    let left_out = if a < b { START_COUNTERS + 1 } else { 0 };
    a.wrapping_sub(b).wrapping_sub(left_out)
}

/// Returns the number of the packet after `number`. Its low half is the counter.
#[must_use]
pub fn next_packet_number(number: u32) -> u32 {
    let next = number.wrapping_add(1);
    if low_u16(next) == 0 { next.wrapping_add(1 + u32::from(START_COUNTERS)) } else { next }
}

/// Returns the counter of the packet with this number.
#[must_use]
pub fn low_u16(number: u32) -> u16 {
    let [low, high, ..] = number.to_le_bytes();
    u16::from_le_bytes([low, high])
}

/// Returns whether counter `a` is newer than `b`: less than half the counter range after it.
#[must_use]
pub fn is_newer(a: u16, b: u16) -> bool {
    a != b && counter_distance(a, b) <= u16::MAX / 2
}

/// Reception state of a link in a tick, the value of [`LINK_STATE`](crate::types::LINK_STATE): the states of
/// AUTOSAR E2E profile 4. A refused packet changes nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u32)]
pub enum LinkState {
    /// No packet, although one was due, or none so far.
    #[default]
    NoData = 0,
    /// The newest packet is the next in sequence. Kept between packets that arrive every few ticks.
    Ok = 1,
    /// Accepted after one or two lost packets: the counter has advanced by at most 3.
    OkSomeLost = 2,
    /// Duplicate of the last accepted packet; refused.
    Repeated = 3,
    /// Sequence error: an older packet was refused, or a packet was accepted after more than two lost ones or
    /// after a restart of its sender.
    WrongSequence = 4,
    /// Refused: damaged, from another channel, wrong content, or not finite.
    Error = 5,
    /// Timeout: the link is lost until a reset.
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
