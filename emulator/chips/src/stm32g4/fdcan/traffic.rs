//! Frames that the controller offers to the bus, and their outcomes.

use super::buffers::{self, Request};
use super::errors::Errors;
use super::layout::{ASM, BO, BRSE, CCCR, DAR, EP, EW, FDOE, IDLE_BITS, INIT, MON, PEA, PED, TCF, TXBCIE};
use super::message::Message;
use super::ram::{ELEMENT_BYTES, Ram, TX_BUFFERS};
use super::{Fdcan, Presence};
use crate::stm32g4::violation::Access;

/// Outcome of a frame for one controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// Sent and acknowledged.
    Sent,
    /// Received.
    Received,
    /// Sent with an error.
    NotSent(Error),
    /// Received with an error. `is_first`: this controller was the first to send an error flag.
    NotReceived { error: Error, is_first: bool },
    /// Ignored: the controller waits until the bus is idle.
    Ignored,
}

/// Error code in `PSR.LEC`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Error {
    Stuff = 1,
    Form = 2,
    Acknowledge = 3,
    /// Sent recessive, but read dominant.
    Recessive = 4,
    /// Sent dominant, but read recessive.
    Dominant = 5,
}

/// A frame on the bus for one controller; times in the controller's cycles.
#[derive(Debug, Clone)]
pub(crate) struct Passage {
    pub(crate) message: Message,
    pub(crate) begins: u64,
    /// Cycle in which its outcome takes effect.
    pub(crate) ends: u64,
    /// Cycle in which the next frame may start.
    pub(crate) free: u64,
    pub(crate) outcome: Outcome,
    /// Whether an error was in the part at the data bit rate.
    pub(crate) is_data_error: bool,
}

/// A frame that a controller is ready to send.
#[derive(Debug, Clone)]
pub(crate) struct Offer {
    pub(crate) message: Message,
    /// Cycle from which the frame may start.
    pub(crate) since: u64,
}

impl Fdcan {
    pub(super) fn request(&mut self, place: usize, ram: &mut [u8], access: &mut Access<'_>) {
        let is_queue = self.is_queue();
        if self.buffers.get(place).is_some() || !is_queue && !self.buffers.is_next(place) {
            access
                .violates(format!("FDCAN1_TXBAR requests buffer {place}, which is not the next free buffer"));
            return;
        }
        if self.registers.get(CCCR) & (1 << MON | 1 << ASM) != 0 {
            access.violates(
                "FDCAN1_TXBAR requests a transmission in bus monitoring or restricted operation mode",
            );
            return;
        }
        let message = self.message(place, ram);
        let request = Request { message, since: access.at.cycle, is_cancelled: false };
        self.buffers.request(place, request, is_queue);
    }

    pub(super) fn message(&self, place: usize, ram: &mut [u8]) -> Message {
        let ram = Ram(ram);
        let begin = TX_BUFFERS + ELEMENT_BYTES * u32::try_from(place).unwrap_or(0);
        let word = |word: usize| ram.word(begin + 4 * u32::try_from(word).unwrap_or(0));
        let allows = |bit: u32| self.registers.has(CCCR, bit);
        Message {
            is_sender_error_passive: self.errors.is_passive() && allows(FDOE) && word(1) >> 21 & 1 == 1,
            ..Message::from_words(word, allows(FDOE), allows(BRSE))
        }
    }

    pub(super) fn cancel(&mut self, place: usize, now: u64) {
        let is_queue = self.is_queue();
        // The bus is idle, so the frame may have started: the bus decides in its next slice.
        let may_be_on_wire = self.buffers.on_wire == Some(place)
            || self.is_wired
                && self.presence == Presence::In
                && self.buffers.next(is_queue) == Some(place)
                && self.idle_at.max(self.suspended_until) <= now;
        let Some(Some(request)) = self.buffers.requests.get_mut(place) else { return };
        request.is_cancelled = true;
        if !may_be_on_wire {
            self.give_up(place);
        }
    }

    /// Ends a request without a transmission.
    pub(super) fn give_up(&mut self, place: usize) {
        self.buffers.finish(place, self.is_queue());
        self.buffers.cancelled |= 1 << place;
        if self.registers.has(TXBCIE, u32::try_from(place).unwrap_or(0)) {
            self.raise(TCF);
        }
    }

    /// The frame to send next.
    pub(crate) fn offer(&self) -> Option<Offer> {
        let place = self.buffers.next(self.is_queue()).filter(|_| self.buffers.on_wire.is_none())?;
        let request = self.buffers.get(place)?;
        let joined = match self.presence {
            Presence::Initialisation => return None,
            Presence::Integrating { .. } => self.joined_at()?,
            Presence::In => 0,
        };
        let since = request.since.max(self.suspended_until).max(joined);
        Some(Offer { message: request.message.clone(), since })
    }

    /// Ends cancelled requests whose frames have not started; the bus has decided all frames that start up to
    /// now. Returns whether a request has ended.
    pub(crate) fn settle(&mut self) -> bool {
        let before = self.buffers.cancelled;
        for place in 0..buffers::COUNT {
            let is_over = self.buffers.get(place).is_some_and(|request| request.is_cancelled)
                && self.buffers.on_wire != Some(place);
            if is_over {
                self.give_up(place);
            }
        }
        self.buffers.cancelled != before
    }

    /// A frame starts on the bus.
    pub(crate) fn begin(&mut self, passage: Passage) {
        if let Some(joined_at) = self.joined_at() {
            if joined_at <= passage.begins {
                self.enter();
            } else if let Presence::Integrating { sequences, since } = self.presence {
                let passed = passage.begins.saturating_sub(since) / self.cycles(IDLE_BITS).max(1);
                let left = sequences.saturating_sub(u32::try_from(passed).unwrap_or(u32::MAX)).max(1);
                self.presence = Presence::Integrating { sequences: left, since: self.quiet_since(&passage) };
            }
        }
        match passage.outcome {
            Outcome::Sent | Outcome::NotSent(_) => self.buffers.on_wire = self.buffers.next(self.is_queue()),
            Outcome::Ignored if self.presence == Presence::In => {
                self.presence = Presence::Integrating { sequences: 1, since: self.quiet_since(&passage) };
            }
            _ => {}
        }
        self.idle_at = passage.free;
        self.passages.push_back(passage);
    }

    /// Start of the 11 recessive bits after a frame. They end when the next frame may start.
    pub(super) fn quiet_since(&self, passage: &Passage) -> u64 {
        passage.free.saturating_sub(self.cycles(IDLE_BITS))
    }

    /// The controller takes part from now on.
    pub(super) fn enter(&mut self) {
        self.presence = Presence::In;
        if self.errors.is_off() {
            let before = self.errors;
            self.errors = Errors { logged: before.logged, ..Errors::default() };
            self.see_errors(before);
        }
    }

    /// Applies the outcome of a frame.
    pub(super) fn end(&mut self, passage: &Passage, ram: &mut Ram<'_>) {
        let before = self.errors;
        let is_passive = before.is_passive();
        match passage.outcome {
            Outcome::Ignored => {}
            Outcome::Sent => {
                self.errors.has_sent();
                self.last_errors[0] = 0;
                self.sent(passage, ram);
            }
            Outcome::Received => {
                self.errors.has_received();
                self.last_errors[0] = 0;
                self.receive(passage, ram);
            }
            Outcome::NotSent(error) => {
                self.errors.has_not_sent(error == Error::Acknowledge);
                self.note_error(error, passage.is_data_error);
                if let Some(place) = self.buffers.on_wire.take() {
                    let is_over = self.registers.has(CCCR, DAR)
                        || self.buffers.get(place).is_some_and(|request| request.is_cancelled);
                    if is_over {
                        self.give_up(place);
                    }
                }
            }
            Outcome::NotReceived { error, is_first } => {
                self.errors.has_not_received(is_first);
                self.note_error(error, passage.is_data_error);
            }
        }
        if matches!(passage.outcome, Outcome::Sent | Outcome::NotSent(_)) && is_passive {
            self.suspended_until = passage.free + self.cycles(8.0);
        }
        self.see_errors(before);
    }

    pub(super) fn note_error(&mut self, error: Error, is_data_error: bool) {
        let [nominal, data] = &mut self.last_errors;
        *if is_data_error { data } else { nominal } = error as u32;
        self.raise(if is_data_error { PED } else { PEA });
    }

    /// Sets the flags of changes in the error counters' states.
    pub(super) fn see_errors(&mut self, before: Errors) {
        let now = self.errors;
        let changes = [
            (EW, before.is_warned() != now.is_warned()),
            (EP, before.is_passive() != now.is_passive()),
            (BO, before.is_off() != now.is_off()),
        ];
        changes.into_iter().filter(|(_, changed)| *changed).for_each(|(flag, _)| self.raise(flag));
        if now.is_off() && !before.is_off() {
            self.registers.set_bit(CCCR, INIT, true);
            self.leave();
        }
    }
}
