//! Emulated chips.

/// A chip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ChipModel {
    /// STM32G431CB: 128 KiB of flash in one bank, 22 + 10 KiB of SRAM.
    G431cb,
    /// STM32G474RE: 512 KiB of flash in two banks, 96 + 32 KiB of SRAM.
    G474re,
}

impl ChipModel {
    /// Name of the chip in the register table.
    pub(super) fn family(self) -> &'static str {
        match self {
            Self::G431cb => "G431",
            Self::G474re => "G474",
        }
    }

    pub(super) fn flash_bytes(self) -> usize {
        match self {
            Self::G431cb => 128 << 10,
            Self::G474re => 512 << 10,
        }
    }

    /// Bytes of SRAM 1 and 2 together; bytes of CCM SRAM.
    pub(super) fn sram_bytes(self) -> (usize, usize) {
        match self {
            Self::G431cb => (22 << 10, 10 << 10),
            Self::G474re => (96 << 10, 32 << 10),
        }
    }

    /// Number of flash banks. One bank can be read while the other is written.
    pub(super) fn banks(self) -> u32 {
        match self {
            Self::G431cb => 1,
            Self::G474re => 2,
        }
    }

    /// Alternate functions that this project's firmware uses.
    pub(super) fn functions(self) -> &'static [Function] {
        match self {
            Self::G431cb => G431_FUNCTIONS,
            Self::G474re => G474_FUNCTIONS,
        }
    }
}

/// An alternate function: port, pin, number, name.
#[derive(Debug, Clone, Copy)]
pub(super) struct Function(pub(super) char, pub(super) u32, pub(super) u32, pub(super) &'static str);

/// DS12589, table of alternate functions.
const G431_FUNCTIONS: &[Function] = &[
    Function('A', 8, 6, "TIM1_CH1"),
    Function('A', 9, 6, "TIM1_CH2"),
    Function('A', 10, 6, "TIM1_CH3"),
    Function('C', 13, 4, "TIM1_CH1N"),
    Function('A', 12, 6, "TIM1_CH2N"),
    Function('B', 15, 4, "TIM1_CH3N"),
    Function('B', 6, 2, "TIM4_CH1"),
    Function('B', 7, 2, "TIM4_CH2"),
    Function('B', 3, 7, "USART2_TX"),
    Function('B', 4, 7, "USART2_RX"),
    Function('A', 11, 9, "FDCAN1_RX"),
    Function('B', 9, 9, "FDCAN1_TX"),
    Function('A', 13, 0, "SWDIO"),
    Function('A', 14, 0, "SWCLK"),
];

/// DS12288, table of alternate functions.
const G474_FUNCTIONS: &[Function] = &[
    Function('A', 0, 1, "TIM2_CH1"),
    Function('A', 1, 1, "TIM2_CH2"),
    Function('A', 6, 2, "TIM3_CH1"),
    Function('A', 7, 2, "TIM3_CH2"),
    Function('B', 6, 2, "TIM4_CH1"),
    Function('B', 7, 2, "TIM4_CH2"),
    Function('A', 8, 6, "TIM1_CH1"),
    Function('A', 9, 6, "TIM1_CH2"),
    Function('A', 10, 6, "TIM1_CH3"),
    Function('A', 7, 6, "TIM1_CH1N"),
    Function('B', 0, 6, "TIM1_CH2N"),
    Function('B', 1, 6, "TIM1_CH3N"),
    Function('A', 15, 1, "TIM2_CH1"),
    Function('B', 3, 1, "TIM2_CH2"),
    Function('C', 10, 6, "SPI3_SCK"),
    Function('C', 11, 6, "SPI3_MISO"),
    Function('C', 12, 6, "SPI3_MOSI"),
    Function('C', 6, 8, "I2C4_SCL"),
    Function('C', 7, 8, "I2C4_SDA"),
    Function('A', 2, 12, "LPUART1_TX"),
    Function('A', 3, 12, "LPUART1_RX"),
    Function('A', 11, 9, "FDCAN1_RX"),
    Function('A', 12, 9, "FDCAN1_TX"),
    Function('C', 10, 7, "USART3_TX"),
    Function('C', 11, 7, "USART3_RX"),
    Function('A', 13, 0, "SWDIO"),
    Function('A', 14, 0, "SWCLK"),
];
