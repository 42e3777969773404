//! Dispatch of accesses to peripherals.

use cycles::AccessError;
use cycles::instruction::Width;
use cycles::processor::AccessPoint;

use super::Stm32g4;
use super::adc::Adc;
use super::map::{self, Block, TIMERS};
use super::registers::Registers;
use super::violation::Access;

impl Stm32g4 {
    pub(super) fn find(&mut self, address: u32, at: AccessPoint) -> Result<(Block, u32), AccessError> {
        let place = map::find(address).ok_or(AccessError::Unmapped { address })?;
        let offset = (address - place.begin) & !3;
        if let Some((register, bit)) = place.gate
            && !self.rcc.enables(register, bit)
        {
            let name =
                self.registers(place.block).map(|registers| registers.name(offset)).unwrap_or_default();
            let access = &mut Access { at, violations: &mut self.violations };
            access.violates(format!("{name} is accessed while its clock is off"));
        }
        Ok((place.block, offset))
    }

    pub(super) fn registers(&self, block: Block) -> Option<&Registers> {
        Some(match block {
            Block::Rcc => self.rcc.registers(),
            Block::Pwr => self.pwr.registers(),
            Block::Flash => self.flash.registers(),
            Block::Gpio(place) => self.ports.get(place)?.registers(),
            Block::Timer(number) => {
                self.timers.get(TIMERS.iter().position(|known| *known == number)?)?.registers()
            }
            Block::Usart(place) => self.usarts.get(place)?.registers(),
            Block::Spi(place) => self.spis.get(place)?.registers(),
            Block::I2c(place) => self.i2cs.get(place)?.registers(),
            Block::Dma(place) => self.dmas.get(place)?.registers(),
            Block::Iwdg => self.iwdg.registers(),
            Block::Adc(place) => self.adcs.get(place)?.registers(),
            Block::AdcCommon => self.adc_common.registers(),
            Block::Opamp => self.opamp.registers(),
            Block::Fdcan => self.fdcan.registers(),
            Block::StorageOnly(place) => self.plain.get(place)?,
        })
    }

    pub(super) fn read_register(&mut self, block: Block, offset: u32, width: Width, at: AccessPoint) -> u32 {
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
            Block::Spi(place) => self.spis.get_mut(place).map_or(0, |spi| spi.read(offset, width, access)),
            Block::I2c(place) => self.i2cs.get_mut(place).map_or(0, |i2c| i2c.read(offset, access)),
            Block::Dma(place) => self.dmas.get_mut(place).map_or(0, |dma| dma.read(offset, access)),
            Block::Iwdg => self.iwdg.read(offset, access),
            Block::Adc(place) => self.adcs.get_mut(place).map_or(0, |adc| adc.read(offset, access)),
            Block::AdcCommon => {
                let flags = [self.adcs[0].flags(), self.adcs[1].flags()];
                self.adc_common.read(offset, flags, access)
            }
            Block::Opamp => self.opamp.read(offset, access),
            Block::Fdcan => self.fdcan.read(offset, &mut self.memory.messages, access),
            Block::StorageOnly(place) => self.plain.get(place).map_or(0, |plain| plain.read(offset, access)),
        }
    }

    pub(super) fn write_register(
        &mut self,
        block: Block,
        offset: u32,
        value: u32,
        width: Width,
        at: AccessPoint,
    ) {
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
            Block::Spi(place) => {
                if let Some(spi) = self.spis.get_mut(place) {
                    spi.write(offset, value, width, access);
                }
            }
            Block::I2c(place) => {
                if !self.rcc.clocks_i2c_by_bus(place) {
                    access.violates("an I²C does not run on the bus clock: not modelled");
                }
                if let Some(i2c) = self.i2cs.get_mut(place) {
                    i2c.write(offset, value, access);
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
            Block::Fdcan => {
                self.fdcan.set_clock(self.rcc.can_hz(), clock.hz());
                self.fdcan.write(offset, value, &mut self.memory.messages, access);
            }
            Block::StorageOnly(place) => {
                if let Some(plain) = self.plain.get_mut(place) {
                    plain.write(offset, value, access);
                }
            }
        }
    }

    pub(super) fn reset_block(&mut self, block: Block, now: u64) {
        match block {
            Block::Rcc | Block::Iwdg => {}
            Block::Fdcan => self.fdcan.reset(),
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
            Block::Spi(place) => {
                if let Some(spi) = self.spis.get_mut(place) {
                    spi.reset();
                }
            }
            Block::I2c(place) => {
                if let Some(i2c) = self.i2cs.get_mut(place) {
                    i2c.reset();
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
            Block::StorageOnly(place) => {
                if let Some(plain) = self.plain.get_mut(place) {
                    plain.reset();
                }
            }
        }
    }
}
