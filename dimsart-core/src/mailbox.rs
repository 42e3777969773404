//! Where packets wait at the edge of the Data Base.
//!
//! Outside the tick a link puts a received packet in and takes the one to send out; in the tick the
//! comm modules read and write them. Neither side ever waits for the other.

use core::cell::Cell;

use crate::content::Content;
use crate::limits::MAX_PACKET_WORDS;
use crate::packet::Packet;

/// One direction's packet. Interior cells let several modules share it within a tick.
#[derive(Debug)]
pub struct Mailbox {
    sequence: Cell<u32>,
    echo: Cell<u32>,
    words: [Cell<u32>; MAX_PACKET_WORDS],
    content: Cell<Content>,
    finite_words: Cell<u8>,
    is_full: Cell<bool>,
}

impl Mailbox {
    const fn new() -> Self {
        Self {
            sequence: Cell::new(0),
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

    /// The packet's sequence number; 0 before the first one.
    #[must_use]
    pub fn sequence(&self) -> u32 {
        self.sequence.get()
    }

    /// The newest sequence number its sender had received; 0 for none.
    #[must_use]
    pub fn echo(&self) -> u32 {
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
    pub fn open(&self, sequence: u32, echo: u32, content: Content) {
        self.sequence.set(sequence);
        self.echo.set(echo);
        self.content.set(content);
        self.is_full.set(true);
    }

    pub(crate) fn put(&self, packet: &Packet) {
        let length = u8::try_from(packet.words.len()).unwrap_or(u8::MAX);
        self.open(packet.sequence, packet.echo, Content::new(length, packet.content));
        for (cell, word) in self.words.iter().zip(&packet.words) {
            cell.set(*word);
        }
        let is_finite = |word: &u32| f32::from_bits(*word).is_finite();
        let odd = packet.words.iter().position(|word| !is_finite(word)).unwrap_or(packet.words.len());
        self.finite_words.set(u8::try_from(odd).unwrap_or(u8::MAX));
    }

    pub(crate) fn take(&self) -> Option<Packet> {
        self.is_full.replace(false).then(|| Packet {
            content: self.content().id(),
            sequence: self.sequence(),
            echo: self.echo(),
            words: self.words().iter().map(Cell::get).collect(),
        })
    }
}

/// Both directions of one link, and what its two comm modules tell each other.
#[derive(Debug)]
pub struct LinkPort {
    /// Filled by the link before a tick, emptied by the receiving module.
    pub received: Mailbox,
    /// Filled by the sending module, emptied by the link after the tick.
    pub outgoing: Mailbox,
    /// Newest sequence number accepted from the other side; sent back as the echo.
    pub accepted_sequence: Cell<u32>,
    /// Sequence number of the last packet sent.
    pub sent_sequence: Cell<u32>,
    /// Packets replaced in `received` before a module saw them, or refused at the door.
    pub superseded: Cell<u32>,
}

impl LinkPort {
    pub(crate) const fn new() -> Self {
        Self {
            received: Mailbox::new(),
            outgoing: Mailbox::new(),
            accepted_sequence: Cell::new(0),
            sent_sequence: Cell::new(0),
            superseded: Cell::new(0),
        }
    }
}

/// Whether sequence number `a` is newer than `b`; numbers wrap around.
#[must_use]
pub fn is_newer(a: u32, b: u32) -> bool {
    a.wrapping_sub(b).cast_signed() > 0
}
