//! Results of an acknowledged frame in message RAM: a received frame, or the event of a sent frame.

use super::layout::{F1OM, HPM, HPMS, RF0L, RF0N, RF1N, RXGFC, TC, TEFF, TEFL, TEFN, TFE, TXBTIE};
use super::ram::{ELEMENT_BYTES, RX_FIFOS, Ram, TX_BUFFERS, TX_EVENTS};
use super::traffic::Passage;
use super::{Fdcan, filters};

impl Fdcan {
    pub(super) fn sent(&mut self, passage: &Passage, ram: &mut Ram<'_>) {
        let Some(place) = self.buffers.on_wire else { return };
        let was_cancelled = self.buffers.get(place).is_some_and(|request| request.is_cancelled);
        let number = u32::try_from(place).unwrap_or(0);
        self.buffers.finish(place, self.is_queue());
        self.buffers.sent |= 1 << place;
        if was_cancelled {
            self.buffers.cancelled |= 1 << place;
        }
        if self.registers.has(TXBTIE, number) {
            self.raise(TC);
        }
        if self.buffers.pending() == 0 && !self.is_queue() {
            self.raise(TFE);
        }
        let second = ram.word(TX_BUFFERS + ELEMENT_BYTES * number + 4);
        if second >> 23 & 1 == 0 {
            return;
        }
        let Some(place) = self.events.put(false) else {
            self.raise(TEFL);
            return;
        };
        let kind = if was_cancelled { 2 } else { 1 };
        let begin = TX_EVENTS + 8 * place;
        ram.set(begin, passage.message.first_word());
        let stamp = self.timestamp(passage.begins);
        ram.set(begin + 4, second & 0xFF00_0000 | kind << 22 | passage.message.second_word() | stamp);
        self.raise(TEFN);
        if self.events.is_full() {
            self.raise(TEFF);
        }
    }

    pub(super) fn receive(&mut self, passage: &Passage, ram: &mut Ram<'_>) {
        let message = &passage.message;
        if message.is_fd {
            self.last_fd = u32::from(message.is_sender_error_passive) << 11
                | u32::from(message.switches_rate) << 12
                | 1 << 13;
        }
        let found = filters::look_up(&self.registers, ram, message);
        let stamp = self.timestamp(passage.begins);
        let overwrites = [1, 0].map(|bit| self.registers.has(RXGFC, F1OM + bit));
        let mut stored = None;
        let mut flags = Vec::new();
        if let Some(number) = found.fifo
            && let Some(fifo) = self.received.get_mut(number)
        {
            let first_flag = if number == 0 { RF0N } else { RF1N };
            stored = fifo.put(overwrites.get(number).copied().unwrap_or(false));
            match stored {
                None => flags.push(first_flag + RF0L),
                Some(place) => {
                    let begin = RX_FIFOS.get(number).copied().unwrap_or(0) + ELEMENT_BYTES * place;
                    let filter = found.filter.map_or(1 << 31, |filter| filter << 24);
                    ram.set(begin, message.first_word());
                    ram.set(begin + 4, filter | message.second_word() | stamp);
                    for (chunk, offset) in message.data.chunks(4).zip((begin + 8..).step_by(4)) {
                        let word = chunk.iter().rev().fold(0, |word, byte| word << 8 | u32::from(*byte));
                        ram.set(offset, word);
                    }
                    flags.push(first_flag);
                    if fifo.is_full() {
                        flags.push(first_flag + 1);
                    }
                }
            }
        }
        if found.has_priority {
            let storage = match (found.fifo, stored) {
                (None, _) => 0,
                (Some(_), None) => 1,
                (Some(number), Some(_)) => 2 + u32::try_from(number).unwrap_or(0),
            };
            let filter = found.filter.unwrap_or(0);
            let list = u32::from(message.is_extended) << 15;
            self.registers.set(HPMS, list | filter << 8 | storage << 6 | stored.unwrap_or(0));
            flags.push(HPM);
        }
        flags.into_iter().for_each(|flag| self.raise(flag));
    }
}
