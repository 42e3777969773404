//! `COMM_RX`: takes the newest packet from its link and gives its data to the Data Base.
//!
//! A packet is used once: old and repeated ones are refused and counted. So are those of another
//! [`Content`](crate::Content) than that of the types added here, and those with a sample that is no finite number:
//! to the rest of the scheme they never came. `STALE` says what a wave is
//! in a tick without a new packet, and how what got lost is made up for:
//!
//! | Policy | Wave without a new packet | Passive | Drift after loss |
//! |---|---|---|---|
//! | `ZERO` | 0 | yes | yes |
//! | `HOLD` | the last one, for at most `HOLD_TICKS`, then 0 | no | little |
//! | `LIMITED` | what the line owes, as far as received energy allows | yes | some |
//! | `INTEGRAL` | what the line owes, at once | no | none |
//!
//! All other signals keep their last value. The channel's first wave follows the policy with its
//! counters of all that was ever sent; without them (`CRX_COUNTERS OFF`) only `ZERO` and `HOLD` are possible.
//!
//! With `CRX_EVERY n` a packet is due in every `n`-th tick. A wave is then the mean of the sender's `n` last ones and
//! is given out for `n` ticks, which keeps its sum and adds no energy (Jensen). A packet that is early waits until
//! they are over, and in a tick in which one is due and none is there the policy begins.
//!
//! Packets that take longer at times than at others come bunched, and a wave that is not given out evenly either loses
//! displacement or adds energy. `PLAYOUT_TICKS n` evens that out under `LIMITED` and `INTEGRAL`: all that a packet
//! brings is given out evenly by `n` ticks after what the fastest packet would have come in time for. A mean has no more
//! energy than what it is the mean of (Jensen), so the line stays passive and makes up for what got lost, too, as long
//! as no packet is more than `n` ticks later than the fastest one; the wave is `n` ticks later throughout.
//!
//! After `TIMEOUT_TICKS` in a row without a packet that was due, once a first one had come, the link is lost: from
//! that tick on the device gets its safe input ([`Tick::LinkLost`](crate::Tick)), though everything goes on being
//! computed, until a `RESET` or `MOD_RESET`. [`LinkState`](crate::LinkState) says in every tick what the link is in.

use core::cell::Cell;

use heapless::Vec;

use super::channel::{CHANNEL_PORTS, CHANNELS, EVERY_TICKS, Layout, first_wave, samples};
use super::reception::{Expected, Reception};
use super::wave_integral::Received;
use crate::limits::{MAX_CHANNEL_TYPES, MAX_DOF};
use crate::mailbox::{counters_ahead, low_half};
use crate::parameter::TypeList;
use crate::{
    Choice, Data, DeviceDescriptor, Module, Output, ParameterError, Parameters, Ports, Single, Unit, Value,
    types,
};

/// See the [module docs](self).
#[derive(Debug, Default)]
pub struct CommRx {
    link: u32,
    channel: u32,
    types: TypeList,
    stale: Stale,
    hold_ticks: u32,
    has_counters: bool,
    channels: Vec<Channel, MAX_CHANNEL_TYPES>,
    /// The channel's first wave; not connected when there is none.
    wave: Output,
    expected: Expected,
    age: Output<Single<u32>>,
    lost: Output<Single<u32>>,
    round_trip: Output<Single<u32>>,
    refused: Output<Single<u32>>,
    state: Output<Single<u32>>,
    jitter: Output<Single<f32>>,
    tick_s: f32,
    /// Time that a packet's wave is given out for.
    period_s: f32,
    playout_ticks: u32,
    /// Ticks in which what is owed is to be given out, this one included.
    left_ticks: u16,
    reception: Reception,
    received: [Received; MAX_DOF],
}

#[derive(Debug, Default)]
struct Channel {
    output: Output,
    /// Whether it is the wave whose counters are in the packet.
    is_counted: bool,
}

/// What a wave is while nothing new comes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
enum Stale {
    #[default]
    Zero,
    Hold,
    Limited,
    Integral,
}

impl Choice for Stale {
    const VALUES: &'static [Self] = &[Self::Zero, Self::Hold, Self::Limited, Self::Integral];
    const NAMES: &'static [&'static str] = &["ZERO", "HOLD", "LIMITED", "INTEGRAL"];
}

impl Module for CommRx {
    const NAME: &'static str = "COMM_RXMOD";
    const SUMMARY: &'static str = "Receives signals from the other side.";

    fn parameters(&mut self, visit: &mut Parameters<'_>) {
        visit.types(&mut self.types, "CRX_ADD_DATA", "Adds a signal that the packet brings.");
        visit.structural_count(&mut self.link, "CRX_LINK", Unit::One, 0..=1, 0, "Link it listens to.");
        visit.choice(&mut self.stale, "STALE", "What a wave is while nothing new comes.");
        let summary = "Longest time a wave is held by STALE HOLD.";
        visit.count(&mut self.hold_ticks, "HOLD_TICKS", Unit::Tick, 0..=100_000, 20, summary);
        let summary = "Channel it listens to; 0 between two ends.";
        visit.structural_count(&mut self.channel, "CRX_CHANNEL", Unit::One, CHANNELS, 0, summary);
        let summary = "Ticks from a packet to the next one, as CTX_EVERY.";
        let every = &mut self.expected.every_ticks;
        visit.structural_count(every, "CRX_EVERY", Unit::Tick, EVERY_TICKS, 1, summary);
        let summary = "Whether packets carry counters, as CTX_COUNTERS.";
        visit.structural_flag(&mut self.has_counters, "CRX_COUNTERS", true, summary);
        let summary = "Ticks without a due packet after which the link is lost; 0: never.";
        let timeout = &mut self.expected.timeout_ticks;
        visit.count(timeout, "TIMEOUT_TICKS", Unit::Tick, 0..=1_000_000, 20, summary);
        let summary = "Delay that evens out jitter under STALE LIMITED and INTEGRAL.";
        visit.count(&mut self.playout_ticks, "PLAYOUT_TICKS", Unit::Tick, 0..=1000, 0, summary);
    }

    fn command(
        &mut self,
        parameter: u8,
        axis: Option<u8>,
        value: Value,
        may_restructure: bool,
    ) -> Result<(), ParameterError> {
        let before = (self.stale, self.has_counters);
        let playout_ticks = self.playout_ticks;
        let mut result = Ok(());
        self.parameters(&mut Parameters::set(parameter, axis, value, may_restructure, &mut result));
        if !self.has_counters && self.stale.makes_up() {
            (self.stale, self.has_counters) = before;
            return Err(ParameterError::NeedsCounters);
        }
        if playout_ticks != self.playout_ticks {
            self.left_ticks = low_half(self.playout_ticks);
        }
        result
    }

    fn activate(&mut self, ports: &mut Ports<'_>) {
        self.wave = Output::default();
        self.channels.clear();
        let wave = first_wave(ports.device(), &self.types);
        for (place, (signal, name)) in self.types.iter().zip(CHANNEL_PORTS).enumerate() {
            let mut output = Output::default();
            ports.named_output(&mut output, name, *signal);
            let is_wave = wave == Some(place);
            if is_wave {
                self.wave = output;
            }
            let _ = self.channels.push(Channel { output, is_counted: is_wave && self.has_counters });
        }
        ports.listens_to(self.link, self.channel);
        ports.output(&mut self.age, "AGE", types::LINK_AGE);
        ports.output(&mut self.lost, "LOST", types::LINK_LOST);
        ports.output(&mut self.round_trip, "ROUND_TRIP", types::LINK_ROUND_TRIP);
        ports.output(&mut self.refused, "REFUSED", types::LINK_REFUSED);
        ports.output(&mut self.state, "STATE", types::LINK_STATE);
        ports.output(&mut self.jitter, "JITTER", types::LINK_JITTER);
    }

    fn prepare(&mut self, device: &DeviceDescriptor) {
        self.tick_s = device.sample_period_s();
        let layout = Layout { every_ticks: self.expected.every_ticks, has_counters: self.has_counters };
        self.period_s = layout.period_s(device);
        self.expected.content = layout.content(device, &self.types);
        self.expected.samples = samples(device, &self.types);
    }

    fn compute(&mut self, data: &Data<'_>) {
        let Some(link) = data.link(self.link) else { return };
        let plays_out = self.playout_ticks != 0 && self.stale.makes_up();
        if plays_out {
            self.left_ticks = self.left_ticks.saturating_sub(1);
            self.reception.hold_no_more();
        }
        let before = self.reception.counter();
        if self.reception.is_holding() {
            self.reception.hold(link);
        } else if self.reception.accept(link, &self.expected) {
            if plays_out {
                self.play_out(before);
            }
            self.take(data, link.received.room());
        } else {
            self.go_without(data);
        }
        let reception = &self.reception;
        data.set(self.age, reception.age_ticks);
        data.set(self.lost, reception.lost);
        data.set(self.round_trip, reception.round_trip_ticks);
        data.set(self.refused, reception.refused.wrapping_add(link.superseded.get()));
        data.set(self.state, reception.state(link) as u32);
        data.set(self.jitter, reception.jitter_ticks);
    }

    fn reset(&mut self) {
        self.reception = Reception::default();
        self.received = Default::default();
        self.left_ticks = 0;
    }
}

impl CommRx {
    /// Gives a packet's signals to the Data Base; its wave as it is, or with what got lost made up for.
    fn take(&mut self, data: &Data<'_>, words: &[Cell<u32>]) {
        let (mut samples, counters) = (words, usize::from(self.expected.samples));
        let stale = self.stale;
        // What was sent before this side listened is not owed.
        let settles = self.reception.is_restart || !stale.makes_up();
        let is_next = self.reception.is_next;
        let periods_s = [self.period_s, self.tick_s];
        let left_ticks = self.left_ticks;
        for channel in &self.channels {
            let Some((values, rest)) = samples.split_at_checked(data.dof()) else { return };
            samples = rest;
            if channel.is_counted {
                let Some(counters) = words.get(counters..counters + 2 * data.dof()) else { return };
                let (counters, _) = counters.as_chunks::<2>();
                let lanes = values.iter().zip(&mut self.received).zip(counters);
                data.map_axes(lanes, [], [channel.output], |((value, received), [wave, energy]), []| {
                    let counters = [wave.get(), energy.get()];
                    if settles || is_next && received.is_settled() {
                        received.settle(counters);
                        return [f32::from_bits(value.get())];
                    }
                    [stale.pay_new(received, counters, periods_s, left_ticks)]
                });
            } else {
                data.map_axes(values, [], [channel.output], |value, []| [f32::from_bits(value.get())]);
            }
        }
    }

    /// Has what a new packet brings given out evenly in the time that is left for it; `before` was the counter then.
    #[cold]
    fn play_out(&mut self, before: u16) {
        let every_ticks = self.expected.every_ticks;
        let packets = counters_ahead(self.reception.counter(), before).max(1);
        let brought_ticks = packets.saturating_mul(low_half(every_ticks));
        let most_ticks = low_half(every_ticks + self.playout_ticks);
        // A faster packet than all before it moves the time forward, and so does a sender's clock that is fast.
        self.left_ticks = self.left_ticks.saturating_add(brought_ticks).min(most_ticks);
        if self.reception.is_restart {
            self.left_ticks = most_ticks;
        }
        // Nothing is handed through as it came, nor held.
        self.reception.is_next = false;
        self.reception.hold_no_more();
    }

    /// What the wave is in a tick without a new packet.
    fn go_without(&mut self, data: &Data<'_>) {
        match self.stale {
            Stale::Hold if self.reception.overdue_ticks(self.expected.every_ticks) <= self.hold_ticks => {}
            Stale::Limited | Stale::Integral => {
                let Self { stale, tick_s, left_ticks, .. } = *self;
                data.map_axes(&mut self.received, [], [self.wave], |received, []| {
                    [stale.pay(received, tick_s, left_ticks)]
                });
            }
            _ => data.map_axes([(); MAX_DOF], [], [self.wave], |(), []| [0.0]),
        }
    }
}

impl Stale {
    /// Whether it makes up for what got lost, which takes counters.
    fn makes_up(self) -> bool {
        matches!(self, Self::Limited | Self::Integral)
    }

    /// The same after a new packet, which stands for the first period, or for the second one in play-out.
    #[cold]
    fn pay_new(
        self,
        received: &mut Received,
        counters: [u32; 2],
        [period_s, tick_s]: [f32; 2],
        ticks: u16,
    ) -> f32 {
        received.update(counters);
        self.pay(received, if ticks == 0 { period_s } else { tick_s }, ticks)
    }

    /// What the policy gives out as wave of what the line owes, of which there are `ticks` left for; rare, as packets
    /// seldom get lost.
    #[cold]
    fn pay(self, received: &mut Received, period_s: f32, ticks: u16) -> f32 {
        received.pay(period_s, ticks, self == Self::Limited)
    }
}
