//! Connection of an SPI and a device: pins, and the timing that the device requires.

use super::super::gpio::Gpio;
use super::super::map::PORTS;
use super::super::violation::Access;

/// A device on an SPI, by its data sheet. The device is plain data, so that an emulated board can be copied
/// with its surroundings.
#[derive(Debug, Clone, Copy)]
pub struct SpiDevice {
    /// Name for messages.
    pub name: &'static str,
    /// SPI mode 0 to 3, from CPOL and CPHA.
    pub mode: u32,
    /// Maximum clock frequency.
    pub max_clock_hz: f64,
    /// Minimum time from select to the first clock edge, `s`.
    pub min_select_s: f64,
    /// Minimum time from release to the next select, `s`.
    pub min_release_s: f64,
    /// State and measured values of the device.
    pub state: [u32; 4],
    /// Reaction to an event; returns the sent bits.
    pub on_event: fn(&mut [u32; 4], SpiEvent) -> u32,
}

/// An event at a device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SpiEvent {
    /// The device is selected.
    Selected,
    /// A frame was exchanged. The answer is the frame that the device has sent, most significant bit first.
    Frame {
        /// Number of bits of the frame.
        bits: u32,
        /// Frame that was sent to the device.
        sent: u32,
    },
    /// The device is released.
    Released,
}

impl SpiDevice {
    pub(super) fn answer(&mut self, event: SpiEvent) -> u32 {
        (self.on_event)(&mut self.state, event)
    }
}

/// State of the pins of an SPI.
#[derive(Debug, Clone, Copy, Default)]
pub(in super::super) struct Pins {
    pub(super) is_clocked: bool,
    pub(super) has_output: bool,
    pub(super) has_input: bool,
    /// Level of the input's pull resistor.
    pub(super) pull: Option<bool>,
    pub(super) is_selected: bool,
}

impl Pins {
    /// Returns the pins of an SPI, by its name, with the select pin of its device.
    pub(in super::super) fn new(
        spi: &str,
        connected: &[&str],
        ports: &[Gpio],
        select: Option<(char, u32)>,
    ) -> Self {
        let has = |pin: &str| connected.iter().any(|name| name.strip_prefix(spi) == Some(pin));
        let output = |(letter, pin): (char, u32)| {
            let place = PORTS.iter().position(|port| *port == letter)?;
            ports.get(place)?.output(pin)
        };
        Self {
            is_clocked: has("_SCK"),
            has_output: has("_MOSI"),
            has_input: has("_MISO"),
            pull: ports.iter().find_map(|port| port.pull_of(&format!("{spi}_MISO"))),
            is_selected: select.and_then(output) == Some(false),
        }
    }
}

/// A connected device.
#[derive(Debug, Clone)]
pub(in super::super) struct Chip {
    pub(super) device: SpiDevice,
    /// Select pin, low while the device is selected.
    pub(super) select: (char, u32),
    is_selected: bool,
    /// Cycle of the last select or release.
    since: Option<u64>,
}

impl Chip {
    pub(in super::super) fn new(device: SpiDevice, select: (char, u32)) -> Self {
        Self { device, select, is_selected: false, since: None }
    }

    pub(super) fn is_selected(&self) -> bool {
        self.is_selected
    }

    pub(super) fn selected_at(&self) -> Option<u64> {
        self.since.filter(|_| self.is_selected)
    }

    /// Whether the last select or release is less than `min_s` ago.
    fn is_younger(&self, min_s: f64, hz: f64, now: u64) -> bool {
        #[expect(clippy::cast_precision_loss, reason = "only short times matter")]
        self.since.is_some_and(|since| ((now - since) as f64) < min_s * hz)
    }

    pub(super) fn see(&mut self, is_selected: bool, is_busy: bool, hz: f64, access: &mut Access<'_>) {
        if is_selected == self.is_selected {
            return;
        }
        let (name, now) = (self.device.name, access.at.cycle);
        if is_busy {
            access.violates(format!("{name} is selected or released during a frame"));
        }
        if is_selected && self.is_younger(self.device.min_release_s, hz, now) {
            let min_ns = self.device.min_release_s * 1e9;
            access.violates(format!("{name} is selected less than {min_ns:.0} ns after its release"));
        }
        (self.is_selected, self.since) = (is_selected, Some(now));
        self.device.answer(if is_selected { SpiEvent::Selected } else { SpiEvent::Released });
    }

    /// Checks the device's requirements at the start of a frame.
    pub(super) fn check(&self, mode: u32, clock_hz: f64, hz: f64, access: &mut Access<'_>) {
        let SpiDevice { name, max_clock_hz, min_select_s, .. } = self.device;
        if !self.is_selected {
            return;
        }
        if clock_hz > max_clock_hz {
            let mhz = [clock_hz, max_clock_hz].map(|hz| hz / 1e6);
            access.violates(format!(
                "{name} is clocked at {:.1} MHz, but allows at most {:.1} MHz",
                mhz[0], mhz[1]
            ));
        }
        if mode != self.device.mode {
            access.violates(format!(
                "{name} is clocked in mode {mode}, but requires mode {}",
                self.device.mode
            ));
        }
        if self.is_younger(min_select_s, hz, access.at.cycle) {
            let min_ns = min_select_s * 1e9;
            access.violates(format!("{name} is clocked less than {min_ns:.0} ns after its select"));
        }
    }
}
