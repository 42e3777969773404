//! The buses of a rig file, and links over them.

use std::path::Path;

use dimsart_link::carrier::can::Assembler;

use super::can::{CanDirection, SharedBus};
use super::medium::{Medium, MediumLink, Serial};
use super::{InProcess, Link};
use crate::bus::can::{CanBus, Format, Identifier};
use crate::bus::time::seconds_ns;
use crate::bus::{DatagramPath, Delay, DelayFileError, Uart};
use crate::rig_file::BusSection;
use crate::scenario::UdpSection;

/// Apart from the seeds of links.
const BUS_SEEDS: u64 = 1 << 33;

/// All of them.
#[derive(Debug)]
pub struct Buses<'f> {
    period_ns: u64,
    seed: u64,
    buses: Vec<(&'f str, Bus<'f>)>,
}

#[derive(Debug)]
enum Bus<'f> {
    Uart(&'f crate::scenario::UartSection),
    Can { bus: SharedBus, format: Format, nodes: Vec<String> },
    Udp(&'f UdpSection, Delay),
}

/// A link over a bus.
#[derive(Debug, Clone, Copy)]
pub struct Route<'f> {
    /// Name of the bus.
    pub bus: &'f str,
    /// The controller that sends.
    pub from: &'f str,
    /// The controller that receives.
    pub to: &'f str,
    /// Whether it goes forward, where that makes a difference.
    pub is_forward: bool,
    /// The channel that the receiver listens to: its identifier on a CAN bus.
    pub channel: u16,
    /// Number of the link, apart from others.
    pub number: u64,
}

impl<'f> Buses<'f> {
    /// The buses of a file with that sample period and seed; recorded delays are read from `folder`.
    ///
    /// # Errors
    /// [`DelayFileError`] when such a file cannot be used.
    pub fn new(
        sections: &'f [BusSection],
        period_s: f64,
        seed: u64,
        folder: &Path,
    ) -> Result<Self, DelayFileError> {
        let mut buses = Vec::new();
        for (place, section) in (0..).zip(sections) {
            let BusSection { name, uart, can, can_fd, udp } = section;
            let cans = can.iter().map(|can| (can, Format::Classic));
            let mut cans = cans.chain(can_fd.iter().map(|can| (can, Format::Fd)));
            let bus = match (uart, cans.next(), udp) {
                (Some(uart), ..) => Bus::Uart(uart),
                (_, Some((can, format)), _) => {
                    let bus = CanBus::new(can.into(), seed.wrapping_add(BUS_SEEDS).wrapping_add(place));
                    Bus::Can { bus: SharedBus::new(bus), format, nodes: Vec::new() }
                }
                (_, _, Some(udp)) => Bus::Udp(udp, udp.delay(folder)?),
                _ => continue,
            };
            buses.push((name.as_str(), bus));
        }
        Ok(Self { period_ns: seconds_ns(period_s).max(1), seed, buses })
    }

    /// Whether links of a bus are told apart by their channels.
    #[must_use]
    pub fn needs_channels(&self, name: &str) -> bool {
        self.buses.iter().any(|(known, bus)| *known == name && matches!(bus, Bus::Can { .. }))
    }

    /// A link over a bus, with what happens to packets behind it; none when there is no such bus.
    pub fn link(&mut self, route: Route<'_>, behind: InProcess) -> Option<Box<dyn Link>> {
        let Route { bus, from, to, is_forward, channel, number } = route;
        let (name, bus) = self.buses.iter_mut().find(|(known, _)| *known == bus)?;
        let (period_ns, seed) = (self.period_ns, self.seed.wrapping_add(2 * BUS_SEEDS).wrapping_add(number));
        let own_name = format!("{name}, {from} to {to}");
        Some(match bus {
            Bus::Uart(uart) => {
                let medium = Serial::new(Uart::new((*uart).into(), seed));
                over(
                    (own_name, from, "raise its uart.bits_per_s, or send less often (CTX_EVERY)"),
                    period_ns,
                    medium,
                    behind,
                )
            }
            Bus::Udp(udp, delay) => {
                let rate = if is_forward { udp.forward_bits_per_s } else { udp.backward_bits_per_s };
                let medium = DatagramPath::new(udp.path(rate, delay.clone()), seed);
                over(
                    (own_name, from, "raise its bit rates, or send less often (CTX_EVERY)"),
                    period_ns,
                    medium,
                    behind,
                )
            }
            Bus::Can { bus, format, nodes } => {
                let identifier = Identifier::Standard(channel);
                let mut node = |name: &str| match nodes.iter().position(|known| known == name) {
                    Some(place) => place,
                    None => {
                        nodes.push(name.to_owned());
                        bus.lock().add(name, &[])
                    }
                };
                let (sender, receiver) = (node(from), node(to));
                bus.lock().accept(receiver, identifier);
                let direction = CanDirection {
                    bus: bus.clone(),
                    format: *format,
                    channel,
                    identifier,
                    sender,
                    receiver,
                    others: Vec::new(),
                    remark: None,
                    assembler: Box::new(Assembler::new()),
                };
                let remedy = "raise its bit rates, take CAN FD, or send less often (CTX_EVERY)";
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
