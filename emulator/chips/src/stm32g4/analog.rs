//! Voltages at the ADC inputs: of pins, directly or through amplifiers.

use std::collections::BTreeMap;

use super::gpio::Gpio;
use super::map::PORTS;
use super::opamp::{Opamp, PINS, SUPPLY_V};
use super::timer::{Gate, GateDriver, Timer};

/// Voltage source of a pin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum VoltageSource {
    /// Constant voltage, V.
    Constant(f64),
    /// A shunt below a half bridge of timer 1, with the circuit between shunt and pin.
    Shunt {
        /// Channel of the half bridge, from 0.
        channel: u32,
        /// Voltage while the lower switch is closed, V.
        low_v: f64,
        /// Voltage while the upper switch is closed, V.
        high_v: f64,
        /// Voltage while both switches are open, V.
        open_v: f64,
    },
}

/// Input of an ADC channel.
enum Source {
    Pin(char, u32),
    /// Index of the amplifier, from 0.
    Amplifier(usize),
}

/// DS12589 and DS12288, table of pins; internal channels: RM0440, 21.4.11.
fn source(converter: u32, channel: u32) -> Option<Source> {
    let (port, pin) = match (converter, channel) {
        (1, 13) => return Some(Source::Amplifier(0)),
        (2, 16) => return Some(Source::Amplifier(1)),
        (2, 18) => return Some(Source::Amplifier(2)),
        (1 | 2, 1) => ('A', 0),
        (1 | 2, 2) => ('A', 1),
        (1, 3) => ('A', 2),
        (1, 4) => ('A', 3),
        (1, 5) => ('B', 14),
        (1 | 2, 6..=9) => ('C', channel - 6),
        (1, 11) => ('B', 12),
        (1, 12) => ('B', 1),
        (1 | 2, 14) => ('B', 11),
        (1, 15) => ('B', 0),
        (2, 3) => ('A', 6),
        (2, 4) => ('A', 7),
        (2, 5) => ('C', 4),
        (2, 11) => ('C', 5),
        (2, 12) => ('B', 2),
        (2, 13) => ('A', 5),
        (2, 15) => ('B', 15),
        (2, 17) => ('A', 4),
        _ => return None,
    };
    Some(Source::Pin(port, pin))
}

/// Converts a voltage to 12-bit counts.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped before")]
pub(super) fn counts(volts: f64) -> u32 {
    (volts / SUPPLY_V * 4096.0).round().clamp(0.0, 4095.0) as u32
}

/// Everything that determines a voltage at an instant.
pub(super) struct Scene<'a> {
    pub(super) wires: &'a BTreeMap<(char, u32), VoltageSource>,
    pub(super) amplifiers: &'a Opamp,
    pub(super) ports: &'a [Gpio],
    /// Timer 1 at this instant.
    pub(super) bridge: Option<&'a Timer>,
    pub(super) driver: GateDriver,
    pub(super) now: u64,
}

impl Scene<'_> {
    /// Voltage at a channel of an ADC, V.
    ///
    /// # Errors
    /// Description of a missing connection, or of an unmodelled or invalid setting.
    pub(super) fn channel_v(&self, converter: u32, channel: u32) -> Result<f64, String> {
        match source(converter, channel) {
            Some(Source::Amplifier(place)) if self.amplifiers.drives_converter(place) => {
                self.amplified_v(place)
            }
            Some(Source::Amplifier(place)) => Err(format!(
                "ADC{converter} samples OPAMP{}, whose output is not connected to the ADC",
                place + 1
            )),
            Some(Source::Pin(port, pin)) => self.pin_v((port, pin)),
            None => Err(format!("ADC{converter} samples channel {channel}: not modelled")),
        }
    }

    fn amplified_v(&self, place: usize) -> Result<f64, String> {
        self.amplifiers.output_v(place, self.now, |pin| self.pin_v(pin))
    }

    fn pin_v(&self, (port, pin): (char, u32)) -> Result<f64, String> {
        let gpio = PORTS.iter().position(|letter| *letter == port).and_then(|place| self.ports.get(place));
        if !gpio.is_some_and(|gpio| gpio.is_analog(pin)) {
            return Err(format!("P{port}{pin} is used as an analog pin, but is not in analog mode"));
        }
        let driver = PINS.iter().position(|pins| pins.output == (port, pin));
        if let Some(place) = driver.filter(|place| self.amplifiers.drives_pin(*place)) {
            return self.amplified_v(place);
        }
        match self.wires.get(&(port, pin)) {
            Some(VoltageSource::Constant(volts)) => Ok(*volts),
            Some(VoltageSource::Shunt { channel, low_v, high_v, open_v }) => {
                Ok(match self.bridge.map_or(Gate::Open, |bridge| bridge.gate(*channel, self.driver)) {
                    Gate::Low => *low_v,
                    Gate::High => *high_v,
                    Gate::Open => *open_v,
                })
            }
            None => Err(format!("P{port}{pin} is sampled, but no voltage source is connected to it")),
        }
    }
}
