//! Peripherals by address, with their clock enable bits (RM0440, "Memory map"; ST's headers).

// Enable registers of RCC.
const AHB1: u32 = 0x48;
const AHB2: u32 = 0x4C;
const APB1: u32 = 0x58;
const APB1_HIGH: u32 = 0x5C;
const APB2: u32 = 0x60;

/// A peripheral.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Block {
    Rcc,
    Pwr,
    Flash,
    Gpio(usize),
    /// Number of the timer.
    Timer(u32),
    Usart(usize),
    /// Index of SPI 1 to 3, from 0.
    Spi(usize),
    /// Index of I²C 1 to 4, from 0.
    I2c(usize),
    Dma(usize),
    Iwdg,
    /// Index of ADC1 or ADC2, from 0.
    Adc(usize),
    AdcCommon,
    Opamp,
    Fdcan,
    /// A peripheral that only stores written values.
    StorageOnly(usize),
}

/// Address range of a peripheral.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    pub(super) begin: u32,
    pub(super) bytes: u32,
    pub(super) block: Block,
    /// RCC register and bit that enable its clock.
    pub(super) gate: Option<(u32, u32)>,
}

const fn at(begin: u32, block: Block, gate: Option<(u32, u32)>) -> Place {
    Place { begin, bytes: 0x400, block, gate }
}

const fn part(begin: u32, bytes: u32, block: Block, gate: (u32, u32)) -> Place {
    Place { begin, bytes, block, gate: Some(gate) }
}

/// Modelled UARTs, in the order of their indices.
pub(super) const USARTS: [&str; 4] = ["USART1", "USART2", "USART3", "LPUART1"];
/// Modelled SPIs.
pub(super) const SPIS: [&str; 3] = ["SPI1", "SPI2", "SPI3"];
/// Modelled I²Cs.
pub(super) const I2CS: [&str; 4] = ["I2C1", "I2C2", "I2C3", "I2C4"];
/// GPIO ports.
pub(super) const PORTS: [char; 7] = ['A', 'B', 'C', 'D', 'E', 'F', 'G'];
/// Numbers of the modelled timers.
pub(super) const TIMERS: [u32; 5] = [1, 2, 3, 4, 5];
/// Peripherals that only store written values: class in the register table, name.
pub(super) const PLAIN: [(&str, &str); 5] = [
    ("SYSCFG", "SYSCFG"),
    ("EXTI", "EXTI"),
    ("DMAMUX", "DMAMUX"),
    ("DBGMCU", "DBGMCU"),
    ("CORDIC", "CORDIC"),
];
pub(super) const DMAMUX: usize = 2;

/// All modelled peripherals.
pub(super) const PLACES: &[Place] = &[
    at(0x4000_0000, Block::Timer(2), Some((APB1, 0))),
    at(0x4000_0400, Block::Timer(3), Some((APB1, 1))),
    at(0x4000_0800, Block::Timer(4), Some((APB1, 2))),
    at(0x4000_0C00, Block::Timer(5), Some((APB1, 3))),
    at(0x4000_3000, Block::Iwdg, None),
    at(0x4000_3800, Block::Spi(1), Some((APB1, 14))),
    at(0x4000_3C00, Block::Spi(2), Some((APB1, 15))),
    at(0x4000_4400, Block::Usart(1), Some((APB1, 17))),
    at(0x4000_4800, Block::Usart(2), Some((APB1, 18))),
    at(0x4000_5400, Block::I2c(0), Some((APB1, 21))),
    at(0x4000_5800, Block::I2c(1), Some((APB1, 22))),
    at(0x4000_6400, Block::Fdcan, Some((APB1, 25))),
    at(0x4000_7000, Block::Pwr, Some((APB1, 28))),
    at(0x4000_7800, Block::I2c(2), Some((APB1, 30))),
    at(0x4000_8000, Block::Usart(3), Some((APB1_HIGH, 0))),
    at(0x4000_8400, Block::I2c(3), Some((APB1_HIGH, 1))),
    part(0x4001_0000, 0x300, Block::StorageOnly(0), (APB2, 0)),
    part(0x4001_0300, 0x100, Block::Opamp, (APB2, 0)),
    at(0x4001_0400, Block::StorageOnly(1), None),
    at(0x4001_2C00, Block::Timer(1), Some((APB2, 11))),
    at(0x4001_3000, Block::Spi(0), Some((APB2, 12))),
    at(0x4001_3800, Block::Usart(0), Some((APB2, 14))),
    at(0x4002_0000, Block::Dma(0), Some((AHB1, 0))),
    at(0x4002_0400, Block::Dma(1), Some((AHB1, 1))),
    at(0x4002_0800, Block::StorageOnly(DMAMUX), Some((AHB1, 2))),
    at(0x4002_0C00, Block::StorageOnly(4), Some((AHB1, 3))),
    at(0x4002_1000, Block::Rcc, None),
    at(0x4002_2000, Block::Flash, Some((AHB1, 8))),
    at(0x4800_0000, Block::Gpio(0), Some((AHB2, 0))),
    at(0x4800_0400, Block::Gpio(1), Some((AHB2, 1))),
    at(0x4800_0800, Block::Gpio(2), Some((AHB2, 2))),
    at(0x4800_0C00, Block::Gpio(3), Some((AHB2, 3))),
    at(0x4800_1000, Block::Gpio(4), Some((AHB2, 4))),
    at(0x4800_1400, Block::Gpio(5), Some((AHB2, 5))),
    at(0x4800_1800, Block::Gpio(6), Some((AHB2, 6))),
    part(0x5000_0000, 0x100, Block::Adc(0), (AHB2, 13)),
    part(0x5000_0100, 0x100, Block::Adc(1), (AHB2, 13)),
    part(0x5000_0300, 0x100, Block::AdcCommon, (AHB2, 13)),
    at(0xE004_2000, Block::StorageOnly(3), None),
];

/// The peripheral at an address.
pub(super) fn find(address: u32) -> Option<&'static Place> {
    PLACES.iter().find(|place| (place.begin..place.begin + place.bytes).contains(&address))
}

/// Peripherals that bits of an RCC reset register reset. The corresponding enable register has the same bit
/// positions.
pub(super) fn reset_by(register: u32, bits: u32) -> impl Iterator<Item = Block> {
    const FROM_RESET_TO_ENABLE: u32 = 0x20;
    PLACES.iter().filter_map(move |place| {
        let (enable, bit) = place.gate?;
        (enable == register + FROM_RESET_TO_ENABLE && bits >> bit & 1 == 1).then_some(place.block)
    })
}
