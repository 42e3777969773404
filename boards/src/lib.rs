//! Boards that run DIMSART: one file each, one trait, one line to register.
//!
//! Machine units (counts, duty cycles, register bits) live below the trait `Board` and never above it. A board
//! knows its device's types; it knows nothing of modules, schemes or the Data Base.
//!
//! # Adding a board
//!
//! A file here that implements `Board`, its memory map `memory/NAME.x`, and its line in `boards!` below, which is all
//! that the build and `cargo xtask` read. Cargo wants a feature of the board's name in `Cargo.toml`, with what the
//! board depends on, and a second one that passes it on in `firmware/Cargo.toml`.
#![no_std]

#[cfg(test)]
extern crate std;

#[cfg(target_os = "none")]
mod board;
pub mod bus_off;
pub mod catalogue;
pub mod encoder;
#[cfg(target_os = "none")]
pub mod handover;
#[cfg(target_os = "none")]
mod listening;
pub mod motor;
#[cfg(all(target_os = "none", feature = "stm32g4"))]
mod stm32g4;

#[cfg(target_os = "none")]
pub use board::{Board, CommandPort, Idle, Joints, LinkIn, LinkOut, Parts, Storage};
#[cfg(target_os = "none")]
pub use listening::Listening;

use catalogue::{BoardInfo, Size, Tooling};

/// Registers the boards; `Selected` is the one that the build chose.
macro_rules! boards {
    ($($name:literal $module:ident $board:ident $tooling:expr;)*) => {
        $(
            #[cfg(all(target_os = "none", feature = $name))]
            mod $module;
            #[cfg(all(target_os = "none", feature = $name))]
            pub use $module::$board as Selected;
        )*

        /// Every board.
        pub const BOARDS: &[BoardInfo] = &[$(BoardInfo {
            name: $name,
            memory_map: include_str!(concat!("../memory/", $name, ".x")),
            tooling: $tooling,
        }),*];
    };
}

boards! {
    "mps2-an386" mps2_an386 Mps2An386
        Tooling { chip: None, budget: None, variants: &["timer-tick"] };
    "nucleo-g474re" nucleo_g474re NucleoG474re
        Tooling { chip: Some("STM32G474RETx"), budget: Some(Size { flash: 96 * 1024, ram: 32 * 1024 }),
            variants: &["classic-can", "uart-link"] };
    // A quarter of its flash to spare; the linker keeps the RAM.
    "b-g431b-esc1" b_g431b_esc1 BG431bEsc1
        Tooling { chip: Some("STM32G431CBUx"), budget: Some(Size { flash: 96 * 1024, ram: 24_960 }), variants: &[] };
}
