//! An STM32G431 or STM32G474.

mod adc;
mod analog;
mod clock;
mod dma;
mod flash;
mod gpio;
mod iwdg;
mod journal;
mod map;
mod memory;
mod opamp;
mod part;
mod pwr;
mod rcc;
mod registers;
mod timer;
mod usart;
mod violation;

use std::collections::BTreeMap;

use cycles::image::Image;
use cycles::instruction::Width;
use cycles::processor::{At, Bus, Reset};
use cycles::state::AccessError;

pub use analog::Wire;
pub use clock::Clock;
pub use flash::FlashFault;
pub use journal::Journal;
pub use part::Part;
pub use timer::Pulses;
pub use violation::Violation;

use self::adc::{Adc, Common};
use self::analog::Scene;
use self::dma::Dma;
use self::flash::Flash;
use self::gpio::Gpio;
use self::iwdg::Iwdg;
use self::map::{Block, DMAMUX, PLAIN, PORTS, TIMERS, USARTS};
use self::memory::Memory;
use self::opamp::Opamp;
use self::pwr::Pwr;
use self::rcc::{Cause, Rcc};
use self::registers::Registers;
use self::timer::Timer;
use self::usart::Usart;
use self::violation::Access;

/// Of the internal oscillator that the chip starts with.
const START_HZ: f64 = 16e6;

/// A chip: its memory, its peripherals, and what is wired to its pins.
#[derive(Debug, Clone)]
pub struct Stm32g4 {
    part: Part,
    clock: Clock,
    memory: Memory,
    rcc: Rcc,
    pwr: Pwr,
    flash: Flash,
    ports: Vec<Gpio>,
    timers: Vec<Timer>,
    usarts: Vec<Usart>,
    dmas: Vec<Dma>,
    iwdg: Iwdg,
    adcs: [Adc; 2],
    adc_common: Common,
    opamp: Opamp,
    /// What gives pins their voltages.
    wires: BTreeMap<(char, u32), Wire>,
    plain: Vec<Registers>,
    violations: Vec<Violation>,
    /// What was written, for who reviews how a program sets the chip up.
    pub journal: Journal,
    resets: Vec<Reset>,
}

impl Stm32g4 {
    /// A chip that just got its power, with an image in its flash. `crystal_hz` is none where the board's crystal does not
    /// swing.
    #[must_use]
    pub fn new(part: Part, image: &Image, crystal_hz: Option<f64>) -> Self {
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
            dmas: ["DMA1", "DMA2"].map(|name| Dma::new(part, name)).into(),
            iwdg: Iwdg::new(part),
            adcs: [1, 2].map(|number| Adc::new(part, number)),
            adc_common: Common::new(part),
            opamp: Opamp::new(part),
            wires: BTreeMap::new(),
            plain: PLAIN.map(|(class, name)| Registers::new(part, class, name)).into(),
            violations: Vec::new(),
            journal: Journal::default(),
            resets: Vec::new(),
        }
    }

    /// What the program did that the manual forbids.
    #[must_use]
    pub fn violations(&self) -> &[Violation] {
        &self.violations
    }

    /// Resets since the chip got its power.
    #[must_use]
    pub fn resets(&self) -> &[Reset] {
        &self.resets
    }

    /// Frequency and time.
    #[must_use]
    pub fn clock(&self) -> &Clock {
        &self.clock
    }

    /// Has the board's crystal swing at a frequency, or not.
    pub fn set_crystal(&mut self, hz: Option<f64>) {
        self.rcc.crystal_hz = hz;
    }

    /// What the flash has wrong from now on.
    pub fn set_flash_fault(&mut self, fault: FlashFault) {
        self.flash.fault = fault;
    }

    /// Pages that were erased and 64-bit words that were programmed.
    #[must_use]
    pub fn flash_writes(&self) -> (u64, u64) {
        (self.flash.erased_pages, self.flash.programmed)
    }

    /// The shortest time that the watchdog had left when it was fed, `s`.
    #[must_use]
    pub fn least_watchdog_left_s(&self) -> f64 {
        self.iwdg.least_left_s
    }

    /// Alternate functions that pins are connected to, such as `TIM1_CH1`.
    #[must_use]
    pub fn connected(&self) -> Vec<&'static str> {
        self.ports.iter().flat_map(Gpio::connected).collect()
    }

    /// The level that a pin is driven to; none when the chip does not drive it as an output.
    #[must_use]
    pub fn output(&self, port: char, pin: u32) -> Option<bool> {
        let place = PORTS.iter().position(|letter| *letter == port)?;
        self.ports.get(place)?.output(pin)
    }

    /// The level that the outside has a pin at.
    pub fn set_input(&mut self, port: char, pin: u32, is_high: bool) {
        for gpio in
            self.ports.iter_mut().zip(PORTS).filter(|(_, letter)| *letter == port).map(|(gpio, _)| gpio)
        {
            gpio.set_input(pin, is_high);
        }
    }

    /// What a pin is connected to, for converters and amplifiers.
    pub fn wire(&mut self, port: char, pin: u32, wire: Wire) {
        self.wires.insert((port, pin), wire);
    }

    /// The voltage that the outside has a pin at.
    pub fn set_voltage(&mut self, port: char, pin: u32, volts: f64) {
        self.wire(port, pin, Wire::At(volts));
    }

    /// What timer 1 puts on the bridge, if all of its pins are connected.
    #[must_use]
    pub fn pulses(&self) -> Option<Pulses> {
        let timer = self.timers.first()?;
        let connected = self.connected();
        let needs: &[&str] = if timer.is_complementary() {
            &["TIM1_CH1", "TIM1_CH2", "TIM1_CH3", "TIM1_CH1N", "TIM1_CH2N", "TIM1_CH3N"]
        } else {
            &["TIM1_CH1", "TIM1_CH2", "TIM1_CH3"]
        };
        needs.iter().all(|name| connected.contains(name)).then(|| timer.pulses()).flatten()
    }

    /// The next cycle in which the lower switches of timer 1's bridge are in the middle of their time; none while its timer does
    /// not count up and down.
    #[must_use]
    pub fn next_middle(&self) -> Option<u64> {
        self.timers.first()?.next_top()
    }

    /// When timer 1 was allowed to drive its bridge (`MOE`), or was not any more, since this was last asked: cycle, whether it
    /// is.
    pub fn take_switched(&mut self) -> Vec<(u64, bool)> {
        self.timers.first_mut().map(Timer::take_switched).unwrap_or_default()
    }

    /// Cycles from the end of an injected sequence of converter 1 to its flag's being cleared: the least and the most since this
    /// was last asked.
    pub fn take_answer_cycles(&mut self) -> Option<(u64, u64)> {
        self.adcs[0].take_answer_cycles()
    }

    /// Turns the shaft of an encoder on a timer's first two channels, by so many counts.
    pub fn turn(&mut self, timer: u32, counts: i64) {
        let connected = self.connected();
        let is_connected = [1, 2].iter().all(|channel| {
            let name = format!("TIM{timer}_CH{channel}");
            connected.iter().any(|connected| **connected == *name)
        });
        if is_connected && let Some(timer) = self.timer(timer) {
            timer.turn(counts);
        }
    }

    /// Puts bytes on the line to a UART, from cycle `now` on; lost when its pin is not connected.
    pub fn receive(&mut self, uart: &str, bytes: &[u8], now: u64) {
        let pin = format!("{uart}_RX");
        if self.connected().iter().any(|name| **name == *pin)
            && let Some(uart) = self.usart(uart)
        {
            uart.receive(bytes, now);
        }
    }

    /// Whether bytes for a UART are still on the line.
    pub fn is_receiving(&mut self, uart: &str) -> bool {
        self.usart(uart).is_some_and(|uart| uart.is_receiving())
    }

    /// What a UART has sent since this was last asked, with the cycle of each byte's end.
    pub fn take_sent(&mut self, uart: &str) -> Vec<(u64, u8)> {
        let pin = format!("{uart}_TX");
        let is_connected = self.connected().iter().any(|name| **name == *pin);
        let sent = self.usart(uart).map(Usart::take_sent).unwrap_or_default();
        if is_connected { sent } else { Vec::new() }
    }

    /// Bits per second of a UART; none before it is set up.
    pub fn baud(&mut self, uart: &str) -> Option<f64> {
        let hz = self.clock.hz();
        self.usart(uart)?.bit_cycles().map(|cycles| hz / cycles)
    }

    /// Bytes that came to a UART while the one before was not taken.
    pub fn overruns(&mut self, uart: &str) -> u64 {
        self.usart(uart).map_or(0, |uart| uart.overruns)
    }

    fn timer(&mut self, number: u32) -> Option<&mut Timer> {
        self.timers.iter_mut().zip(TIMERS).find(|(_, known)| *known == number).map(|(timer, _)| timer)
    }

    fn usart(&mut self, name: &str) -> Option<&mut Usart> {
        self.usarts.iter_mut().zip(USARTS).find(|(_, known)| *known == name).map(|(usart, _)| usart)
    }

    fn registers(&self, block: Block) -> Option<&Registers> {
        Some(match block {
            Block::Rcc => self.rcc.registers(),
            Block::Pwr => self.pwr.registers(),
            Block::Flash => self.flash.registers(),
            Block::Gpio(place) => self.ports.get(place)?.registers(),
            Block::Timer(number) => {
                self.timers.get(TIMERS.iter().position(|known| *known == number)?)?.registers()
            }
            Block::Usart(place) => self.usarts.get(place)?.registers(),
            Block::Dma(place) => self.dmas.get(place)?.registers(),
            Block::Iwdg => self.iwdg.registers(),
            Block::Adc(place) => self.adcs.get(place)?.registers(),
            Block::AdcCommon => self.adc_common.registers(),
            Block::Opamp => self.opamp.registers(),
            Block::Plain(place) => self.plain.get(place)?,
        })
    }

    fn read_register(&mut self, block: Block, offset: u32, at: At) -> u32 {
        let access = &mut Access { at, violations: &mut self.violations };
        match block {
            Block::Rcc => self.rcc.read(offset, access),
            Block::Pwr => self.pwr.read(offset, access),
            Block::Flash => self.flash.read(offset, access),
            Block::Gpio(place) => self.ports.get_mut(place).map_or(0, |port| port.read(offset, access)),
            Block::Timer(number) => {
                let place = TIMERS.iter().position(|known| *known == number).unwrap_or(0);
                self.timers.get_mut(place).map_or(0, |timer| timer.read(offset, access))
            }
            Block::Usart(place) => self.usarts.get_mut(place).map_or(0, |usart| usart.read(offset, access)),
            Block::Dma(place) => self.dmas.get_mut(place).map_or(0, |dma| dma.read(offset, access)),
            Block::Iwdg => self.iwdg.read(offset, access),
            Block::Adc(place) => self.adcs.get_mut(place).map_or(0, |adc| adc.read(offset, access)),
            Block::AdcCommon => {
                let flags = [self.adcs[0].flags(), self.adcs[1].flags()];
                self.adc_common.read(offset, flags, access)
            }
            Block::Opamp => self.opamp.read(offset, access),
            Block::Plain(place) => self.plain.get(place).map_or(0, |plain| plain.read(offset, access)),
        }
    }

    fn write_register(&mut self, block: Block, offset: u32, value: u32, at: At) {
        let clock = self.clock;
        let access = &mut Access { at, violations: &mut self.violations };
        match block {
            Block::Rcc => {
                if let Some((register, bits)) = self.rcc.write(offset, value, &clock, access) {
                    map::reset_by(register, bits).for_each(|block| self.reset_block(block, at.cycle));
                }
                self.see_clock(at);
            }
            Block::Pwr => {
                self.pwr.write(offset, value, access);
                self.see_clock(at);
            }
            Block::Flash => {
                self.flash.write(offset, value, &mut self.memory.flash, &clock, access);
                self.see_clock(at);
            }
            Block::Gpio(place) => {
                if let Some(port) = self.ports.get_mut(place) {
                    port.write(offset, value, access);
                }
            }
            Block::Timer(number) => {
                let place = TIMERS.iter().position(|known| *known == number).unwrap_or(0);
                if let Some(timer) = self.timers.get_mut(place) {
                    timer.write(offset, value, access);
                }
            }
            Block::Usart(place) => {
                if let Some(usart) = self.usarts.get_mut(place) {
                    usart.write(offset, value, access);
                }
            }
            Block::Dma(place) => {
                if let Some(dma) = self.dmas.get_mut(place) {
                    dma.write(offset, value, access);
                }
            }
            Block::Iwdg => self.iwdg.write(offset, value, &clock, access),
            Block::Adc(place) => {
                let ticks = self.adc_common.ticks(clock.hz(), self.rcc.clocks_converters());
                let is_alone =
                    !self.adcs.iter().enumerate().any(|(other, adc)| other != place && adc.is_on());
                let Some(adc) = self.adcs.get_mut(place) else { return };
                adc.write(offset, value, ticks, is_alone, &clock, access);
                let unknown = adc.awaits().zip(self.timers.first());
                if let Some(what) = unknown.and_then(|(output, timer)| timer.unknown_trigger(output)) {
                    access.violates(what);
                }
            }
            Block::AdcCommon => {
                let is_on = self.adcs.iter().any(Adc::is_on);
                self.adc_common.write(offset, value, is_on, access);
            }
            Block::Opamp => self.opamp.write(offset, value, &clock, access),
            Block::Plain(place) => {
                if let Some(plain) = self.plain.get_mut(place) {
                    plain.write(offset, value, access);
                }
            }
        }
    }

    fn reset_block(&mut self, block: Block, now: u64) {
        match block {
            Block::Rcc | Block::Iwdg => {}
            Block::Pwr => self.pwr.reset(),
            Block::Flash => self.flash.reset(),
            Block::Gpio(place) => {
                if let Some(port) = self.ports.get_mut(place) {
                    port.reset(self.part);
                }
            }
            Block::Timer(number) => {
                if let Some(timer) = self.timer(number) {
                    timer.reset(now);
                }
            }
            Block::Usart(place) => {
                if let Some(usart) = self.usarts.get_mut(place) {
                    usart.reset();
                }
            }
            Block::Dma(place) => {
                if let Some(dma) = self.dmas.get_mut(place) {
                    dma.reset();
                }
            }
            Block::Adc(place) => {
                if let Some(adc) = self.adcs.get_mut(place) {
                    adc.reset();
                }
            }
            Block::AdcCommon => self.adc_common.reset(),
            Block::Opamp => self.opamp.reset(),
            Block::Plain(place) => {
                if let Some(plain) = self.plain.get_mut(place) {
                    plain.reset();
                }
            }
        }
    }

    /// Takes over the clock that RCC makes, and checks it.
    fn see_clock(&mut self, at: At) {
        let hz = self.rcc.bus_hz();
        #[expect(clippy::float_cmp, reason = "the same registers give the same number")]
        if hz != self.clock.hz() && hz > 0.0 {
            self.clock.change(hz, at.cycle);
        }
        let access = &mut Access { at, violations: &mut self.violations };
        let faults = [self.pwr.clock_fault(hz, self.flash.wait_states()), self.rcc.pll_fault()];
        faults.into_iter().flatten().for_each(|fault| access.violates(fault));
    }

    /// Lets timer 1 and the converters go on together: each sample is of the bridge as it was at that instant.
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
        let Self { adcs, wires, opamp, ports, timers, violations, .. } = self;
        let scene = Scene { wires, amplifiers: opamp, ports, bridge: timers.first(), now };
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

    /// Serves the DMA's requests until none is left.
    fn move_data(&mut self, now: u64) {
        while self.move_one(now) {}
    }

    fn move_one(&mut self, now: u64) -> bool {
        for (controller, dma) in self.dmas.iter_mut().enumerate() {
            for channel in 0..8 {
                let Some(transfer) = dma.transfer(channel) else { continue };
                let place = u32::try_from(controller).unwrap_or(0) * 8 + channel;
                let request = self.plain.get(DMAMUX).map_or(0, |mux| mux.bits(4 * place, 0, 7));
                let Some((usart, is_receiving)) = requester(request) else { continue };
                let Some(usart) = self.usarts.get_mut(usart) else { continue };
                if is_receiving == transfer.is_read || !usart.wants_dma(is_receiving) {
                    continue;
                }
                if is_receiving {
                    let byte = usart.take_received();
                    self.memory.store(transfer.address, Width::Byte, byte);
                } else {
                    let byte = self.memory.load(transfer.address, Width::Byte).unwrap_or(0);
                    usart.put_to_send(byte, now);
                }
                dma.moved(transfer.channel);
                return true;
            }
        }
        false
    }

    fn find(&mut self, address: u32, at: At) -> Result<(Block, u32), AccessError> {
        let place = map::find(address).ok_or(AccessError::Unmapped { address })?;
        let offset = (address - place.begin) & !3;
        if let Some((register, bit)) = place.gate
            && !self.rcc.enables(register, bit)
        {
            let name =
                self.registers(place.block).map(|registers| registers.name(offset)).unwrap_or_default();
            let access = &mut Access { at, violations: &mut self.violations };
            access.violates(format!("{name} is accessed without a clock"));
        }
        Ok((place.block, offset))
    }
}

/// The UART behind a request of the multiplexer, and whether it has received (RM0440, "DMAMUX: assignment of multiplexer
/// inputs to resources").
fn requester(request: u32) -> Option<(usize, bool)> {
    let usart = match request {
        24 | 25 => 0,
        26 | 27 => 1,
        28 | 29 => 2,
        34 | 35 => 3,
        _ => return None,
    };
    Some((usart, request.is_multiple_of(2)))
}

/// What an access takes of the register that it is in.
fn part_of(word: u32, address: u32, width: Width) -> u32 {
    let shifted = word >> (8 * (address & 3));
    match width {
        Width::Byte => shifted & 0xFF,
        Width::Half => shifted & 0xFFFF,
        Width::Word => word,
    }
}

impl Bus for Stm32g4 {
    fn load(&mut self, address: u32, width: Width, at: At) -> Result<u32, AccessError> {
        if let Some(value) = self.memory.load(address, width) {
            return Ok(value);
        }
        let (block, offset) = self.find(address, at)?;
        self.convert(at.cycle);
        let word = self.read_register(block, offset, at);
        Ok(part_of(word, address, width))
    }

    fn store(&mut self, address: u32, width: Width, value: u32, at: At) -> Result<(), AccessError> {
        if self.memory.store(address, width, value) {
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
        self.write_register(block, offset, value, at);
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
        self.move_data(now);
    }

    fn next_event(&self) -> u64 {
        let timers = self.timers.iter().map(Timer::next_event);
        let usarts = self.usarts.iter().map(Usart::next_event);
        let others = [self.rcc.next_event(), self.flash.next_event(), self.iwdg.next_event()];
        let converters = self.adcs.iter().map(Adc::next_event);
        timers.chain(usarts).chain(others).chain(converters).min().unwrap_or(u64::MAX)
    }

    fn lines(&self) -> u128 {
        let mut lines = 0u128;
        let mut line = |number: u32, is_active: bool| lines |= u128::from(is_active) << number;
        line(4, self.flash.interrupts());
        line(18, self.adcs.iter().any(Adc::wants_interrupt));
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
        let blocks = map::PLACES.iter().map(|place| place.block);
        blocks.for_each(|block| self.reset_block(block, now));
    }
}
