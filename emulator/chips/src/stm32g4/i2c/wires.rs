//! What is between an I²C and a device: pins, pull-ups, and the times that the device wants of the clock.

use super::super::gpio::Gpio;
use super::super::violation::Access;

/// Pulses of the clock after which a device that sends has come to its end.
const FREEING_PULSES: u32 = 9;

/// A device on the wires of an I²C, by its data sheet. It brings the pull-ups of both lines. It is a value: a board on the
/// bench can be copied with all that is around it.
#[derive(Debug, Clone, Copy)]
pub struct I2cDevice {
    /// For people.
    pub name: &'static str,
    /// Its address, 7 bits.
    pub address: u32,
    /// Of the clock.
    pub max_clock_hz: f64,
    /// Least time that the clock is low, `s`.
    pub min_low_s: f64,
    /// Least time that the clock is high, `s`.
    pub min_high_s: f64,
    /// Least time from the data's change to the clock's rise, with the longest rise of the data, `s`.
    pub min_setup_s: f64,
    /// What it remembers and measures.
    pub state: [u32; 4],
    /// What it does, and what it says.
    pub behaviour: fn(&mut [u32; 4], I2cEvent) -> u32,
}

/// What happens to a device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum I2cEvent {
    /// It was addressed. An answer that is not 0 acknowledges.
    Started {
        /// Whether it is to send.
        is_read: bool,
    },
    /// It got a byte. An answer that is not 0 acknowledges.
    Written {
        /// The byte.
        byte: u8,
    },
    /// It is to send a byte, from now on: the answer.
    Read,
}

/// What an I²C's pins are.
#[derive(Debug, Clone, Copy, Default)]
pub(in super::super) struct Pins {
    /// Both of them.
    pub(super) is_connected: bool,
    pub(super) is_open_drain: bool,
    is_pulled_up: bool,
    /// The level that the program drives the clock's pin to, where it does.
    pub(super) clock: Option<bool>,
}

impl Pins {
    /// Those of an I²C, by its name.
    pub(in super::super) fn new(i2c: &str, connected: &[&str], ports: &[Gpio]) -> Self {
        let names = ["SCL", "SDA"].map(|line| format!("{i2c}_{line}"));
        let of_both = |is_so: &dyn Fn(&Gpio, &str) -> bool| {
            names.iter().all(|name| ports.iter().any(|port| is_so(port, name)))
        };
        let [clock, _] = &names;
        Self {
            is_connected: names.iter().all(|name| connected.iter().any(|pin| pin == name)),
            is_open_drain: of_both(&Gpio::is_open_drain),
            is_pulled_up: of_both(&|port, name| port.pull_of(name) == Some(true)),
            clock: ports.iter().find_map(|port| port.output(port.pin_of(clock)?)),
        }
    }
}

/// The wires.
#[derive(Debug, Clone, Default)]
pub(in super::super) struct Bus {
    pub(in super::super) device: Option<I2cDevice>,
    /// Whether something has the data line low.
    pub(in super::super) is_stuck: bool,
    /// Whether the device does, which was left while it was sending.
    pub(super) is_held: bool,
    /// When a device was last addressed to send.
    pub(in super::super) read_at: Option<u64>,
    clock: Option<bool>,
    pulses: u32,
}

impl Bus {
    pub(super) fn is_free(&self, pins: Pins) -> bool {
        !self.is_stuck && !self.is_held && (self.device.is_some() || pins.is_pulled_up)
    }

    /// What the device at an address says; 0 where there is none.
    pub(super) fn answer(&mut self, address: u32, event: I2cEvent) -> u32 {
        let device = self.device.as_mut().filter(|device| device.address == address);
        device.map_or(0, |device| (device.behaviour)(&mut device.state, event))
    }

    /// The program moves the clock's pin itself.
    pub(super) fn see_clock(&mut self, clock: Option<bool>) {
        if clock == Some(false) && self.clock != clock {
            self.pulses += 1;
        }
        self.clock = clock;
        if clock.is_none() {
            self.pulses = 0;
        } else if self.pulses >= FREEING_PULSES {
            self.is_held = false;
        }
    }

    /// At a START, with the shortest period of the clock, its low and high time, and the data's setup time, `s`.
    pub(super) fn check(&self, bit_s: f64, [low_s, high_s]: [f64; 2], setup_s: f64, access: &mut Access<'_>) {
        let Some(device) = &self.device else { return };
        let name = device.name;
        if bit_s * device.max_clock_hz < 1.0 {
            let khz = [1.0 / bit_s, device.max_clock_hz].map(|hz| hz / 1e3);
            access.violates(format!("{name} is clocked with {:.0} kHz, and takes {:.0}", khz[0], khz[1]));
        }
        for (what, is_s, min_s) in [
            ("has its clock low for", low_s, device.min_low_s),
            ("has its clock high for", high_s, device.min_high_s),
            ("gets its data ahead of the clock by", setup_s, device.min_setup_s),
        ] {
            if is_s < min_s {
                let [is_ns, min_ns] = [is_s, min_s].map(|time_s| time_s * 1e9);
                access.violates(format!("{name} {what} {is_ns:.0} ns, and wants {min_ns:.0}"));
            }
        }
    }
}
