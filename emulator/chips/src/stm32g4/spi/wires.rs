//! What is between an SPI and a device: pins, and the times that the device wants of them.

use super::super::gpio::Gpio;
use super::super::map::PORTS;
use super::super::violation::Access;

/// A device on the wires of an SPI, by its data sheet. It is a value: a board on the bench can be copied with all that is around
/// it.
#[derive(Debug, Clone, Copy)]
pub struct SpiDevice {
    /// For people.
    pub name: &'static str,
    /// CPOL and CPHA, as one number of two bits: 0 to 3.
    pub mode: u32,
    /// Of its clock.
    pub max_clock_hz: f64,
    /// Least time from its being selected to the first edge of the clock, `s`.
    pub min_select_s: f64,
    /// Least time that it is not selected between two times that it is, `s`.
    pub min_release_s: f64,
    /// What it remembers and measures.
    pub state: [u32; 4],
    /// What it does, and what it sends.
    pub behaviour: fn(&mut [u32; 4], SpiEvent) -> u32,
}

/// What happens to a device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SpiEvent {
    /// It is selected.
    Selected,
    /// So many bits went each way: what it got. The answer is what it sent meanwhile, the highest bit first.
    Frame {
        /// Of the frame.
        bits: u32,
        /// To the device.
        sent: u32,
    },
    /// It is not selected any more.
    Released,
}

impl SpiDevice {
    pub(super) fn answer(&mut self, event: SpiEvent) -> u32 {
        (self.behaviour)(&mut self.state, event)
    }
}

/// What an SPI's pins are.
#[derive(Debug, Clone, Copy, Default)]
pub(in super::super) struct Pins {
    pub(super) is_clocked: bool,
    pub(super) has_output: bool,
    pub(super) has_input: bool,
    /// Of the input's pull resistor.
    pub(super) pull: Option<bool>,
    pub(super) is_selected: bool,
}

impl Pins {
    /// Those of an SPI, by its name, and the one that selects its device.
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

/// A device that is wired.
#[derive(Debug, Clone)]
pub(in super::super) struct Chip {
    pub(super) device: SpiDevice,
    /// Low while it is selected.
    pub(super) select: (char, u32),
    is_selected: bool,
    /// Since when it is as it is.
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

    /// Whether it has been as it is for less than that.
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
            access.violates(format!("{name} is selected or released in the middle of a frame"));
        }
        if is_selected && self.is_younger(self.device.min_release_s, hz, now) {
            access.violates(format!("{name} is selected again too early"));
        }
        (self.is_selected, self.since) = (is_selected, Some(now));
        self.device.answer(if is_selected { SpiEvent::Selected } else { SpiEvent::Released });
    }

    /// At the begin of a frame.
    pub(super) fn check(&self, mode: u32, clock_hz: f64, hz: f64, access: &mut Access<'_>) {
        let SpiDevice { name, max_clock_hz, min_select_s, .. } = self.device;
        if !self.is_selected {
            return;
        }
        if clock_hz > max_clock_hz {
            let mhz = [clock_hz, max_clock_hz].map(|hz| hz / 1e6);
            access.violates(format!("{name} is clocked with {:.1} MHz, and takes {:.1}", mhz[0], mhz[1]));
        }
        if mode != self.device.mode {
            access.violates(format!("{name} is clocked in mode {mode}, and takes mode {}", self.device.mode));
        }
        if self.is_younger(min_select_s, hz, access.at.cycle) {
            access.violates(format!("{name} is clocked too early after it was selected"));
        }
    }
}
