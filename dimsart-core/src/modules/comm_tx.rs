//! `COMM_TX`: puts the data of its channel into a packet for the link, every tick.
//!
//! Words of a packet: the samples of every type, in the order of the `CTX_ADD_DATA` commands; behind them,
//! per axis, the counters of the channel's first wave: all that was ever sent, so that what a lost packet
//! carried can be made up for. The packet also says of which [`Content`] it is.
//!
//! The packet's counter and those of the wave go on over a reset: the other side would take a jump for a loss.

use heapless::Vec;

use super::channel::{CHANNEL_PORTS, CHANNELS, content, first_wave, samples};
use super::wave_integral::Sent;
use crate::limits::{MAX_CHANNEL_TYPES, MAX_DOF};
use crate::mailbox::{low_half, next_number};
use crate::parameter::TypeList;
use crate::{Content, Data, DeviceDescriptor, Input, Module, Parameters, Ports, Unit};

/// See the [module docs](self).
#[derive(Debug, Default)]
pub struct CommTx {
    link: u32,
    channel: u32,
    types: TypeList,
    channels: Vec<Channel, MAX_CHANNEL_TYPES>,
    content: Content,
    /// Words of the packet that are samples; counters follow.
    samples: u8,
    /// Of the last packet: its counter is the low half, which is never 0.
    number: u32,
    period_s: f32,
    sent: [Sent; MAX_DOF],
}

#[derive(Debug, Default)]
struct Channel {
    input: Input,
    is_wave: bool,
}

impl Module for CommTx {
    const NAME: &'static str = "COMM_TXMOD";
    const SUMMARY: &'static str = "Sends signals to the other side, one packet a tick.";

    fn parameters(&mut self, visit: &mut Parameters<'_>) {
        visit.types(&mut self.types, "CTX_ADD_DATA", "Adds a signal to the packet.");
        visit.structural_count(&mut self.link, "CTX_LINK", Unit::One, 0..=1, 0, "Link it sends over.");
        let summary = "Channel that its packets are for; 0 on a link between two ends.";
        visit.structural_count(&mut self.channel, "CTX_CHANNEL", Unit::One, CHANNELS, 0, summary);
    }

    fn activate(&mut self, ports: &mut Ports<'_>) {
        self.channels.clear();
        let wave = first_wave(ports.device(), &self.types);
        for (place, (signal, name)) in self.types.iter().zip(CHANNEL_PORTS).enumerate() {
            let mut input = Input::default();
            ports.named_input(&mut input, name, *signal);
            let _ = self.channels.push(Channel { input, is_wave: wave == Some(place) });
        }
        ports.sends_over(self.link, self.channel);
    }

    fn prepare(&mut self, device: &DeviceDescriptor) {
        self.period_s = device.sample_period_s();
        self.content = content(device, &self.types);
        self.samples = samples(device, &self.types);
    }

    fn compute(&mut self, data: &Data<'_>) {
        let Some(link) = data.link(self.link) else { return };
        self.number = next_number(self.number);
        let [channel, counter] = [self.channel, self.number].map(low_half);
        link.sent_number.set(self.number);
        link.outgoing.open(channel, counter, link.accepted_counter.get(), self.content);
        let room = link.outgoing.room().as_slice();
        let (mut cells, counters) = (room, usize::from(self.samples));
        let period_s = self.period_s;
        for channel in &self.channels {
            let Some((values, rest)) = cells.split_at_checked(data.dof()) else { return };
            cells = rest;
            if channel.is_wave {
                let Some(counters) = room.get(counters..counters + 2 * data.dof()) else { return };
                let (counters, _) = counters.as_chunks::<2>();
                let lanes = self.sent.iter_mut().zip(values).zip(counters);
                data.map_axes(
                    lanes,
                    [channel.input],
                    [],
                    |((sent, value), [wave_count, energy_count]), [wave]| {
                        value.set(wave.to_bits());
                        let [waves, energies] = sent.add(value, wave, period_s);
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
}
