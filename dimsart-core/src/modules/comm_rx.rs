//! `COMM_RX`: takes the newest packet from its link and gives its data to the Data Base.
//!
//! A packet is used once: old and repeated ones are refused and counted. So are those of another
//! [`Content`] than that of the types added here, and those with a sample that is no finite number: to the
//! rest of the scheme they never came. `STALE` says what a wave is
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
//! counters of all that was ever sent.

use core::cell::Cell;

use heapless::Vec;

use super::channel::{CHANNEL_PORTS, CHANNELS, content, first_wave, samples};
use super::wave_integral::Received;
use crate::limits::{MAX_CHANNEL_TYPES, MAX_DOF};
use crate::mailbox::{START_COUNTERS, counters_ahead, is_newer, low_half};
use crate::parameter::TypeList;
use crate::{
    Choice, Content, Data, DeviceDescriptor, LinkPort, Module, Output, Parameters, Ports, Single, Unit, types,
};

/// See the [module docs](self).
#[derive(Debug, Default)]
pub struct CommRx {
    link: u32,
    channel: u32,
    types: TypeList,
    stale: Stale,
    hold_ticks: u32,
    channels: Vec<Channel, MAX_CHANNEL_TYPES>,
    /// The channel's first wave; not connected when there is none.
    wave: Output,
    content: Content,
    /// Words of the packet that are samples; counters follow.
    samples: u8,
    age: Output<Single<u32>>,
    lost: Output<Single<u32>>,
    round_trip: Output<Single<u32>>,
    refused: Output<Single<u32>>,
    period_s: f32,
    state: State,
}

#[derive(Debug, Default)]
struct Channel {
    output: Output,
    is_wave: bool,
}

#[derive(Debug, Default)]
struct State {
    /// Of the newest packet accepted; 0 before the first.
    counter: u16,
    /// What may be the first packet of a sender that has started anew, and the newest one accepted then.
    restart: [u16; 2],
    is_restart: bool,
    /// Whether the newest packet is the one right after the one before it.
    is_next: bool,
    age_ticks: u32,
    lost: u32,
    refused: u32,
    round_trip_ticks: u32,
    received: [Received; MAX_DOF],
}

/// Silence after which two packets that are not next ones, the second newer than the first, mean that the
/// sender has started anew.
const RESTART_TICKS: u32 = 100;
/// Ticks of packets that can be missing at once beyond those that nothing came in: packets that were late together.
/// A longer way ahead is none that a sender can have gone.
const LATE_TICKS: u32 = 1000;

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
        let summary = "Channel that it listens to; 0 on a link between two ends.";
        visit.structural_count(&mut self.channel, "CRX_CHANNEL", Unit::One, CHANNELS, 0, summary);
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
            let _ = self.channels.push(Channel { output, is_wave });
        }
        ports.listens_to(self.link, self.channel);
        ports.output(&mut self.age, "AGE", types::LINK_AGE);
        ports.output(&mut self.lost, "LOST", types::LINK_LOST);
        ports.output(&mut self.round_trip, "ROUND_TRIP", types::LINK_ROUND_TRIP);
        ports.output(&mut self.refused, "REFUSED", types::LINK_REFUSED);
    }

    fn prepare(&mut self, device: &DeviceDescriptor) {
        self.period_s = device.sample_period_s();
        self.content = content(device, &self.types);
        self.samples = samples(device, &self.types);
    }

    fn compute(&mut self, data: &Data<'_>) {
        let Some(link) = data.link(self.link) else { return };
        if self.state.accept(link, self.content, self.samples) {
            self.state.age_ticks = 0;
            self.take(data, link.received.room());
        } else {
            self.state.age_ticks = self.state.age_ticks.saturating_add(1);
            self.go_without(data);
        }
        data.set(self.age, self.state.age_ticks);
        data.set(self.lost, self.state.lost);
        data.set(self.round_trip, self.state.round_trip_ticks);
        data.set(self.refused, self.state.refused.wrapping_add(link.superseded.get()));
    }

    fn reset(&mut self) {
        self.state = State::default();
    }
}

impl CommRx {
    /// Gives a packet's signals to the Data Base; its wave as it is, or with what got lost made up for.
    fn take(&mut self, data: &Data<'_>, words: &[Cell<u32>]) {
        let (mut samples, counters) = (words, usize::from(self.samples));
        let Self { stale, period_s, .. } = *self;
        // What was sent before this side listened is not owed.
        let settles = self.state.is_restart || !matches!(stale, Stale::Limited | Stale::Integral);
        let is_next = self.state.is_next;
        for channel in &self.channels {
            let Some((values, rest)) = samples.split_at_checked(data.dof()) else { return };
            samples = rest;
            if channel.is_wave {
                let Some(counters) = words.get(counters..counters + 2 * data.dof()) else { return };
                let (counters, _) = counters.as_chunks::<2>();
                let lanes = values.iter().zip(&mut self.state.received).zip(counters);
                data.map_axes(lanes, [], [channel.output], |((value, received), [wave, energy]), []| {
                    let counters = [wave.get(), energy.get()];
                    if settles || is_next && received.is_settled() {
                        received.settle(counters);
                        return [f32::from_bits(value.get())];
                    }
                    [stale.pay(received, counters, period_s)]
                });
            } else {
                data.map_axes(values, [], [channel.output], |value, []| [f32::from_bits(value.get())]);
            }
        }
    }

    /// What the wave is in a tick without a new packet.
    fn go_without(&mut self, data: &Data<'_>) {
        match self.stale {
            Stale::Hold if self.state.age_ticks <= self.hold_ticks => {}
            Stale::Limited => {
                let period_s = self.period_s;
                data.map_axes(&mut self.state.received, [], [self.wave], |received, []| {
                    [received.owed_within_energy(period_s)]
                });
            }
            _ => data.map_axes([(); MAX_DOF], [], [self.wave], |(), []| [0.0]),
        }
    }
}

impl Stale {
    /// What the policy gives out as wave of what the line owes; rare, as packets seldom get lost.
    #[cold]
    fn pay(self, received: &mut Received, counters: [u32; 2], period_s: f32) -> f32 {
        received.update(counters);
        if self == Self::Limited { received.owed_within_energy(period_s) } else { received.owed(period_s) }
    }
}

impl State {
    /// Whether a new packet is there; takes note of its header.
    fn accept(&mut self, link: &LinkPort, content: Content, samples: u8) -> bool {
        if !link.received.is_full() {
            return false;
        }
        link.received.clear();
        let (counter, echo) = (link.received.counter(), link.received.echo());
        if link.received.content() != content || link.received.finite_words() < samples {
            self.refused = self.refused.wrapping_add(1);
            return false;
        }
        self.is_restart = false;
        self.is_next = counter == self.counter.wrapping_add(1);
        if !self.is_next && !self.accept_jump(counter) {
            self.refused = self.refused.wrapping_add(1);
            return false;
        }
        self.counter = counter;
        link.accepted_counter.set(counter);
        if echo != 0 {
            self.measure_round_trip(link.sent_number.get(), echo);
        }
        true
    }

    fn measure_round_trip(&mut self, sent_number: u32, echo: u16) {
        let packets = u32::from(counters_ahead(low_half(sent_number), echo));
        // Not of a life of this side before its last start.
        if packets < sent_number {
            self.round_trip_ticks = packets + 1;
        }
    }

    /// Whether a packet that is not the next one is new; counts what is missing before it.
    #[cold]
    fn accept_jump(&mut self, counter: u16) -> bool {
        if counter == self.counter {
            return false;
        }
        let missed = u32::from(counters_ahead(counter, self.counter)).wrapping_sub(1);
        // Counters go round: what seems to be ahead can come from a sender that has started anew.
        let is_start = counter <= START_COUNTERS && u32::from(self.counter) > LATE_TICKS;
        let is_ahead = !is_start
            && is_newer(counter, self.counter)
            && missed <= self.age_ticks.saturating_add(LATE_TICKS);
        let [first, accepted] = self.restart;
        let follows_first = accepted == self.counter && is_newer(counter, first);
        if self.counter == 0 || is_ahead && follows_first && first <= START_COUNTERS {
            self.is_restart = true;
        } else if is_ahead {
            self.is_next = missed == 0;
            self.lost = self.lost.wrapping_add(missed);
        } else {
            let is_silent = self.age_ticks >= RESTART_TICKS;
            if is_silent || is_start {
                self.restart = [counter, self.counter];
            }
            self.is_restart = is_silent && follows_first;
        }
        if self.is_restart {
            self.round_trip_ticks = 0;
        }
        self.is_restart || is_ahead
    }
}
