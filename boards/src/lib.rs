//! Board support for DIMSART.
//!
//! Machine units (counts, duty cycles, register bits) exist only below the trait `Board`. A board depends on its
//! device's types, but on no modules, schemes or data base.
//!
//! # Adding a board
//!
//! Add a file that implements `Board`; a file in `catalogue/` with clock, interrupts, motor and built-in
//! scheme; the memory map `memory/NAME.x`; the budget `budgets/NAME.toml`; and a line in `boards!` below,
//! which the build and the host's tools read. List indirect calls of its drivers in `calls.txt`. Add a
//! feature of the board's name with its dependencies to `Cargo.toml`, and one that enables it to
//! `firmware/Cargo.toml`.
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
pub mod moteus;
pub mod motor;
pub mod pending_frames;
#[cfg(target_os = "none")]
mod receive_channels;
pub mod shaft;
#[cfg(all(target_os = "none", feature = "stm32g4"))]
mod stm32g4;
pub mod three_phase;

#[cfg(target_os = "none")]
pub use board::{
    Axes, Board, BoardParts, CommandPort, Idle, Joints, Limits, LinkIn, LinkOut, MAX_PAYLOAD_BYTES, Storage,
    needs_power_stage,
};
#[cfg(target_os = "none")]
pub use receive_channels::ReceiveChannels;

use catalogue::BoardInfo;

/// Registers the boards; `Selected` is the board of the build.
macro_rules! boards {
    ($($name:literal $module:ident $board:ident $tooling:expr;)*) => {
        $(
            #[cfg(all(target_os = "none", feature = $name))]
            mod $module;
            #[cfg(all(target_os = "none", feature = $name))]
            pub use $module::$board as Selected;
            /// Processor clock of the selected board.
            #[cfg(all(target_os = "none", feature = $name))]
            pub const CLOCK_HZ: u32 = $tooling.clock_hz;
            /// Ticks per second of the selected board. Its time driver must support this rate.
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
