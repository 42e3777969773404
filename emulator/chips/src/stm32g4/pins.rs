//! External signals of the chip: levels, voltages, encoders, serial lines, a bridge.

use super::fdcan::Fdcan;
use super::gpio::Gpio;
use super::i2c::I2cDevice;
use super::map::{I2CS, PORTS, SPIS};
use super::spi::{Chip, SpiDevice};
use super::timer::{GateDriver, Pulses, Timer};
use super::usart::Usart;
use super::{Stm32g4, VoltageSource};

impl Stm32g4 {
    /// Alternate functions that are selected at pins, such as `TIM1_CH1`.
    #[must_use]
    pub fn alternate_functions(&self) -> Vec<&'static str> {
        self.ports.iter().flat_map(Gpio::connected).collect()
    }

    /// Level that the chip drives at a pin; `None` if the pin is not an output.
    #[must_use]
    pub fn output(&self, port: char, pin: u32) -> Option<bool> {
        let place = PORTS.iter().position(|letter| *letter == port)?;
        self.ports.get(place)?.output(pin)
    }

    /// Sets the external level at a pin.
    pub fn set_input(&mut self, port: char, pin: u32, is_high: bool) {
        for gpio in
            self.ports.iter_mut().zip(PORTS).filter(|(_, letter)| *letter == port).map(|(gpio, _)| gpio)
        {
            gpio.set_input(pin, is_high);
        }
    }

    /// Connects a voltage source to a pin, for ADCs and amplifiers.
    pub fn connect_voltage_source(&mut self, port: char, pin: u32, wire: VoltageSource) {
        self.wires.insert((port, pin), wire);
    }

    /// Sets the external voltage at a pin.
    pub fn set_voltage(&mut self, port: char, pin: u32, volts: f64) {
        self.connect_voltage_source(port, pin, VoltageSource::Constant(volts));
    }

    /// Sets the gate driver between timer 1 and the bridge. By default, every high level closes a switch.
    pub fn set_gate_driver(&mut self, driver: GateDriver) {
        self.gate_driver = driver;
    }

    /// Connects a device to an SPI, selected by a low level at a pin; `None` disconnects the device.
    pub fn connect_spi(&mut self, name: &str, select: (char, u32), device: Option<SpiDevice>) {
        if let Some(spi) = self.spi(name) {
            spi.wire(device.map(|device| Chip::new(device, select)));
        }
    }

    /// The device at an SPI.
    pub fn spi_device(&mut self, name: &str) -> Option<&mut SpiDevice> {
        self.spi(name)?.device()
    }

    /// Cycle in which the device at an SPI was selected; `None` while it is not selected.
    pub fn spi_selected_at(&mut self, name: &str) -> Option<u64> {
        self.spi(name)?.selected_at()
    }

    /// Connects a device to an I²C; `None` disconnects the device.
    pub fn connect_i2c(&mut self, name: &str, device: Option<I2cDevice>) {
        if let Some(i2c) = self.i2c(name) {
            i2c.bus().device = device;
        }
    }

    /// The device at an I²C.
    pub fn i2c_device(&mut self, name: &str) -> Option<&mut I2cDevice> {
        self.i2c(name)?.bus().device.as_mut()
    }

    /// Cycle of the last START of a read transfer on an I²C.
    pub fn i2c_read_at(&mut self, name: &str) -> Option<u64> {
        self.i2c(name)?.bus().read_at
    }

    /// Holds the data line of an I²C low, or releases it.
    pub fn hold_sda_low(&mut self, name: &str, is_held: bool) {
        if let Some(i2c) = self.i2c(name) {
            i2c.bus().is_stuck = is_held;
        }
    }

    fn i2c(&mut self, name: &str) -> Option<&mut super::I2c> {
        self.i2cs.iter_mut().zip(I2CS).find(|(_, known)| *known == name).map(|(i2c, _)| i2c)
    }

    fn spi(&mut self, name: &str) -> Option<&mut super::Spi> {
        self.spis.iter_mut().zip(SPIS).find(|(_, known)| *known == name).map(|(spi, _)| spi)
    }

    /// Pulses of timer 1 at the bridge, if all pins of the bridge are connected.
    #[must_use]
    pub fn pulses(&self) -> Option<Pulses> {
        let timer = self.timers.first()?;
        let connected = self.alternate_functions();
        let has = |name: &&str| connected.contains(name);
        let (high, low) = (["TIM1_CH1", "TIM1_CH2", "TIM1_CH3"], ["TIM1_CH1N", "TIM1_CH2N", "TIM1_CH3N"]);
        // A gate driver that generates the low sides itself has no pins for them, whatever the timer outputs
        // there.
        let is_low_side_driven = timer.is_complementary() && low.iter().all(has);
        let is_whole = high.iter().all(has) && (is_low_side_driven || !low.iter().any(has));
        is_whole.then(|| timer.pulses()).flatten()
    }

    /// Next cycle in the middle of the on time of timer 1's lower switches; `None` unless the timer counts up
    /// and down.
    #[must_use]
    pub fn next_low_side_midpoint(&self) -> Option<u64> {
        self.timers.first()?.next_top()
    }

    /// Takes the changes of timer 1's main output enable (`MOE`) since the last call: cycle, whether it is
    /// set.
    pub fn take_output_enable_changes(&mut self) -> Vec<(u64, bool)> {
        self.timers.first_mut().map(Timer::take_output_enable_changes).unwrap_or_default()
    }

    /// Takes the minimum and maximum cycles from the end of an injected sequence of ADC1 until its flag is
    /// cleared, since the last call.
    pub fn take_response_cycles(&mut self) -> Option<(u64, u64)> {
        self.adcs[0].take_response_cycles()
    }

    /// Turns the shaft of an encoder at a timer's channels 1 and 2 by this number of counts.
    pub fn turn_encoder(&mut self, timer: u32, counts: i64) {
        let connected = self.alternate_functions();
        let is_connected = [1, 2].iter().all(|channel| {
            let name = format!("TIM{timer}_CH{channel}");
            connected.iter().any(|connected| **connected == *name)
        });
        if is_connected && let Some(timer) = self.timer(timer) {
            timer.turn(counts);
        }
    }

    /// Sends bytes to a UART from cycle `now`. The bytes are lost if its pin is not connected.
    pub fn receive(&mut self, uart: &str, bytes: &[u8], now: u64) {
        let pin = format!("{uart}_RX");
        if self.alternate_functions().iter().any(|name| **name == *pin)
            && let Some(uart) = self.usart(uart)
        {
            uart.receive(bytes, now);
        }
    }

    /// Whether bytes to a UART are still in transit.
    pub fn is_receiving(&mut self, uart: &str) -> bool {
        self.usart(uart).is_some_and(|uart| uart.is_receiving())
    }

    /// Takes the bytes that a UART has sent since the last call, each with the cycle of its end.
    pub fn take_sent(&mut self, uart: &str) -> Vec<(u64, u8)> {
        let pin = format!("{uart}_TX");
        let is_connected = self.alternate_functions().iter().any(|name| **name == *pin);
        let sent = self.usart(uart).map(Usart::take_sent).unwrap_or_default();
        if is_connected { sent } else { Vec::new() }
    }

    /// Bit rate of a UART, `bit/s`; `None` before it is configured.
    pub fn baud(&mut self, uart: &str) -> Option<f64> {
        let hz = self.clock.hz();
        self.usart(uart)?.bit_cycles().map(|cycles| hz / cycles)
    }

    /// Number of bytes that a UART has lost by overruns.
    pub fn overruns(&mut self, uart: &str) -> u64 {
        self.usart(uart).map_or(0, |uart| uart.overruns)
    }

    /// Sets the serial number, which distinguishes nodes without a channel.
    pub fn set_serial_number(&mut self, serial: [u8; 12]) {
        self.memory.serial = serial;
    }

    /// Whether the CAN controller is bus-off.
    #[must_use]
    pub fn is_can_off(&self) -> bool {
        self.fdcan.is_off()
    }

    /// The CAN controller for its bus, advanced to a cycle.
    pub(crate) fn fdcan(&mut self, now: u64) -> &mut Fdcan {
        self.fdcan.advance(now, &mut self.memory.messages);
        &mut self.fdcan
    }

    /// Whether both pins of the CAN controller are connected.
    pub(crate) fn is_can_connected(&self) -> bool {
        let has = |name: &str| self.ports.iter().flat_map(Gpio::connected).any(|connected| connected == name);
        has("FDCAN1_RX") && has("FDCAN1_TX")
    }
}
