//! `COMM_TX`: sends the signals of a channel over a link, every tick or every few ticks.
//!
//! A packet contains the words of each signal, of any format and shape, in the order of the `CTX_ADD_DATA` commands.
//! They are followed, per axis, by the counters of the channel's first wave: totals of all that was ever sent, from
//! which the receiver recovers the content of lost packets; `CTX_COUNTERS OFF` omits them. The packet header identifies
//! its [`Content`].
//!
//! With `CTX_AXIS n`, the packet carries only axis `n`, without counters, as sent by a single-axis device.
//!
//! With `CTX_EVERY n`, a packet is sent every `n` ticks: a wave as the mean of the last `n` ticks, any other signal as
//! its last sample. The receiver outputs the mean for as many ticks.
//!
//! The counters of the packet and of the wave survive a reset; otherwise the receiver would take the jump for a loss.

use core::cell::Cell;

use crate::channel::{
    ALL_AXES, AXES, BLOCK_PORTS, CHANNEL_PORTS, CHANNELS, EVERY_TICKS, LINKS, Layout, Parts, Prepared,
    is_wave,
};
use crate::wave_integral::SentTotals;
use dimsart_core::limits::{MAX_CHANNEL_TYPES, MAX_PACKET_WORDS};
use dimsart_core::mailbox::{low_u16, next_packet_number};
use dimsart_core::parameter::TypeList;
use dimsart_core::{
    Content, Context, Declarations, DeviceDescriptor, Input, LinkPort, Memory, Module, Unit, Untyped, words,
};

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        /// Add a signal to the packet.
        types: TypeList = types("CTX_ADD_DATA"),
        /// Link to send over.
        link: u32 = structural_count("CTX_LINK", Unit::One, LINKS, 0),
        /// Channel to send on; 0 on a point-to-point link.
        channel: u32 = structural_count("CTX_CHANNEL", Unit::One, CHANNELS, 0),
        /// Ticks per packet; waves are averaged over these ticks.
        every_ticks: u32 = structural_count("CTX_EVERY", Unit::Tick, EVERY_TICKS, 1),
        /// Packets carry counters, from which the receiver recovers lost waves.
        has_counters: bool = structural_flag("CTX_COUNTERS", true),
        /// Single axis to send, in packets without counters; 8: all axes.
        axis: u32 = structural_count("CTX_AXIS", Unit::One, AXES, ALL_AXES),
        parts: Parts,
        content: Content,
        /// Number of sample words in the packet; counters follow.
        samples: u32,
        /// Number of signals in the channel.
        signals: u32,
        /// Index of the wave whose counters are in the packet; `u32::MAX` without one.
        counted: u32,
        /// Index of its first word in the packet.
        counted_at: u32,
        /// Packet period.
        period_s: f32,
    }
    /// State common to all axes.
    pub struct State {
        /// Number of the last packet; its low half is the counter, which is never 0.
        number: u32,
        /// Ticks since the last packet.
        ticks_since_sent: u32,
    }
    /// Ports and memory, indexed by the channel's signals.
    pub ports Ports {
        /// Samples to send: the input, or the mean of a wave.
        samples: [Input<Untyped>; MAX_CHANNEL_TYPES],
        inputs: [Input<Untyped>; MAX_CHANNEL_TYPES],
        /// Accumulators of the waves' means, if `CTX_EVERY` is above 1.
        blocks: [Memory; MAX_CHANNEL_TYPES],
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct CommTx;

impl Module for CommTx {
    const NAME: &'static str = "COMM_TXMOD";
    const SUMMARY: &'static str = "Sends the signals of a channel to the peer.";
    const KEEPS_STATE_ON_ARMING: bool = true;
    type Settings = Settings;
    type Gains = ();
    type State = State;
    type AxisState = SentTotals;
    type Ports = Ports;

    fn prepare(settings: &mut Settings, device: &DeviceDescriptor) {
        let Prepared { content, samples, parts, counted, counted_at, period_s } =
            settings.layout().prepare(device, &settings.types);
        (settings.content, settings.samples, settings.parts) = (content, samples, parts);
        (settings.counted, settings.counted_at, settings.period_s) = (counted, counted_at, period_s);
        settings.signals = u32::try_from(settings.types.len()).unwrap_or(0);
    }

    fn ports(settings: &Settings, declare: &mut Declarations<'_>) -> Ports {
        let mut ports = Ports::default();
        let Ports { samples, inputs, blocks } = &mut ports;
        let names = CHANNEL_PORTS.into_iter().zip(BLOCK_PORTS);
        let handles = inputs.iter_mut().zip(samples).zip(blocks);
        for ((signal, (name, block_name)), ((input, sample), block)) in
            settings.types.iter().zip(names).zip(handles)
        {
            let Some(data_type) = declare.device().data_type(signal.id) else { continue };
            *input = declare.default_signal(*signal).input(name, data_type);
            *sample = *input;
            if settings.every_ticks > 1 && is_wave(declare.device(), *signal) {
                let dof = declare.device().dof();
                *block = declare.memory(block_name, dof);
                *sample = block.as_input();
            }
        }
        let layout = settings.layout();
        declare.set_packet_words(layout.packet_words(declare.device(), &settings.types));
        declare.requires_axis(layout.has_axis(declare.device()));
        declare.sends_on(settings.link, settings.channel);
        ports
    }

    /// Keeps the counters of the packet and of the wave.
    fn begin(context: &Context<'_, Self>) {
        context.set_state(State { ticks_since_sent: 0, ..context.state() });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let settings = context.settings();
        let Some(link) = context.link(settings.link) else { return };
        if settings.every_ticks > 1 && !gather(context, link) {
            return;
        }
        let mut state = context.state();
        state.number = next_packet_number(state.number);
        context.set_state(state);
        link.ticks_since_sent.set(0);
        link.send_period_ticks.set(settings.every_ticks);
        let (channel, counter) = (low_u16(settings.channel), low_u16(state.number));
        link.sent_number.set(state.number);
        link.outgoing.open(channel, counter, link.accepted_counter.get(), settings.content);
        let room = link.outgoing.buffer();
        let has_counted = settings.counted < settings.signals;
        if has_counted {
            let port = usize::try_from(settings.counted).unwrap_or(usize::MAX);
            let samples = usize::try_from(settings.samples).unwrap_or(usize::MAX);
            let counted_at = usize::try_from(settings.counted_at).unwrap_or(usize::MAX);
            let Some((_, values)) = room.split_at_checked(counted_at) else { return };
            let Some((_, counters)) = room.split_at_checked(samples) else { return };
            send_counted(context, context.port(port), values, counters);
        }
        if settings.signals > u32::from(has_counted) {
            send_uncounted(context, room);
        }
    }
}

impl Settings {
    fn layout(&self) -> Layout {
        let Self { every_ticks, has_counters, axis, .. } = *self;
        Layout { every_ticks, has_counters, axis }
    }
}

/// Writes the signals without counters into the packet.
#[inline(never)]
fn send_uncounted(context: &Context<'_, CommTx>, room: &[Cell<u32>; MAX_PACKET_WORDS]) {
    let Settings { signals, counted, mut parts, .. } = context.settings();
    let mut room = room.as_slice();
    for (place, sample) in (0..signals).zip(context.ports().samples) {
        let sample = parts.next(context.words(sample));
        let Some(values) = room.split_off(..sample.len()) else { return };
        if place != counted {
            values.iter().zip(sample).for_each(|(value, word)| value.set(word.get()));
        }
    }
}

/// Writes the wave that has counters, and its counters, into the packet.
#[inline(always)]
fn send_counted(context: &Context<'_, CommTx>, sample: Input, values: &[Cell<u32>], counters: &[Cell<u32>]) {
    let period_s = context.settings().period_s;
    let (counters, _) = counters.as_chunks::<2>();
    // Slices of length `dof`: bounds are checked once.
    let dof = context.dof();
    let Some((values, counters)) = values.get(..dof).zip(counters.get(..dof)) else { return };
    context.map_axis_contexts([sample], [], |axis, lane, [wave]| {
        let Some((value, [wave_count, energy_count])) = values.get(axis).zip(counters.get(axis)) else {
            return [];
        };
        let mut sent = lane.axis();
        let (wave, [waves, energies]) = sent.add(wave, period_s);
        lane.set_axis(sent);
        value.set(wave.to_bits());
        wave_count.set(waves);
        energy_count.set(energies);
        []
    });
}

/// Adds this tick's waves to their means. Returns whether the packet is due.
#[cold]
fn gather(context: &Context<'_, CommTx>, link: &LinkPort) -> bool {
    let (mut state, every_ticks) = (context.state(), context.settings().every_ticks);
    let is_first = state.ticks_since_sent == 0;
    state.ticks_since_sent += 1;
    let is_last = state.ticks_since_sent >= every_ticks;
    #[expect(clippy::cast_precision_loss, reason = "at most 100")]
    let share = if is_last { 1.0 / every_ticks as f32 } else { 1.0 };
    for (input, block) in context.ports().inputs.iter().zip(context.ports().blocks) {
        // A signal that is not a wave has no memory.
        for (sum, wave) in context.memory(block).iter().zip(context.words(*input)) {
            let before = if is_first { 0.0 } else { f32::from_bits(sum.get()) };
            sum.set((share * (before + f32::from_bits(wave.get()))).to_bits());
        }
    }
    link.ticks_since_sent.set(state.ticks_since_sent);
    if is_last {
        state.ticks_since_sent = 0;
    }
    context.set_state(state);
    is_last
}
