//! Connection of an I²C and a device: pins, pull-ups, and the clock timing that the device requires.

use super::super::gpio::Gpio;
use super::super::violation::Access;

/// Number of clock pulses after which a sending device releases the data line.
const FREEING_PULSES: u32 = 9;

/// A device on an I²C, by its data sheet, with the pull-ups of both lines. The device is plain data, so that
/// an emulated board can be copied with its surroundings.
#[derive(Debug, Clone, Copy)]
pub struct I2cDevice {
    /// Name for messages.
    pub name: &'static str,
    /// 7-bit address.
    pub address: u32,
    /// Maximum clock frequency.
    pub max_clock_hz: f64,
    /// Minimum low time of the clock, `s`.
    pub min_low_s: f64,
    /// Minimum high time of the clock, `s`.
    pub min_high_s: f64,
    /// Minimum data setup time before the rising clock edge, with the maximum rise time of the data, `s`.
    pub min_setup_s: f64,
    /// State and measured values of the device.
    pub state: [u32; 4],
    /// Reaction to an event; returns the answer.
    pub on_event: fn(&mut [u32; 4], I2cEvent) -> u32,
}

/// An event at a device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum I2cEvent {
    /// The device was addressed. A nonzero answer acknowledges.
    Started {
        /// Whether the device is to send.
        is_read: bool,
    },
    /// The device received a byte. A nonzero answer acknowledges.
    Written {
        /// The byte.
        byte: u8,
    },
    /// The device starts to send a byte: the answer.
    Read,
}

/// State of the pins of an I²C.
#[derive(Debug, Clone, Copy, Default)]
pub(in super::super) struct Pins {
    /// Whether both pins are connected.
    pub(super) is_connected: bool,
    pub(super) is_open_drain: bool,
    is_pulled_up: bool,
    /// Level that the program drives at the clock pin; `None` if the pin is not an output.
    pub(super) clock: Option<bool>,
}

impl Pins {
    /// Returns the pins of an I²C, by its name.
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

/// The wires and the device.
#[derive(Debug, Clone, Default)]
pub(in super::super) struct Bus {
    pub(in super::super) device: Option<I2cDevice>,
    /// Whether an external fault holds the data line low.
    pub(in super::super) is_stuck: bool,
    /// Whether the device holds the data line low, because its transfer was aborted while it was sending.
    pub(super) is_held: bool,
    /// Cycle of the last START of a read transfer.
    pub(in super::super) read_at: Option<u64>,
    clock: Option<bool>,
    pulses: u32,
}

impl Bus {
    pub(super) fn is_free(&self, pins: Pins) -> bool {
        !self.is_stuck && !self.is_held && (self.device.is_some() || pins.is_pulled_up)
    }

    /// Answer of the device at an address; 0 without a device.
    pub(super) fn answer(&mut self, address: u32, event: I2cEvent) -> u32 {
        let device = self.device.as_mut().filter(|device| device.address == address);
        device.map_or(0, |device| (device.on_event)(&mut device.state, event))
    }

    /// Counts the clock pulses that the program generates at the pin.
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

    /// Checks the device's requirements at a START: the shortest clock period, the low and high time of the
    /// clock, and the data setup time, `s`.
    pub(super) fn check(&self, bit_s: f64, [low_s, high_s]: [f64; 2], setup_s: f64, access: &mut Access<'_>) {
        let Some(device) = &self.device else { return };
        let name = device.name;
        if bit_s * device.max_clock_hz < 1.0 {
            let khz = [1.0 / bit_s, device.max_clock_hz].map(|hz| hz / 1e3);
            access.violates(format!(
                "{name} is clocked at {:.0} kHz, but allows at most {:.0} kHz",
                khz[0], khz[1]
            ));
        }
        for (what, is_s, min_s) in [
            ("clock low time", low_s, device.min_low_s),
            ("clock high time", high_s, device.min_high_s),
            ("data setup time", setup_s, device.min_setup_s),
        ] {
            if is_s < min_s {
                let [is_ns, min_ns] = [is_s, min_s].map(|time_s| time_s * 1e9);
                access.violates(format!(
                    "{name}: {what} is {is_ns:.0} ns, but must be at least {min_ns:.0} ns"
                ));
            }
        }
    }
}
