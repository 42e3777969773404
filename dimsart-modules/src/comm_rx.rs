//! `COMM_RX`: receives the packets of a channel and writes their signals to the Data Base.
//!
//! Each packet is used once. Duplicate and old packets are refused and counted, as are packets whose
//! [`Content`](dimsart_core::Content) differs from the signals added here and packets with a NaN or infinite `f32`
//! sample. The signals can have any format and shape; a wave is a signal of unit `sqrt(W)` with one `f32` per axis.
//! `STALE` selects the value of a wave in a tick without a new packet, and how lost packets are compensated:
//!
//! | Policy | Wave without a new packet | Passive | Drift after loss |
//! |---|---|---|---|
//! | `ZERO` | 0 | yes | yes |
//! | `HOLD` | the last value for up to `HOLD_TICKS`, then 0 | no | little |
//! | `LIMITED` | the outstanding wave, limited by the received energy | yes | some |
//! | `INTEGRAL` | the outstanding wave, at once | no | none |
//!
//! The outstanding wave is the integral sent but not yet output. All other signals keep their last value. The policy
//! applies to the channel's first wave, whose counters total all that was ever sent; they recover an outage of up to
//! `8 sqrt(W)·s`. Without counters (`CRX_COUNTERS OFF`), only `ZERO` and `HOLD` are available.
//!
//! With `CRX_AXIS n`, packets carry only axis `n`, as sent by a single-axis device; the other axes of the signals keep
//! their values. Only `ZERO` and `HOLD` are available.
//!
//! With `CRX_EVERY n`, a packet is due every `n` ticks. Its wave is the mean of the sender's last `n` samples and is
//! output for `n` ticks, which preserves its integral and adds no energy (Jensen). An early packet waits until these
//! ticks have passed; when a packet is due and missing, the policy applies.
//!
//! Varying network delay bunches packets, which costs displacement or adds energy. `PLAYOUT_TICKS n` is a jitter buffer
//! for `LIMITED` and `INTEGRAL`: the content of a packet is spread evenly up to `n` ticks after the arrival time of the
//! fastest packet. A mean has no more energy than its samples (Jensen), so the link stays passive and still recovers
//! losses, as long as no packet is more than `n` ticks later than the fastest one. The wave is delayed by `n` ticks.
//!
//! After `TIMEOUT_TICKS` consecutive ticks without a due packet the link is lost: the device receives its safe value
//! ([`TickResult::LinkLost`](dimsart_core::TickResult)) until `RESET` or `MOD_RESET`; the scheme is still computed. Before the
//! first packet, the timeout counts from the module's start or reset and the link is then down
//! ([`TickResult::LinkDown`](dimsart_core::TickResult)): the device receives its safe value until that packet arrives.
//! [`LinkState`](dimsart_core::LinkState) reports the state of every tick.

use core::cell::Cell;

use crate::channel::{
    ALL_AXES, AXES, CHANNEL_PORTS, CHANNELS, EVERY_TICKS, LINKS, Layout, Parts, Prepared, first_wave, not_f32,
};
use crate::reception::{Came, Expected, Reception};
use crate::wave_integral::ReceivedTotals;
use dimsart_core::limits::{MAX_CHANNEL_TYPES, MAX_PACKET_WORDS};
use dimsart_core::mailbox::{counter_distance, low_u16};
use dimsart_core::parameter::TypeList;
use dimsart_core::{
    AxisContext, Context, Declarations, DeviceDescriptor, LinkPort, Module, Output, ParameterError,
    Parameters, ScalarSignal, Unit, Untyped, choice, types, words,
};

choice! {
    /// Policy for a wave without a new packet.
    pub enum StalePolicy { Hold = "HOLD", Zero = "ZERO", Limited = "LIMITED", Integral = "INTEGRAL" }
}

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        types: TypeList,
        link: u32,
        channel: u32,
        stale: StalePolicy,
        hold_ticks: u32,
        has_counters: bool,
        axis: u32,
        parts: Parts,
        expected: Expected,
        playout_ticks: u32,
        /// Number of signals in the channel.
        signals: u32,
        /// Bit mask of the signals that are not `f32`.
        not_f32: u32,
        /// Index of the wave whose counters are in the packet; `u32::MAX` without one.
        counted: u32,
        /// Index of its first word in the packet.
        counted_at: u32,
        tick_s: f32,
        /// Time for which a packet's wave is output.
        period_s: f32,
    }
    /// State common to all axes.
    pub struct State {
        reception: Reception,
        /// Ticks left to output the outstanding wave, including this one.
        left_ticks: u16,
        /// Playout delay of the last tick.
        playout_ticks: u32,
    }
    /// Ports; the signals of the channel come first.
    pub ports Ports {
        channel: [Output<Untyped>; MAX_CHANNEL_TYPES],
        /// The channel's first wave; unconnected without one.
        wave: Output,
        age: Output<ScalarSignal<u32>>,
        lost: Output<ScalarSignal<u32>>,
        round_trip: Output<ScalarSignal<u32>>,
        refused: Output<ScalarSignal<u32>>,
        state: Output<ScalarSignal<u32>>,
        jitter: Output<ScalarSignal<f32>>,
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct CommRx;

impl Module for CommRx {
    const NAME: &'static str = "COMM_RXMOD";
    const SUMMARY: &'static str = "Receives the signals of a channel from the peer.";
    const KEEPS_STATE_ON_ARMING: bool = true;
    type Settings = Settings;
    type Gains = ();
    type State = State;
    type AxisState = ReceivedTotals;
    type Ports = Ports;

    fn parameters(settings: &mut Settings, _: &mut (), visit: &mut Parameters<'_>) {
        visit.types(&mut settings.types, "CRX_ADD_DATA", "Add a signal to the received packet.");
        visit.structural_count(&mut settings.link, "CRX_LINK", Unit::One, LINKS, 0, "Link to receive from.");
        visit.choice(&mut settings.stale, "STALE", "Policy for the wave in a tick without a new packet.");
        let summary = "Maximum time that STALE HOLD holds a wave.";
        visit.count(&mut settings.hold_ticks, "HOLD_TICKS", Unit::Tick, 0..=100_000, 20, summary);
        let summary = "Channel to receive; 0 on a point-to-point link.";
        visit.structural_count(&mut settings.channel, "CRX_CHANNEL", Unit::One, CHANNELS, 0, summary);
        let summary = "Ticks per packet; must equal CTX_EVERY of the sender.";
        let every = &mut settings.expected.every_ticks;
        visit.structural_count(every, "CRX_EVERY", Unit::Tick, EVERY_TICKS, 1, summary);
        let summary = "Packets carry counters; must equal CTX_COUNTERS of the sender.";
        visit.structural_flag(&mut settings.has_counters, "CRX_COUNTERS", true, summary);
        let summary = "Ticks without a due packet until the link is lost; 0: never.";
        let timeout = &mut settings.expected.timeout_ticks;
        visit.count(timeout, "TIMEOUT_TICKS", Unit::Tick, 0..=1_000_000, 20, summary);
        let summary = "Jitter buffer delay for STALE LIMITED and INTEGRAL.";
        visit.count(&mut settings.playout_ticks, "PLAYOUT_TICKS", Unit::Tick, 0..=1000, 0, summary);
        let summary = "Axis of single-axis packets, which have no counters; 8: all axes.";
        visit.structural_count(&mut settings.axis, "CRX_AXIS", Unit::One, AXES, ALL_AXES, summary);
    }

    fn validate(settings: &Settings) -> Result<(), ParameterError> {
        match settings.stale.makes_up() && !(settings.has_counters && settings.axis == ALL_AXES) {
            true => Err(ParameterError::NeedsCounters),
            false => Ok(()),
        }
    }

    fn prepare(settings: &mut Settings, device: &DeviceDescriptor) {
        settings.tick_s = device.sample_period_s();
        let Prepared { content, samples, parts, counted, counted_at, period_s } =
            settings.layout().prepare(device, &settings.types);
        (settings.expected.content, settings.expected.samples, settings.parts) = (content, samples, parts);
        (settings.counted, settings.counted_at, settings.period_s) = (counted, counted_at, period_s);
        settings.signals = u32::try_from(settings.types.len()).unwrap_or(0);
        settings.not_f32 = not_f32(device, &settings.types);
    }

    fn ports(settings: &Settings, declare: &mut Declarations<'_>) -> Ports {
        let mut ports = Ports::default();
        let wave = first_wave(declare.device(), &settings.types);
        for (place, ((signal, name), port)) in
            settings.types.iter().zip(CHANNEL_PORTS).zip(&mut ports.channel).enumerate()
        {
            let Some(data_type) = declare.device().data_type(signal.id) else { continue };
            *port = declare.default_signal(*signal).output(name, data_type);
            if wave == Some(place) {
                ports.wave = port.as_vector();
            }
        }
        let layout = settings.layout();
        declare.set_packet_words(layout.packet_words(declare.device(), &settings.types));
        declare.requires_axis(layout.has_axis(declare.device()));
        declare.receives_from(settings.link, settings.channel);
        ports.age = declare.output("AGE", types::LINK_AGE);
        ports.lost = declare.output("LOST", types::LINK_LOST);
        ports.round_trip = declare.output("ROUND_TRIP", types::LINK_ROUND_TRIP);
        ports.refused = declare.output("REFUSED", types::LINK_REFUSED);
        ports.state = declare.output("STATE", types::LINK_STATE);
        ports.jitter = declare.output("JITTER", types::LINK_JITTER);
        ports
    }

    fn begin(context: &Context<'_, Self>) {
        context.clear_axes();
        let playout_ticks = context.settings().playout_ticks;
        context.set_state(State { playout_ticks, ..State::default() });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let settings = context.settings();
        let Some(link) = context.link(settings.link) else { return };
        let mut state = context.state();
        let is_usual = settings.playout_ticks | state.playout_ticks == 0
            && state.reception.accept_next(link, &settings.expected);
        let came = if is_usual {
            context.set_state(state);
            link.received.clear();
            state.reception.acknowledge(link);
            Some(Came::Next)
        } else {
            let came = accept_unusual(context, link);
            state = context.state();
            came
        };
        match came {
            Some(came) => take(context, came, state.left_ticks, link.received.buffer()),
            None => go_without(context),
        }
        show(context, &state.reception, link);
    }
}

impl Settings {
    fn layout(&self) -> Layout {
        let Self { expected: Expected { every_ticks, .. }, has_counters, axis, .. } = *self;
        Layout { every_ticks, has_counters, axis }
    }
}

/// Accepts a packet in the slow cases: no packet, not the next in sequence, or playout active. Returns how it arrived.
#[inline(never)]
fn accept_unusual(context: &Context<'_, CommRx>, link: &LinkPort) -> Option<Came> {
    let mut settings = context.settings();
    let received = &link.received;
    if settings.not_f32 != 0 && received.is_full() && are_finite(context, received.words()) {
        // All f32 samples are finite; the link's count, which treats every word as f32, does not apply.
        settings.expected.samples = 0;
    }
    let State { mut reception, mut left_ticks, playout_ticks } = context.state();
    if playout_ticks != settings.playout_ticks {
        left_ticks = low_u16(settings.playout_ticks);
    }
    let plays_out = settings.playout_ticks != 0 && settings.stale.makes_up();
    if plays_out {
        left_ticks = left_ticks.saturating_sub(1);
        reception.hold_no_more();
    }
    let before = reception.counter();
    let mut came = if reception.is_holding() {
        reception.hold(link);
        Some(Came::Held)
    } else {
        reception.accept(link, &settings.expected)
    };
    if let Some(came) = came.as_mut().filter(|_| plays_out) {
        left_ticks = play_out(&mut reception, came, &settings, before, left_ticks);
    }
    context.set_state(State { reception, left_ticks, playout_ticks: settings.playout_ticks });
    came
}

/// Checks that all `f32` samples are finite, in a packet that also has other words.
#[cold]
fn are_finite(context: &Context<'_, CommRx>, mut words: &[Cell<u32>]) -> bool {
    let Settings { signals, mut not_f32, mut parts, .. } = context.settings();
    for place in 0..usize::try_from(signals).unwrap_or(0) {
        let output: Output<Untyped> = context.port(place);
        let Some(own) = words.split_off(..parts.next(context.words_out(output)).len()) else { return false };
        let is_not_finite = |word: &Cell<u32>| !f32::from_bits(word.get()).is_finite();
        if not_f32 & 1 == 0 && own.iter().any(is_not_finite) {
            return false;
        }
        not_f32 >>= 1;
    }
    true
}

/// Writes the link statistics to the ports.
#[inline(always)]
fn show(context: &Context<'_, CommRx>, reception: &Reception, link: &LinkPort) {
    let Ports { age, lost, round_trip, refused, state, jitter, .. } = context.ports();
    context.set(age, reception.age_ticks);
    context.set(lost, reception.lost);
    context.set(round_trip, reception.round_trip_ticks);
    context.set(refused, reception.refused.wrapping_add(link.superseded.get()));
    context.set(state, reception.state(link) as u32);
    context.set(jitter, reception.jitter_ticks);
}

/// Writes a packet's signals to the Data Base; the wave unchanged or with losses recovered.
#[inline(always)]
fn take(context: &Context<'_, CommRx>, came: Came, left_ticks: u16, words: &[Cell<u32>; MAX_PACKET_WORDS]) {
    let Settings { signals, counted, counted_at, expected, .. } = context.settings();
    if came == Came::Held {
        return;
    }
    let has_counted = counted < signals;
    if has_counted {
        let port = usize::try_from(counted).unwrap_or(usize::MAX);
        let samples = usize::try_from(expected.samples).unwrap_or(usize::MAX);
        let counted_at = usize::try_from(counted_at).unwrap_or(usize::MAX);
        let Some((_, values)) = words.split_at_checked(counted_at) else { return };
        let Some((_, counters)) = words.split_at_checked(samples) else { return };
        take_counted(context, came, left_ticks, context.port(port), values, counters);
    }
    if signals > u32::from(has_counted) {
        take_uncounted(context, words);
    }
}

/// Writes the signals without counters to the Data Base.
#[inline(never)]
fn take_uncounted(context: &Context<'_, CommRx>, words: &[Cell<u32>; MAX_PACKET_WORDS]) {
    let Settings { signals, counted, mut parts, .. } = context.settings();
    let mut words = words.as_slice();
    for (place, output) in (0..signals).zip(context.ports().channel) {
        let output = parts.next(context.words_out(output));
        let Some(values) = words.split_off(..output.len()) else { return };
        if place != counted {
            output.iter().zip(values).for_each(|(word, value)| word.set(value.get()));
        }
    }
}

/// Writes the wave that has counters.
#[inline(always)]
fn take_counted(
    context: &Context<'_, CommRx>,
    came: Came,
    left_ticks: u16,
    output: Output,
    values: &[Cell<u32>],
    counters: &[Cell<u32>],
) {
    // Waves sent before this side started are not outstanding.
    let settles = came == Came::Restarted || !context.settings().stale.makes_up();
    let (counters, _) = counters.as_chunks::<2>();
    // Slices of length `dof`: bounds are checked once.
    let dof = context.dof();
    let Some((values, counters)) = values.get(..dof).zip(counters.get(..dof)) else { return };
    context.map_axis_contexts([], [output], |axis, lane, []| {
        let Some((value, [wave, energy])) = values.get(axis).zip(counters.get(axis)) else { return [0.0] };
        let counters = [wave.get(), energy.get()];
        let mut received = lane.axis();
        if settles || came == Came::Next && received.is_settled() {
            received.settle(counters);
            lane.set_axis(received);
            [f32::from_bits(value.get())]
        } else {
            [pay_new(context, &lane, counters, left_ticks)]
        }
    });
}

/// Spreads the content of a new packet over its ticks; `before` is the counter of the packet before. Returns the ticks
/// left.
#[cold]
fn play_out(
    reception: &mut Reception,
    came: &mut Came,
    settings: &Settings,
    before: u16,
    left_ticks: u16,
) -> u16 {
    let every_ticks = settings.expected.every_ticks;
    let packets = counter_distance(reception.counter(), before).max(1);
    let brought_ticks = packets.saturating_mul(low_u16(every_ticks));
    let max_ticks = low_u16(every_ticks + settings.playout_ticks);
    reception.hold_no_more();
    if *came == Came::Restarted {
        return max_ticks;
    }
    // During playout, no wave passes unchanged.
    *came = Came::AfterLoss;
    // A faster packet than all before, or a fast clock of the sender, shortens the schedule.
    left_ticks.saturating_add(brought_ticks).min(max_ticks)
}

/// Applies the policy in a tick without a new packet.
#[inline(never)]
fn go_without(context: &Context<'_, CommRx>) {
    let Settings { stale, hold_ticks, expected, tick_s, .. } = context.settings();
    let State { reception, left_ticks, .. } = context.state();
    match stale {
        StalePolicy::Hold if reception.overdue_ticks(expected.every_ticks) <= hold_ticks => {}
        StalePolicy::Limited | StalePolicy::Integral => {
            context.map_axes([], [context.ports().wave], |(), received, []| {
                [stale.pay(received, tick_s, left_ticks)]
            });
        }
        _ => context.data().map_axes([], [context.ports().wave], |_, []| [0.0]),
    }
}

impl StalePolicy {
    /// Checks whether the policy recovers lost waves, which needs counters.
    fn makes_up(self) -> bool {
        matches!(self, Self::Limited | Self::Integral)
    }

    /// Returns the part of the outstanding wave to output now, with `ticks` left. Cold: losses are rare.
    #[cold]
    fn pay(self, received: &mut ReceivedTotals, period_s: f32, ticks: u16) -> f32 {
        received.pay(period_s, ticks, self == Self::Limited)
    }
}

/// Returns the wave to output after a new packet: over the packet's period, or per tick during playout.
#[cold]
#[inline(never)]
fn pay_new(
    context: &Context<'_, CommRx>,
    lane: &AxisContext<'_, CommRx>,
    counters: [u32; 2],
    ticks: u16,
) -> f32 {
    let Settings { stale, period_s, tick_s, .. } = context.settings();
    let mut received = lane.axis();
    received.update(counters);
    let wave = stale.pay(&mut received, if ticks == 0 { period_s } else { tick_s }, ticks);
    lane.set_axis(received);
    wave
}
