//! `COMM_TX`: puts the data of its channel into a packet for the link, every tick.
//!
//! Words of a packet: for every type of the channel, in the order of the `CTX_ADD_DATA` commands, its
//! words; and for the channel's first wave, per axis after them, the counters of its wave integral: all
//! that was ever sent, so that what a lost packet carried can be made up for.

use super::wave_integral::Sent;
use crate::limits::{MAX_CHANNEL_TYPES, MAX_DOF};
use crate::parameter::TypeList;
use crate::{Data, DeviceDescriptor, Input, Module, Parameters, Ports, Unit};

/// See the [module docs](self).
#[derive(Debug, Default)]
pub struct CommTx {
    link: u32,
    types: TypeList,
    channels: [Channel; MAX_CHANNEL_TYPES],
    packet_words: u8,
    sequence: u32,
    period_s: f32,
    sent: [Sent; MAX_DOF],
}

#[derive(Debug, Default)]
struct Channel {
    input: Input,
    is_wave: bool,
}

pub(super) const CHANNEL_PORTS: [&str; MAX_CHANNEL_TYPES] = ["DATA_1", "DATA_2", "DATA_3", "DATA_4"];

impl Module for CommTx {
    const NAME: &'static str = "COMM_TXMOD";
    const SUMMARY: &'static str = "Sends signals to the other side, one packet a tick.";

    fn parameters(&mut self, visit: &mut Parameters<'_>) {
        visit.types(&mut self.types, "CTX_ADD_DATA", "Adds a signal to the packet.");
        visit.count(&mut self.link, "CTX_LINK", Unit::One, 0..=1, 0, "Link it sends over.");
    }

    fn activate(&mut self, ports: &mut Ports<'_>) {
        let mut wave_found = false;
        for ((channel, signal), name) in self.channels.iter_mut().zip(&self.types).zip(CHANNEL_PORTS) {
            ports.named_input(&mut channel.input, name, *signal);
            let is_wave = ports.device().data_type(signal.id).is_some_and(|found| found.unit == Unit::Wave);
            // One set of counters: the first wave of the channel has them.
            channel.is_wave = is_wave && !wave_found;
            wave_found |= is_wave;
        }
        let dof = ports.device().dof();
        let words = self.types.len() * dof + if wave_found { 2 * dof } else { 0 };
        self.packet_words = u8::try_from(words).unwrap_or(u8::MAX);
    }

    fn prepare(&mut self, device: &DeviceDescriptor) {
        self.period_s = device.sample_period_s();
    }

    fn compute(&mut self, data: &Data<'_>) {
        let Some(link) = data.link(self.link) else { return };
        self.sequence = self.sequence.wrapping_add(1).max(1);
        link.sent_sequence.set(self.sequence);
        let echo = link.accepted_sequence.get();
        let mut cells = link.outgoing.fill(self.sequence, echo, self.packet_words).iter();
        for channel in self.channels.iter().take(self.types.len()) {
            let words = data.words(channel.input);
            for (word, cell) in words.iter().zip(cells.by_ref()) {
                cell.set(word.get());
            }
            if channel.is_wave {
                for (sent, word) in self.sent.iter_mut().zip(words) {
                    let counters = sent.add(f32::from_bits(word.get()), self.period_s);
                    for (counter, cell) in counters.into_iter().zip(cells.by_ref()) {
                        cell.set(counter);
                    }
                }
            }
        }
    }

    fn reset(&mut self) {
        self.sent = Default::default();
    }
}
