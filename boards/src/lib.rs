//! Boards that run DIMSART: one file each, one trait, one line to register.
//!
//! Machine units (counts, duty cycles, register bits) live below the trait `Board` and never above it. A board
//! knows its device's types; it knows nothing of modules, schemes or the Data Base.
//!
//! # Adding a board
//!
//! A file here that implements `Board`, one in `catalogue/` with its clock, interrupts, motor and built-in scheme, its
//! memory map `memory/NAME.x`, what it may take in `budgets/NAME.toml`, and its line in `boards!` below, which is all that
//! the build and the host's tools read; what its drivers call through pointers stands in `calls.txt`. Cargo wants a feature of the board's name in `Cargo.toml`, with what the board depends on, and
//! a second one that passes it on in `firmware/Cargo.toml`.
#![no_std]

#[cfg(test)]
extern crate std;

pub mod bit_timing;
#[cfg(target_os = "none")]
mod board;
pub mod bus_off;
pub mod can_words;
pub mod catalogue;
pub mod clock_switch;
pub mod current_loop;
pub mod encoder;
pub mod handover;
#[cfg(target_os = "none")]
mod listening;
pub mod moteus;
pub mod motor;
pub mod shaft;
#[cfg(all(target_os = "none", feature = "stm32g4"))]
mod stm32g4;
pub mod three_phase;
pub mod unsent;

#[cfg(target_os = "none")]
pub use board::{
    Axes, Board, CommandPort, Idle, Joints, Limits, LinkIn, LinkOut, MAX_CARRIED_BYTES, Parts, Storage,
    is_driven,
};
#[cfg(target_os = "none")]
pub use listening::Listening;

use catalogue::BoardInfo;

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

boards! {
    "mps2-an386" mps2_an386 Mps2An386 catalogue::mps2_an386::TOOLING;
    "nucleo-g474re" nucleo_g474re NucleoG474re catalogue::nucleo_g474re::TOOLING;
    "b-g431b-esc1" b_g431b_esc1 BG431bEsc1 catalogue::b_g431b_esc1::TOOLING;
}
