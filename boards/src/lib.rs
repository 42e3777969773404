//! Boards that run DIMSART: one file each, one trait, one line to register.
//!
//! Machine units (counts, duty cycles, register bits) live below the trait `Board` and never above it. A board
//! knows its device's types; it knows nothing of modules, schemes or the Data Base.
//!
//! # Adding a board
//!
//! A file here that implements `Board`, its memory map `memory/NAME.x`, what it may take in `budgets/NAME.toml`, and its
//! line in `boards!` below, which is all that the build and the host's tools read; what its drivers call through pointers
//! stands in `calls.txt`. Cargo wants a feature of the board's name in `Cargo.toml`, with what the board depends on, and
//! a second one that passes it on in `firmware/Cargo.toml`.
#![no_std]

#[cfg(test)]
extern crate std;

#[cfg(target_os = "none")]
mod board;
pub mod bus_off;
pub mod catalogue;
pub mod encoder;
pub mod handover;
#[cfg(target_os = "none")]
mod listening;
pub mod motor;
#[cfg(all(target_os = "none", feature = "stm32g4"))]
mod stm32g4;
pub mod unsent;

#[cfg(target_os = "none")]
pub use board::{Axes, Board, CommandPort, Idle, Joints, LinkIn, LinkOut, MAX_CARRIED_BYTES, Parts, Storage};
#[cfg(target_os = "none")]
pub use listening::Listening;

use catalogue::{BoardInfo, CodeMemory, Tooling};

/// Registers the boards; `Selected` is the one that the build chose.
macro_rules! boards {
    ($($name:literal $module:ident $board:ident $tooling:expr;)*) => {
        $(
            #[cfg(all(target_os = "none", feature = $name))]
            mod $module;
            #[cfg(all(target_os = "none", feature = $name))]
            pub use $module::$board as Selected;
            /// Of the clock of the chosen board's processor.
            #[cfg(all(target_os = "none", feature = $name))]
            pub const CLOCK_HZ: u32 = $tooling.clock_hz;
            /// Ticks per second of the chosen board. Its time driver must be able to wake at this rate.
            #[cfg(all(target_os = "none", feature = $name))]
            pub const TICK_HZ: u32 = $tooling.tick_hz;
        )*

        /// Every board.
        pub const BOARDS: &[BoardInfo] = &[$(BoardInfo {
            name: $name,
            memory_map: include_str!(concat!("../memory/", $name, ".x")),
            budget: include_str!(concat!("../budgets/", $name, ".toml")),
            tooling: $tooling,
        }),*];
    };
}

/// Of all boards with an STM32G4: what `stm32g4::start` makes of their crystals.
const STM32G4_CLOCK_HZ: u32 = 168_000_000;

/// Of all boards with an STM32G4: time, tick, lines, background.
const STM32G4_INTERRUPTS: &[(&str, i16)] = &[
    ("TIM3", 0),
    ("TIM5", 0),
    ("CORDIC", 2),
    ("DMA1_CHANNEL1", 4),
    ("DMA1_CHANNEL2", 4),
    ("DMA1_CHANNEL3", 4),
    ("DMA1_CHANNEL4", 4),
    ("FDCAN1_IT0", 4),
    ("FDCAN1_IT1", 4),
    ("FLASH", 4),
    ("LPUART1", 4),
    ("USART2", 4),
    ("USART3", 4),
    ("FMAC", 6),
];

const MPS2_INTERRUPTS: &[(&str, i16)] = &[
    ("boards::mps2_an386::unexpected", 0),
    ("boards::mps2_an386::clock::timer_interrupt", 0x20),
    ("boards::mps2_an386::run_tick", 0x40),
    ("boards::mps2_an386::run_background", 0x80),
    ("boards::mps2_an386::uart::received", 0x80),
    ("boards::mps2_an386::uart::sent", 0x80),
];

boards! {
    "mps2-an386" mps2_an386 Mps2An386
        Tooling { clock_hz: 25_000_000, tick_hz: 1_000, memory: CodeMemory::NoWait, chip: None,
            variants: &["timer-tick", "timer-tick,measure", "auth", "auth,timer-tick"], interrupts: MPS2_INTERRUPTS };
    "nucleo-g474re" nucleo_g474re NucleoG474re
        Tooling { clock_hz: STM32G4_CLOCK_HZ, tick_hz: 1_000, memory: CodeMemory::Stm32G4, chip: Some("STM32G474RETx"),
            variants: &["classic-can", "uart-link", "measure", "by-hand", "auth"], interrupts: STM32G4_INTERRUPTS };
    "b-g431b-esc1" b_g431b_esc1 BG431bEsc1
        Tooling { clock_hz: STM32G4_CLOCK_HZ, tick_hz: 1_000, memory: CodeMemory::Stm32G4, chip: Some("STM32G431CBUx"),
            variants: &[], interrupts: STM32G4_INTERRUPTS };
}
