//! An STM32G431 or STM32G474.

mod adc;
mod analog;
mod blocks;
mod clock;
mod dma;
pub mod fdcan;
mod flash;
mod gpio;
mod i2c;
mod iwdg;
mod journal;
mod map;
mod memory;
mod opamp;
mod part;
mod pins;
mod pwr;
mod rcc;
mod registers;
mod spi;
mod timer;
mod usart;
mod violation;

use std::collections::BTreeMap;

use cycles::AccessError;
use cycles::image::Image;
use cycles::instruction::Width;
use cycles::processor::{AccessPoint, Bus, Reset};

pub use analog::VoltageSource;
pub use clock::Clock;
pub use flash::FlashFault;
pub use i2c::{I2cDevice, I2cEvent};
pub use journal::Journal;
pub use part::ChipModel;
pub use spi::{SpiDevice, SpiEvent};
pub use timer::{GateDriver, Pulses};
pub use violation::Violation;

use self::adc::{Adc, Common};
use self::analog::Scene;
use self::dma::Dma;
use self::fdcan::Fdcan;
use self::flash::Flash;
use self::gpio::Gpio;
use self::i2c::I2c;
use self::iwdg::Iwdg;
use self::map::{Block, DMAMUX, I2CS, PLAIN, PORTS, SPIS, TIMERS, USARTS};
use self::memory::{MESSAGES, Memory};
use self::opamp::Opamp;
use self::pwr::Pwr;
use self::rcc::{Cause, Rcc};
use self::registers::Registers;
use self::spi::Spi;
use self::timer::Timer;
use self::usart::Usart;
use self::violation::Access;

/// Frequency of the internal oscillator, which is the clock after a reset.
const START_HZ: f64 = 16e6;

/// A chip: its memory, its peripherals and the devices at its pins.
#[derive(Debug, Clone)]
pub struct Stm32g4 {
    part: ChipModel,
    clock: Clock,
    memory: Memory,
    rcc: Rcc,
    pwr: Pwr,
    flash: Flash,
    ports: Vec<Gpio>,
    timers: Vec<Timer>,
    usarts: Vec<Usart>,
    spis: Vec<Spi>,
    i2cs: Vec<I2c>,
    dmas: Vec<Dma>,
    iwdg: Iwdg,
    adcs: [Adc; 2],
    adc_common: Common,
    opamp: Opamp,
    /// Voltage sources at pins.
    wires: BTreeMap<(char, u32), VoltageSource>,
    /// Gate driver between timer 1 and the bridge.
    gate_driver: GateDriver,
    fdcan: Fdcan,
    plain: Vec<Registers>,
    violations: Vec<Violation>,
    /// Register writes, for reviews of a program's chip setup.
    pub journal: Journal,
    resets: Vec<Reset>,
}

impl Stm32g4 {
    /// Returns a chip after power-on, with an image in its flash. `crystal_hz` is `None` if the board's
    /// crystal does not oscillate.
    #[must_use]
    pub fn new(part: ChipModel, image: &Image, crystal_hz: Option<f64>) -> Self {
        Self {
            part,
            clock: Clock::new(START_HZ),
            memory: Memory::new(part, image),
            rcc: Rcc::new(part, crystal_hz),
            pwr: Pwr::new(part),
            flash: Flash::new(part),
            ports: PORTS.map(|letter| Gpio::new(part, letter)).into(),
            timers: TIMERS.map(|number| Timer::new(part, number)).into(),
            usarts: USARTS.map(|name| Usart::new(part, name)).into(),
            spis: SPIS.map(|name| Spi::new(part, name)).into(),
            i2cs: I2CS.map(|name| I2c::new(part, name)).into(),
            dmas: ["DMA1", "DMA2"].map(|name| Dma::new(part, name)).into(),
            iwdg: Iwdg::new(part),
            adcs: [1, 2].map(|number| Adc::new(part, number)),
            adc_common: Common::new(part),
            opamp: Opamp::new(part),
            wires: BTreeMap::new(),
            gate_driver: GateDriver::default(),
            fdcan: Fdcan::new(part),
            plain: PLAIN.map(|(class, name)| Registers::new(part, class, name)).into(),
            violations: Vec::new(),
            journal: Journal::default(),
            resets: Vec::new(),
        }
    }

    /// Returns the program's violations of the reference manual.
    #[must_use]
    pub fn violations(&self) -> &[Violation] {
        &self.violations
    }

    /// Resets since power-on.
    #[must_use]
    pub fn resets(&self) -> &[Reset] {
        &self.resets
    }

    /// Clock frequency and time.
    #[must_use]
    pub fn clock(&self) -> &Clock {
        &self.clock
    }

    /// Sets the frequency of the board's crystal; `None` if it does not oscillate.
    pub fn set_crystal(&mut self, hz: Option<f64>) {
        self.rcc.crystal_hz = hz;
    }

    /// Sets the fault of the flash.
    pub fn set_flash_fault(&mut self, fault: FlashFault) {
        self.flash.fault = fault;
    }

    /// The bytes of the flash, to be changed as by damage or a programmer.
    pub fn flash(&mut self) -> &mut [u8] {
        &mut self.memory.flash
    }

    /// Numbers of erased pages and of programmed 64-bit words.
    #[must_use]
    pub fn flash_writes(&self) -> (u64, u64) {
        (self.flash.erased_pages, self.flash.programmed)
    }

    fn timer(&mut self, number: u32) -> Option<&mut Timer> {
        self.timers.iter_mut().zip(TIMERS).find(|(_, known)| *known == number).map(|(timer, _)| timer)
    }

    fn usart(&mut self, name: &str) -> Option<&mut Usart> {
        self.usarts.iter_mut().zip(USARTS).find(|(_, known)| *known == name).map(|(usart, _)| usart)
    }

    /// Applies the clock frequency that RCC generates, and checks it.
    fn see_clock(&mut self, at: AccessPoint) {
        let hz = self.rcc.bus_hz();
        #[expect(clippy::float_cmp, reason = "the same registers give the same number")]
        if hz != self.clock.hz() && hz > 0.0 {
            self.clock.change(hz, at.cycle);
        }
        self.fdcan.set_clock(self.rcc.can_hz(), self.clock.hz());
        let access = &mut Access { at, violations: &mut self.violations };
        let faults = [self.pwr.clock_fault(hz, self.flash.wait_states()), self.rcc.pll_fault()];
        faults.into_iter().flatten().for_each(|fault| access.violates(fault));
    }

    /// Advances timer 1 and the ADCs together: each sample uses the state of the bridge at its instant.
    fn convert(&mut self, now: u64) {
        loop {
            let timer = self.timers.first().map_or(u64::MAX, Timer::next_event);
            let converters = self.adcs.iter().map(Adc::next_event).min().unwrap_or(u64::MAX);
            let next = timer.min(converters).min(now);
            if let Some(timer) = self.timers.first_mut() {
                timer.advance(next);
            }
            self.sample(next);
            let edges = self.timers.first_mut().map(Timer::take_edges).unwrap_or_default();
            for edge in edges {
                self.adcs.iter_mut().for_each(|adc| adc.see(edge, &mut self.violations));
            }
            if next >= now {
                return;
            }
        }
    }

    fn sample(&mut self, now: u64) {
        let Self { adcs, wires, opamp, ports, timers, gate_driver, violations, .. } = self;
        let (bridge, driver) = (timers.first(), *gate_driver);
        let scene = Scene { wires, amplifiers: opamp, ports, bridge, driver, now };
        for adc in adcs {
            adc.advance(now, |sampling| {
                let volts = scene.channel_v(sampling.converter, sampling.channel).unwrap_or_else(|what| {
                    Access { at: sampling.at, violations }.violates(what);
                    0.0
                });
                analog::counts(volts)
            });
        }
    }

    /// Updates SPI and I²C pins after a register write, and checks that the bridge is never short-circuited.
    fn see_pins(&mut self, block: Block, at: AccessPoint) {
        if !matches!(block, Block::Gpio(_) | Block::Timer(1) | Block::Spi(_) | Block::I2c(_)) {
            return;
        }
        let connected = self.alternate_functions();
        if matches!(block, Block::Gpio(_) | Block::Spi(_)) {
            let hz = self.clock.hz();
            for (spi, name) in self.spis.iter_mut().zip(SPIS) {
                let pins = spi::Pins::new(name, &connected, &self.ports, spi.select_pin());
                spi.see_pins(pins, hz, &mut Access { at, violations: &mut self.violations });
            }
        }
        if matches!(block, Block::Gpio(_) | Block::I2c(_)) {
            let hz = self.clock.hz();
            for (i2c, name) in self.i2cs.iter_mut().zip(I2CS) {
                let pins = i2c::Pins::new(name, &connected, &self.ports);
                i2c.see_pins(pins, hz, &mut Access { at, violations: &mut self.violations });
            }
        }
        for channel in 0..3 {
            let number = channel + 1;
            let pins = [format!("TIM1_CH{number}"), format!("TIM1_CH{number}N")];
            let is_wired = pins.iter().all(|pin| connected.iter().any(|connected| connected == pin));
            let misuse = self.timers.first().and_then(|timer| timer.misuse(channel, self.gate_driver));
            if let Some(what) = misuse.filter(|_| is_wired) {
                let access = &mut Access { at, violations: &mut self.violations };
                access.violates(format!("half bridge {number} of TIM1: {what}"));
            }
        }
    }

    /// Checks that a write does not change a pending message.
    fn see_message(&mut self, address: u32, at: AccessPoint) {
        let pending = address.checked_sub(MESSAGES).and_then(|offset| self.fdcan.pending_at(offset));
        if let Some(buffer) = pending {
            let access = &mut Access { at, violations: &mut self.violations };
            access.violates(format!(
                "TX buffer {buffer} of FDCAN1 is written while its transmission is pending"
            ));
        }
    }

    /// Serves all pending DMA requests.
    fn move_data(&mut self, now: u64) {
        while self.move_one(now) {}
    }

    fn move_one(&mut self, now: u64) -> bool {
        for controller in 0..self.dmas.len() {
            for channel in 0..8 {
                let Some(transfer) = self.dmas.get(controller).and_then(|dma| dma.transfer(channel)) else {
                    continue;
                };
                let place = u32::try_from(controller).unwrap_or(0) * 8 + channel;
                let request = self.plain.get(DMAMUX).map_or(0, |mux| mux.bits(4 * place, 0, 7));
                let Some((block, is_receiving)) = requester(request) else { continue };
                if is_receiving == transfer.is_read || !self.wants_dma(block, is_receiving) {
                    continue;
                }
                let Self { usarts, i2cs, memory, .. } = self;
                match block {
                    Block::I2c(place) => {
                        let byte = i2cs.get_mut(place).map_or(0, |i2c| i2c.take_received(now));
                        memory.store(transfer.address, Width::Byte, byte);
                    }
                    Block::Usart(place) if is_receiving => {
                        let byte = usarts.get_mut(place).map_or(0, Usart::take_received);
                        memory.store(transfer.address, Width::Byte, byte);
                    }
                    Block::Usart(place) => {
                        let byte = memory.load(transfer.address, Width::Byte).unwrap_or(0);
                        if let Some(usart) = usarts.get_mut(place) {
                            usart.put_to_send(byte, now);
                        }
                    }
                    _ => continue,
                }
                if let Some(dma) = self.dmas.get_mut(controller) {
                    dma.moved(transfer.channel);
                }
                return true;
            }
        }
        false
    }

    fn wants_dma(&self, block: Block, is_receiving: bool) -> bool {
        match block {
            Block::I2c(place) => self.i2cs.get(place).is_some_and(|i2c| i2c.wants_dma(is_receiving)),
            Block::Usart(place) => self.usarts.get(place).is_some_and(|usart| usart.wants_dma(is_receiving)),
            _ => false,
        }
    }
}

/// Peripheral of a DMAMUX request, and whether the request is for received data (RM0440, "DMAMUX: assignment
/// of multiplexer inputs to resources").
fn requester(request: u32) -> Option<(Block, bool)> {
    let block = match request {
        16 | 17 => Block::I2c(0),
        18 | 19 => Block::I2c(1),
        20 | 21 => Block::I2c(2),
        22 | 23 => Block::I2c(3),
        24 | 25 => Block::Usart(0),
        26 | 27 => Block::Usart(1),
        28 | 29 => Block::Usart(2),
        34 | 35 => Block::Usart(3),
        _ => return None,
    };
    Some((block, request.is_multiple_of(2)))
}

/// Extracts the accessed bytes of a register.
fn part_of(word: u32, address: u32, width: Width) -> u32 {
    let shifted = word >> (8 * (address & 3));
    match width {
        Width::Byte => shifted & 0xFF,
        Width::Half => shifted & 0xFFFF,
        Width::Word => word,
    }
}

impl Bus for Stm32g4 {
    fn load(&mut self, address: u32, width: Width, at: AccessPoint) -> Result<u32, AccessError> {
        if let Some(value) = self.memory.load(address, width) {
            return Ok(value);
        }
        let (block, offset) = self.find(address, at)?;
        self.convert(at.cycle);
        let word = self.read_register(block, offset, width, at);
        Ok(part_of(word, address, width))
    }

    fn store(&mut self, address: u32, width: Width, value: u32, at: AccessPoint) -> Result<(), AccessError> {
        if self.memory.store(address, width, value) {
            self.see_message(address, at);
            return Ok(());
        }
        if self.memory.load(address, Width::Byte).is_some() {
            let clock = self.clock;
            let access = &mut Access { at, violations: &mut self.violations };
            if width == Width::Word {
                self.flash.program(address, value, &mut self.memory.flash, &clock, access);
            } else {
                self.flash.program_part(access);
            }
            return Ok(());
        }
        let (block, offset) = self.find(address, at)?;
        self.convert(at.cycle);
        let shift = 8 * (address & 3);
        let (value, mask) = match width {
            Width::Byte => ((value & 0xFF) << shift, 0xFF << shift),
            Width::Half => ((value & 0xFFFF) << shift, 0xFFFF << shift),
            Width::Word => (value, u32::MAX),
        };
        let before = self.registers(block).map_or(0, |registers| registers.get(offset));
        let value = value | before & !mask;
        if let Some(registers) = self.registers(block) {
            let name = registers.name(offset);
            self.journal.note(name, value);
        }
        self.write_register(block, offset, value, width, at);
        self.see_pins(block, at);
        self.move_data(at.cycle);
        Ok(())
    }

    fn wait(&self, address: u32, now: u64) -> u64 {
        self.flash.wait(address, now)
    }

    fn advance(&mut self, now: u64) {
        self.rcc.advance(now);
        self.flash.advance(now);
        self.convert(now);
        self.timers.iter_mut().for_each(|timer| timer.advance(now));
        self.usarts.iter_mut().for_each(|usart| usart.advance(now));
        self.spis.iter_mut().for_each(|spi| spi.advance(now));
        self.i2cs.iter_mut().for_each(|i2c| i2c.advance(now));
        self.fdcan.advance(now, &mut self.memory.messages);
        self.move_data(now);
    }

    fn next_event(&self) -> u64 {
        let timers = self.timers.iter().map(Timer::next_event);
        let usarts = self.usarts.iter().map(Usart::next_event);
        let others = [self.rcc.next_event(), self.flash.next_event(), self.iwdg.next_event()];
        let converters = self.adcs.iter().map(Adc::next_event);
        let others = others.into_iter().chain([self.fdcan.next_event()]);
        let spis = self.spis.iter().map(Spi::next_event);
        let i2cs = self.i2cs.iter().map(I2c::next_event);
        timers.chain(usarts).chain(spis).chain(i2cs).chain(others).chain(converters).min().unwrap_or(u64::MAX)
    }

    fn lines(&self) -> u128 {
        let mut lines = 0u128;
        let mut line = |number: u32, is_active: bool| lines |= u128::from(is_active) << number;
        line(4, self.flash.interrupts());
        line(18, self.adcs.iter().any(Adc::wants_interrupt));
        for (number, is_active) in [21, 22].into_iter().zip(self.fdcan.interrupts()) {
            line(number, is_active);
        }
        for (timer, number) in self.timers.iter().zip(TIMERS) {
            let flags = timer.interrupts();
            match number {
                1 => {
                    line(24, flags & 0x180 != 0);
                    line(25, flags & 1 != 0);
                    line(26, flags & 0x60 != 0);
                    line(27, flags & 0x1E != 0);
                }
                5 => line(50, flags != 0),
                number => line(26 + number, flags != 0),
            }
        }
        for (usart, number) in self.usarts.iter().zip([37, 38, 39, 91]) {
            line(number, usart.interrupts());
        }
        for (spi, number) in self.spis.iter().zip([35, 36, 51]) {
            line(number, spi.interrupts());
        }
        for (dma, first, eighth) in
            self.dmas.iter().zip([(11, 96), (56, 99)]).map(|(dma, (a, b))| (dma, a, b))
        {
            let channels = dma.interrupts();
            (0..7).for_each(|channel| line(first + channel, channels >> channel & 1 == 1));
            line(eighth, channels >> 7 & 1 == 1);
        }
        lines
    }

    fn wants_reset(&self, now: u64) -> bool {
        self.iwdg.bites(now)
    }

    fn reset(&mut self, cause: Reset, now: u64) {
        self.resets.push(cause);
        self.rcc.reset(match cause {
            Reset::Program => Cause::Program,
            Reset::Chip => Cause::Watchdog,
            Reset::Pin => Cause::Pin,
        });
        self.iwdg = Iwdg::new(self.part);
        self.clock.change(START_HZ, now);
        self.fdcan.set_clock(self.rcc.can_hz(), START_HZ);
        let blocks = map::PLACES.iter().map(|place| place.block);
        blocks.for_each(|block| self.reset_block(block, now));
    }
}
