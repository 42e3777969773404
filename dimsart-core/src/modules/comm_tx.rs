//! `COMM_TX`: puts the data of its channel into a packet for the link, every tick or every few ticks.
//!
//! Words of a packet: the samples of every type, in the order of the `CTX_ADD_DATA` commands; behind them,
//! per axis, the counters of the channel's first wave: all that was ever sent, so that what a lost packet
//! carried can be made up for; `CTX_COUNTERS OFF` leaves them out. The packet also says of which [`Content`] it is.
//!
//! With `CTX_EVERY n` a packet goes out in every `n`-th tick: of a wave with the mean of the last `n` ticks, of all
//! else with the last sample. The receiver gives the mean out for as many ticks.
//!
//! The packet's counter and those of the wave go on over a reset: the other side would take a jump for a loss.

use heapless::Vec;

use super::channel::{
    BLOCK_PORTS, CHANNEL_PORTS, CHANNELS, EVERY_TICKS, Layout, first_wave, is_wave, samples,
};
use super::wave_integral::Sent;
use crate::limits::{MAX_CHANNEL_TYPES, MAX_DOF};
use crate::mailbox::{low_half, next_number};
use crate::parameter::TypeList;
use crate::{Content, Data, DeviceDescriptor, Input, LinkPort, Memory, Module, Parameters, Ports, Unit};

/// See the [module docs](self).
#[derive(Debug, Default)]
pub struct CommTx {
    link: u32,
    channel: u32,
    types: TypeList,
    every_ticks: u32,
    has_counters: bool,
    channels: Vec<Channel, MAX_CHANNEL_TYPES>,
    content: Content,
    /// Words of the packet that are samples; counters follow.
    samples: u8,
    /// Of the last packet: its counter is the low half, which is never 0.
    number: u32,
    /// Ticks since the last packet.
    since_sent_ticks: u32,
    /// Time that a packet's wave stands for.
    period_s: f32,
    sent: [Sent; MAX_DOF],
}

#[derive(Debug, Default)]
struct Channel {
    input: Input,
    /// What goes into the packet: the input, or the mean of a wave.
    sample: Input,
    /// Where a wave's mean is worked out, if not every one is sent.
    block: Option<Memory>,
    /// Whether it is the wave whose counters go into the packet.
    is_counted: bool,
}

impl Module for CommTx {
    const NAME: &'static str = "COMM_TXMOD";
    const SUMMARY: &'static str = "Sends signals to the other side.";

    fn parameters(&mut self, visit: &mut Parameters<'_>) {
        visit.types(&mut self.types, "CTX_ADD_DATA", "Adds a signal to the packet.");
        visit.structural_count(&mut self.link, "CTX_LINK", Unit::One, 0..=1, 0, "Link it sends over.");
        let summary = "Channel it sends on; 0 between two ends.";
        visit.structural_count(&mut self.channel, "CTX_CHANNEL", Unit::One, CHANNELS, 0, summary);
        let summary = "Ticks from a packet to the next one; of a wave the mean is sent.";
        let every = &mut self.every_ticks;
        visit.structural_count(every, "CTX_EVERY", Unit::Tick, EVERY_TICKS, 1, summary);
        let summary = "Whether packets carry counters, to make up for lost waves.";
        visit.structural_flag(&mut self.has_counters, "CTX_COUNTERS", true, summary);
    }

    fn activate(&mut self, ports: &mut Ports<'_>) {
        self.channels.clear();
        let wave = first_wave(ports.device(), &self.types).filter(|_| self.has_counters);
        let names = CHANNEL_PORTS.into_iter().zip(BLOCK_PORTS);
        for (place, (signal, (name, block_name))) in self.types.iter().zip(names).enumerate() {
            let mut input = Input::default();
            ports.named_input(&mut input, name, *signal);
            let (mut sample, mut block) = (input, None);
            if self.every_ticks > 1 && is_wave(ports.device(), *signal) {
                let (mut memory, dof) = (Memory::default(), ports.device().dof());
                ports.memory(&mut memory, block_name, dof);
                (sample, block) = (Input::new(memory.block), Some(memory));
            }
            let is_counted = wave == Some(place);
            let _ = self.channels.push(Channel { input, sample, block, is_counted });
        }
        ports.sends_over(self.link, self.channel);
    }

    fn prepare(&mut self, device: &DeviceDescriptor) {
        let layout = Layout { every_ticks: self.every_ticks, has_counters: self.has_counters };
        self.period_s = layout.period_s(device);
        self.content = layout.content(device, &self.types);
        self.samples = samples(device, &self.types);
    }

    fn compute(&mut self, data: &Data<'_>) {
        let Some(link) = data.link(self.link) else { return };
        if self.every_ticks > 1 && !self.gather(data, link) {
            return;
        }
        link.since_sent_ticks.set(0);
        link.sent_every_ticks.set(self.every_ticks);
        self.number = next_number(self.number);
        let (channel, counter) = (low_half(self.channel), low_half(self.number));
        link.sent_number.set(self.number);
        link.outgoing.open(channel, counter, link.accepted_counter.get(), self.content);
        let room = link.outgoing.room().as_slice();
        let (mut cells, counters) = (room, usize::from(self.samples));
        let period_s = self.period_s;
        for channel in &self.channels {
            let Some((values, rest)) = cells.split_at_checked(data.dof()) else { return };
            cells = rest;
            if channel.is_counted {
                let Some(counters) = room.get(counters..counters + 2 * data.dof()) else { return };
                let (counters, _) = counters.as_chunks::<2>();
                let lanes = self.sent.iter_mut().zip(values).zip(counters);
                data.map_axes(
                    lanes,
                    [channel.sample],
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
                data.map_axes(values, [channel.sample], [], |value, [sample]| {
                    value.set(sample.to_bits());
                    []
                });
            }
        }
    }

    fn reset(&mut self) {
        self.since_sent_ticks = 0;
    }
}

impl CommTx {
    /// Adds this tick's waves to their means; whether these are due to be sent.
    #[cold]
    fn gather(&mut self, data: &Data<'_>, link: &LinkPort) -> bool {
        let is_first = self.since_sent_ticks == 0;
        self.since_sent_ticks += 1;
        let is_last = self.since_sent_ticks >= self.every_ticks;
        #[expect(clippy::cast_precision_loss, reason = "at most 100")]
        let share = if is_last { 1.0 / self.every_ticks as f32 } else { 1.0 };
        for (channel, memory) in self.channels.iter().filter_map(|channel| Some((channel, channel.block?))) {
            data.map_axes(data.memory(memory), [channel.input], [], |sum, [wave]| {
                let before = if is_first { 0.0 } else { f32::from_bits(sum.get()) };
                sum.set((share * (before + wave)).to_bits());
                []
            });
        }
        link.since_sent_ticks.set(self.since_sent_ticks);
        if is_last {
            self.since_sent_ticks = 0;
        }
        is_last
    }
}
