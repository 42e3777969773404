//! `COMM_TX`: puts the data of its channel into a packet for the link, every tick.
//!
//! Words of a packet: for every type of the channel, in the order of the `CTX_ADD_DATA` commands, its
//! words; and for the channel's first wave, per axis after them, the counters of its wave integral: all
//! that was ever sent, so that what a lost packet carried can be made up for.

use heapless::Vec;

use super::wave_integral::Sent;
use crate::limits::{MAX_CHANNEL_TYPES, MAX_DOF};
use crate::parameter::TypeList;
use crate::{Data, DeviceDescriptor, Input, Module, Parameters, Ports, Unit};

/// See the [module docs](self).
#[derive(Debug, Default)]
pub struct CommTx {
    link: u32,
    types: TypeList,
    channels: Vec<Channel, MAX_CHANNEL_TYPES>,
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
        self.channels.clear();
        let mut wave_found = false;
        for (signal, name) in self.types.iter().zip(CHANNEL_PORTS) {
            let mut input = Input::default();
            ports.named_input(&mut input, name, *signal);
            let is_wave = ports.device().data_type(signal.id).is_some_and(|found| found.unit == Unit::Wave);
            // One set of counters: the first wave of the channel has them.
            let is_wave = is_wave && !wave_found;
            wave_found |= is_wave;
            let _ = self.channels.push(Channel { input, is_wave });
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
        link.outgoing.open(self.sequence, echo, self.packet_words);
        let mut cells = link.outgoing.room().as_slice();
        let period_s = self.period_s;
        for channel in &self.channels {
            let Some((values, rest)) = cells.split_at_checked(data.dof()) else { return };
            cells = rest;
            if channel.is_wave {
                let Some((counters, rest)) = rest.split_at_checked(2 * data.dof()) else { return };
                cells = rest;
                let (counters, _) = counters.as_chunks::<2>();
                let lanes = self.sent.iter_mut().zip(values).zip(counters);
                data.map_axes(
                    lanes,
                    [channel.input],
                    [],
                    |((sent, value), [wave_count, energy_count]), [wave]| {
                        value.set(wave.to_bits());
                        let [waves, energies] = sent.add(wave, period_s);
                        wave_count.set(waves);
                        energy_count.set(energies);
                        []
                    },
                );
            } else {
                data.map_axes(values, [channel.input], [], |value, [sample]| {
                    value.set(sample.to_bits());
                    []
                });
            }
        }
    }

    fn reset(&mut self) {
        self.sent = Default::default();
    }
}
