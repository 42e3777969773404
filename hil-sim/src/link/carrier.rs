//! What carries packets between the two sides of an experiment, as a scenario asks for it.

use std::path::Path;

use dimsart_core::MAX_PACKET_BYTES;
use dimsart_link::auth::Profile;
use dimsart_link::carrier::can::Assembler;

use super::can::{CanDirection, SharedBus};
use super::medium::{Medium, MediumLink, Serial};
use super::{InProcess, InProcessParameters, Link};
use crate::bus::can::{CanBus, CanFrame, CanParameters, Format, Identifier};
use crate::bus::time::{bits_ns, seconds_ns};
use crate::bus::{DatagramPath, Delay, DelayFileError, Uart};
use crate::scenario::{CarrierKind, Scenario};

/// The channels that the two ends listen to.
#[derive(Debug, Clone, Copy)]
pub struct Ends {
    /// The channel of packets that the slave listens to.
    pub forward_channel: u16,
    /// The channel of packets that the master listens to.
    pub backward_channel: u16,
}

/// Frames of a classic CAN packet at most.
const MOST_FRAMES: u32 = 16;
/// Bytes that a UART frame has more than its content.
const STREAM_BYTES: usize = 4;
/// Identifiers without a channel are 29 bits long, as if of a chip's serial number.
const MASTER_IDENTIFIER: u32 = 0x1000_0000;
const SLAVE_IDENTIFIER: u32 = 0x1000_0001;
/// Of other nodes: one half is more urgent, the other one less.
const OTHER_IDENTIFIERS: [u32; 2] = [0x0800_0000, 0x1800_0000];

/// A scenario's carrier, ready to connect stations.
#[derive(Debug)]
pub struct Carrier<'s> {
    scenario: &'s Scenario,
    period_ns: u64,
    /// Of UDP.
    delay: Delay,
}

impl<'s> Carrier<'s> {
    /// The carrier of a scenario; a file of recorded delays is read.
    ///
    /// # Errors
    /// [`DelayFileError`] when that file cannot be used.
    pub fn new(scenario: &'s Scenario) -> Result<Self, DelayFileError> {
        let delay = match scenario.link.carrier {
            CarrierKind::Udp => scenario.udp.delay(Path::new(""))?,
            _ => Delay::Constant(0.0),
        };
        Ok(Self { scenario, period_ns: seconds_ns(scenario.sample_period_s).max(1), delay })
    }

    /// Ticks from a packet's departure at the master to its echo's arrival when nothing on the way is late, over an
    /// ideal carrier; else what it hardly ever exceeds while the medium is not full. That of the link's delays is
    /// part of it, that of delay modules is not.
    ///
    /// The slave is stepped after the master: over an ideal carrier it gets what took 0 ticks in the same tick, the
    /// master what came back in 0 ticks in the next one.
    #[must_use]
    pub fn round_trip_ticks(&self) -> u32 {
        let link = &self.scenario.link;
        let backward_ticks = match link.carrier {
            CarrierKind::Ideal => link.backward_delay_ticks.max(1),
            _ => link.backward_delay_ticks,
        };
        let media_ns = self.media_ns();
        let ticks =
            media_ns.into_iter().map(|ns| u32::try_from(ns.div_ceil(self.period_ns)).unwrap_or(u32::MAX));
        ticks.fold(link.forward_delay_ticks.saturating_add(backward_ticks), u32::saturating_add)
    }

    /// What a packet of the greatest length takes on the medium, there and back, `ns`.
    fn media_ns(&self) -> [u64; 2] {
        let Scenario { link, uart, can, udp, .. } = self.scenario;
        let tag_bytes = if link.key_file.is_some() { Profile::Full.overhead() } else { 0 };
        let packet_bytes = MAX_PACKET_BYTES + tag_bytes;
        let line_ns = |bytes: usize, bits_per_byte: usize, bits_per_s: u32| {
            bits_ns((bytes * bits_per_byte) as u64, bits_per_s)
        };
        match link.carrier {
            CarrierKind::Ideal => [0; 2],
            CarrierKind::Uart => [line_ns(packet_bytes + STREAM_BYTES, 10, uart.bits_per_s); 2],
            CarrierKind::Can | CarrierKind::CanFd => {
                let (format, bytes, frames) = match link.carrier {
                    CarrierKind::Can => (Format::Classic, 8, MOST_FRAMES),
                    _ => (Format::Fd, 64, 1),
                };
                let most = CanFrame::most_wire_bits(Identifier::Extended(0), format, bytes);
                let frame_ns = CanBus::frame_ns(&CanParameters::from(&self.scenario.can), most);
                [u64::from((2 + can.other_nodes) * frames) * frame_ns; 2]
            }
            CarrierKind::Udp => {
                let bytes = packet_bytes + udp.header_bytes;
                let delay_ns = seconds_ns(self.delay.upper_s());
                [udp.forward_bits_per_s, udp.backward_bits_per_s]
                    .map(|rate| delay_ns + line_ns(bytes, 8, rate))
            }
        }
    }

    /// The links from master to slave and back. What the scenario says of delay, jitter, loss, duplication and
    /// reordering happens behind the medium.
    #[must_use]
    pub fn connect(&self, ends: Ends) -> [Box<dyn Link>; 2] {
        let Scenario { link, uart, udp, .. } = self.scenario;
        match link.carrier {
            CarrierKind::Ideal => {
                [0, 1].map(|direction| -> Box<dyn Link> { Box::new(self.behind(direction)) })
            }
            CarrierKind::Uart => [0, 1].map(|direction| {
                let remedy = "raise uart.bits_per_s, or send less often (link.every_ticks)";
                let medium = Serial::new(Uart::new(uart.into(), self.seed(2 + direction)));
                self.over("uart", direction, remedy, medium)
            }),
            CarrierKind::Can => self.can(Format::Classic, ends),
            CarrierKind::CanFd => self.can(Format::Fd, ends),
            CarrierKind::Udp => {
                [(0, udp.forward_bits_per_s), (1, udp.backward_bits_per_s)].map(|(direction, rate)| {
                    let parameters = udp.path(rate, self.delay.clone());
                    let remedy =
                        "raise udp.forward_bits_per_s and udp.backward_bits_per_s, or send less often (link.every_ticks)";
                    self.over(
                        "udp",
                        direction,
                        remedy,
                        DatagramPath::new(parameters, self.seed(2 + direction)),
                    )
                })
            }
        }
    }

    fn can(&self, format: Format, ends: Ends) -> [Box<dyn Link>; 2] {
        let identifier = |channel: u16, without: u32| match channel {
            0 => Identifier::Extended(without),
            channel => Identifier::Standard(channel),
        };
        let forward = identifier(ends.forward_channel, MASTER_IDENTIFIER);
        let mut backward = identifier(ends.backward_channel, SLAVE_IDENTIFIER);
        let remark = (backward == forward).then(|| {
            format!(
                "CAN bus: both sides send on channel {}, and two nodes of one identifier destroy each other's frames (here \
                 the slave was given another one); give each side a CTX_CHANNEL of its own, and the other one that CRX_CHANNEL",
                ends.forward_channel
            )
        });
        if remark.is_some() {
            backward = Identifier::Extended(SLAVE_IDENTIFIER);
        }
        let mut bus = CanBus::new(CanParameters::from(&self.scenario.can), self.seed(2));
        let [master, slave] = [bus.add("master", &[backward]), bus.add("slave", &[forward])];
        let others = (0..self.scenario.can.other_nodes).zip(OTHER_IDENTIFIERS.iter().cycle());
        let others = others.map(|(number, base)| {
            (bus.add(&format!("other {}", number + 1), &[]), Identifier::Extended(base + number))
        });
        let others: Vec<_> = others.collect();
        let bus = SharedBus::new(bus);
        let assembler = || match self.scenario.link.key_file {
            Some(_) => Assembler::authenticated(),
            None => Assembler::new(),
        };
        let direction = |channel, identifier, sender, receiver, others: &[_], remark| CanDirection {
            bus: bus.clone(),
            format,
            channel,
            identifier,
            sender,
            receiver,
            others: others.to_vec(),
            remark,
            assembler: Box::new(assembler()),
        };
        let remedy = "raise can.bits_per_s and can.data_bits_per_s, take CAN FD, or send less often (link.every_ticks)";
        let forward = direction(ends.forward_channel, forward, master, slave, &others, remark);
        let backward = direction(ends.backward_channel, backward, slave, master, &[], None);
        [(0, forward), (1, backward)].map(|(number, direction)| self.over("can", number, remedy, direction))
    }

    fn over(
        &self,
        kind: &str,
        direction: u64,
        remedy: &'static str,
        medium: impl Medium + 'static,
    ) -> Box<dyn Link> {
        let [from, to] = if direction == 0 { ["master", "slave"] } else { ["slave", "master"] };
        // A bus is one for both.
        let name = if kind == "can" { "CAN bus".to_owned() } else { format!("{kind}, {from} to {to}") };
        Box::new(MediumLink::new((name, from, remedy), self.period_ns, medium, self.behind(direction)))
    }

    /// What the scenario's link does to packets, on an ideal carrier or behind a medium.
    fn behind(&self, direction: u64) -> InProcess {
        let link = &self.scenario.link;
        let delay_ticks = if direction == 0 { link.forward_delay_ticks } else { link.backward_delay_ticks };
        let parameters = InProcessParameters {
            delay_ticks,
            jitter_ticks: link.jitter_ticks,
            loss: link.loss,
            duplication: link.duplication,
            reordering: link.reordering,
        };
        InProcess::new(parameters, self.scenario.seed.wrapping_mul(2).wrapping_add(direction))
    }

    /// A seed of a medium, apart from those of the links.
    fn seed(&self, stream: u64) -> u64 {
        self.scenario.seed.wrapping_mul(2).wrapping_add(stream << 32)
    }
}

#[cfg(test)]
mod tests;
