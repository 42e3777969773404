//! `COMM_RX`: takes the newest packet from its link and gives its data to the Data Base.
//!
//! A packet is used once: old and repeated ones are refused and counted. `STALE` says what a wave is
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

use super::comm_tx::CHANNEL_PORTS;
use super::wave_integral::Received;
use crate::limits::{MAX_CHANNEL_TYPES, MAX_DOF};
use crate::parameter::TypeList;
use crate::{
    Choice, Data, DeviceDescriptor, LinkPort, Module, Output, Parameters, Ports, Single, Unit, is_newer,
    types,
};

/// See the [module docs](self).
#[derive(Debug, Default)]
pub struct CommRx {
    link: u32,
    types: TypeList,
    stale: Stale,
    hold_ticks: u32,
    channels: [Channel; MAX_CHANNEL_TYPES],
    packet_words: usize,
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
    /// Newest one accepted; the number before a sender's first.
    sequence: u32,
    is_restart: bool,
    age_ticks: u32,
    lost: u32,
    refused: u32,
    round_trip_ticks: u32,
    received: [Received; MAX_DOF],
}

/// Silence after which an older sequence number means that the sender has started anew.
const RESTART_TICKS: u32 = 100;

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
        visit.count(&mut self.link, "CRX_LINK", Unit::One, 0..=1, 0, "Link it listens to.");
        visit.choice(&mut self.stale, "STALE", "What a wave is while nothing new comes.");
        let summary = "Longest time a wave is held by STALE HOLD.";
        visit.count(&mut self.hold_ticks, "HOLD_TICKS", Unit::Tick, 0..=100_000, 20, summary);
    }

    fn activate(&mut self, ports: &mut Ports<'_>) {
        let mut wave_found = false;
        for ((channel, signal), name) in self.channels.iter_mut().zip(&self.types).zip(CHANNEL_PORTS) {
            ports.named_output(&mut channel.output, name, *signal);
            let is_wave = ports.device().data_type(signal.id).is_some_and(|found| found.unit == Unit::Wave);
            channel.is_wave = is_wave && !wave_found;
            wave_found |= is_wave;
        }
        let dof = ports.device().dof();
        self.packet_words = self.types.len() * dof + if wave_found { 2 * dof } else { 0 };
        ports.output(&mut self.age, "AGE", types::LINK_AGE);
        ports.output(&mut self.lost, "LOST", types::LINK_LOST);
        ports.output(&mut self.round_trip, "ROUND_TRIP", types::LINK_ROUND_TRIP);
        ports.output(&mut self.refused, "REFUSED", types::LINK_REFUSED);
    }

    fn prepare(&mut self, device: &DeviceDescriptor) {
        self.period_s = device.sample_period_s();
    }

    fn compute(&mut self, data: &Data<'_>) {
        let Some(link) = data.link(self.link) else { return };
        if self.state.accept(link, self.packet_words) {
            self.take(data, link.received.words());
            self.state.age_ticks = 0;
        } else {
            self.state.age_ticks = self.state.age_ticks.saturating_add(1);
            self.stale_waves(data);
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
    fn take(&mut self, data: &Data<'_>, words: &[Cell<u32>]) {
        let mut words = words.iter();
        for channel in self.channels.iter().take(self.types.len()) {
            let sinks = data.words_out(channel.output);
            for (sink, word) in sinks.iter().zip(words.by_ref()) {
                sink.set(word.get());
            }
            if !channel.is_wave {
                continue;
            }
            for (received, sink) in self.state.received.iter_mut().zip(sinks) {
                let mut counter = || words.next().map_or(0, Cell::get);
                received.update([counter(), counter()]);
                if self.state.is_restart {
                    // What was sent before this side listened is not owed.
                    received.settle();
                }
                match self.stale {
                    Stale::Zero | Stale::Hold => received.settle(),
                    Stale::Limited => sink.set(received.owed_within_energy(self.period_s).to_bits()),
                    Stale::Integral => sink.set(received.owed(self.period_s).to_bits()),
                }
            }
        }
    }

    fn stale_waves(&mut self, data: &Data<'_>) {
        let is_held = self.stale == Stale::Hold && self.state.age_ticks <= self.hold_ticks;
        for channel in self.channels.iter().take(self.types.len()).filter(|channel| channel.is_wave) {
            for (received, sink) in self.state.received.iter_mut().zip(data.words_out(channel.output)) {
                match self.stale {
                    Stale::Limited => sink.set(received.owed_within_energy(self.period_s).to_bits()),
                    _ if is_held => {}
                    _ => sink.set(0.0_f32.to_bits()),
                }
            }
        }
    }
}

impl State {
    /// Whether a new packet is there; takes note of its header.
    fn accept(&mut self, link: &LinkPort, packet_words: usize) -> bool {
        if !link.received.is_full() {
            return false;
        }
        link.received.clear();
        let sequence = link.received.sequence();
        let is_old = !is_newer(sequence, self.sequence);
        self.is_restart = is_old && self.age_ticks >= RESTART_TICKS || self.sequence == 0 && sequence != 1;
        if is_old && !self.is_restart || link.received.words().len() != packet_words {
            self.refused = self.refused.wrapping_add(1);
            return false;
        }
        if !self.is_restart {
            self.lost = self.lost.wrapping_add(sequence.wrapping_sub(self.sequence).wrapping_sub(1));
        }
        self.sequence = sequence;
        link.accepted_sequence.set(sequence);
        let echo = link.received.echo();
        if echo != 0 {
            self.round_trip_ticks = link.sent_sequence.get().wrapping_add(1).wrapping_sub(echo);
        }
        true
    }
}
