//! The buses of a rig file, and links over them.

use std::path::Path;

use dimsart_core::MAX_PACKET_BYTES;
use dimsart_link::auth::Profile;
use dimsart_link::carrier::can::Assembler;

use super::can::{CanDirection, SharedBus};
use super::medium::{Medium, MediumLink, Serial};
use super::{InProcess, Link};
use crate::bus::can::{CanBus, CanFrame, CanParameters, Format, Identifier};
use crate::bus::time::{bits_to_ns, seconds_to_ns};
use crate::bus::{DatagramPath, Delay, DelayFileError, Uart};
use crate::rig_file::{BusSection, CanSection, LinkSection, RigFile, UartSection, UdpSection};

/// Seed offset of buses, different from links.
const BUS_SEEDS: u64 = 1 << 33;

/// Identifiers without a channel are 29 bits long, as if derived from a chip's serial number.
const OWN_IDENTIFIERS: u32 = 0x1000_0000;
/// Identifiers of other nodes: one half has higher priority, the other half lower.
const OTHER_IDENTIFIERS: [u32; 2] = [0x0800_0000, 0x1800_0000];
/// Maximum frames of a classic CAN packet.
const MAX_FRAMES: u32 = 16;
/// Overhead of a UART frame, bytes.
const STREAM_BYTES: usize = 4;

/// All buses.
#[derive(Debug)]
pub struct Buses<'f> {
    period_ns: u64,
    seed: u64,
    buses: Vec<(&'f str, Bus<'f>)>,
}

#[derive(Debug)]
enum Bus<'f> {
    Ideal,
    Uart(&'f UartSection),
    Can {
        bus: SharedBus,
        format: Format,
        nodes: Vec<String>,
        /// Additional nodes that are not created yet.
        other_nodes: u32,
    },
    Udp(&'f UdpSection, Delay),
}

/// Definition of a link over a bus.
#[derive(Debug, Clone, Copy)]
pub struct Route<'f> {
    /// Bus name.
    pub bus: &'f str,
    /// Sending controller.
    pub from: &'f str,
    /// Receiving controller.
    pub to: &'f str,
    /// Direction: forward or backward, for asymmetric buses.
    pub is_forward: bool,
    /// Channel of the receiver: identifier on a CAN bus.
    pub channel: u16,
    /// Unique number of the link.
    pub number: u64,
    /// Whether packets are authenticated.
    pub is_authenticated: bool,
}

impl<'f> Buses<'f> {
    /// Creates the buses of a file; recorded delays are read from `folder`.
    ///
    /// # Errors
    /// [`DelayFileError`] for an invalid delays file.
    pub fn new(
        sections: &'f [BusSection],
        period_s: f64,
        seed: u64,
        folder: &Path,
    ) -> Result<Self, DelayFileError> {
        let mut buses = Vec::new();
        for (place, section) in (0..).zip(sections) {
            let BusSection { name, ideal, uart, can, can_fd, udp } = section;
            let cans = can.iter().map(|can| (can, Format::Classic));
            let mut cans = cans.chain(can_fd.iter().map(|can| (can, Format::Fd)));
            let bus = match (uart, cans.next(), udp) {
                _ if ideal.is_some() => Bus::Ideal,
                (Some(uart), ..) => Bus::Uart(uart),
                (_, Some((can, format)), _) => {
                    let bus = CanBus::new(can.into(), seed.wrapping_add(BUS_SEEDS).wrapping_add(place));
                    let other_nodes = can.other_nodes;
                    Bus::Can { bus: SharedBus::new(bus), format, nodes: Vec::new(), other_nodes }
                }
                (_, _, Some(udp)) => Bus::Udp(udp, udp.delay(folder)?),
                _ => continue,
            };
            buses.push((name.as_str(), bus));
        }
        Ok(Self { period_ns: seconds_to_ns(period_s).max(1), seed, buses })
    }

    /// Whether links of a bus are distinguished by their channels.
    #[must_use]
    pub fn needs_channels(&self, name: &str) -> bool {
        self.buses.iter().any(|(known, bus)| *known == name && matches!(bus, Bus::Can { .. }))
    }

    /// Creates a link over a bus, followed by the modelled link `behind`; `None` for an unknown bus.
    pub fn link(&mut self, route: Route<'_>, behind: InProcess) -> Option<Box<dyn Link>> {
        let Route { bus, from, to, is_forward, channel, number, is_authenticated } = route;
        let (name, bus) = self.buses.iter_mut().find(|(known, _)| *known == bus)?;
        let (period_ns, seed) = (self.period_ns, self.seed.wrapping_mul(2).wrapping_add((2 + number) << 32));
        let own_name = format!("{name}, {from} to {to}");
        Some(match bus {
            Bus::Ideal => Box::new(behind),
            Bus::Uart(uart) => {
                let medium = Serial::new(Uart::new((*uart).into(), seed));
                over(
                    (own_name, from, "raise uart.bits_per_s, or send less often (CTX_EVERY)"),
                    period_ns,
                    medium,
                    behind,
                )
            }
            Bus::Udp(udp, delay) => {
                let rate = if is_forward { udp.forward_bits_per_s } else { udp.backward_bits_per_s };
                let medium = DatagramPath::new(udp.path(rate, delay.clone()), seed);
                over(
                    (own_name, from, "raise the bit rates, or send less often (CTX_EVERY)"),
                    period_ns,
                    medium,
                    behind,
                )
            }
            Bus::Can { bus, format, nodes, other_nodes } => {
                let identifier = match (channel, u32::try_from(number)) {
                    (0, number) => Identifier::Extended(OWN_IDENTIFIERS + number.unwrap_or_default()),
                    (channel, _) => Identifier::Standard(channel),
                };
                let mut node = |name: &str| match nodes.iter().position(|known| known == name) {
                    Some(place) => place,
                    None => {
                        nodes.push(name.to_owned());
                        bus.lock().add(name, &[])
                    }
                };
                let (sender, receiver) = (node(from), node(to));
                bus.lock().accept(receiver, identifier);
                let bases = OTHER_IDENTIFIERS.iter().cycle();
                let others = (0..core::mem::take(other_nodes)).zip(bases).map(|(number, base)| {
                    let node = bus.lock().add(&format!("other {}", number + 1), &[]);
                    (node, Identifier::Extended(base + number))
                });
                let others: Vec<_> = others.collect();
                let assembler = if is_authenticated { Assembler::authenticated() } else { Assembler::new() };
                let direction = CanDirection {
                    bus: bus.clone(),
                    format: *format,
                    channel,
                    identifier,
                    sender,
                    receiver,
                    others,
                    assembler: Box::new(assembler),
                };
                let remedy = "raise the bit rates, use CAN FD, or send less often (CTX_EVERY)";
                over(((*name).to_owned(), from, remedy), period_ns, direction, behind)
            }
        })
    }
}

fn over(
    (name, from, remedy): (String, &str, &'static str),
    period_ns: u64,
    medium: impl Medium + 'static,
    behind: InProcess,
) -> Box<dyn Link> {
    Box::new(MediumLink::new((name, from, remedy), period_ns, medium, behind))
}

/// Returns the round trip in ticks between two controllers without late packets: exact over ideal links; otherwise a
/// value that is rarely exceeded while queues are not full. It includes the delays of the links, but not of delay
/// modules.
///
/// The second controller is stepped after the first: over an ideal link with delay 0 it receives packets in the same
/// tick, the first controller in the next tick.
///
/// # Errors
/// [`DelayFileError`] for an invalid delays file.
pub fn round_trip_ticks(file: &RigFile, [one, other]: [&str; 2]) -> Result<u32, DelayFileError> {
    let period_ns = seconds_to_ns(file.sample_period_s).max(1);
    let mut sum = 0_u32;
    for (from, to) in [(one, other), (other, one)] {
        let Some(link) = file.links.iter().find(|link| link.from == from && link.to == to) else { continue };
        let is_forward = from == one;
        let bus = file.buses.iter().find(|bus| link.bus.as_ref() == Some(&bus.name));
        let medium_ns = bus.map(|bus| longest_ns(file, bus, link, is_forward)).transpose()?.flatten();
        let delay_ticks = match medium_ns {
            None if !is_forward => link.carrier.delay_ticks.max(1),
            _ => link.carrier.delay_ticks,
        };
        let medium = medium_ns.unwrap_or(0).div_ceil(period_ns);
        sum = sum.saturating_add(delay_ticks).saturating_add(u32::try_from(medium).unwrap_or(u32::MAX));
    }
    Ok(sum)
}

/// Transmission time of a packet of maximum length, `ns`; `None` on an ideal bus.
fn longest_ns(
    file: &RigFile,
    bus: &BusSection,
    link: &LinkSection,
    is_forward: bool,
) -> Result<Option<u64>, DelayFileError> {
    let BusSection { uart, can, can_fd, udp, .. } = bus;
    let tag_bytes = if link.key_file.is_some() { Profile::Full.overhead() } else { 0 };
    let packet_bytes = MAX_PACKET_BYTES + tag_bytes;
    let line_ns =
        |bytes: usize, bits_per_byte: usize, rate: u32| bits_to_ns((bytes * bits_per_byte) as u64, rate);
    let of_can = |can: &CanSection, format, bytes, frames: u32| {
        let most = CanFrame::max_wire_bits(Identifier::Extended(0), format, bytes);
        u64::from((2 + can.other_nodes) * frames) * CanBus::frame_ns(&CanParameters::from(can), most)
    };
    Ok(match (uart, can, can_fd, udp) {
        (Some(uart), ..) => Some(line_ns(packet_bytes + STREAM_BYTES, 10, uart.bits_per_s)),
        (_, Some(can), ..) => Some(of_can(can, Format::Classic, 8, MAX_FRAMES)),
        (_, _, Some(can), _) => Some(of_can(can, Format::Fd, 64, 1)),
        (.., Some(udp)) => {
            let rate = if is_forward { udp.forward_bits_per_s } else { udp.backward_bits_per_s };
            let delay_ns = seconds_to_ns(udp.delay(&file.folder)?.upper_s());
            Some(delay_ns + line_ns(packet_bytes + udp.header_bytes, 8, rate))
        }
        _ => None,
    })
}

#[cfg(test)]
mod tests;
