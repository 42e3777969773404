//! Boards that run DIMSART: one file each, one trait, one line to register.
//!
//! Machine units (counts, duty cycles, register bits) live below the trait `Board` and never above it. A board
//! knows its device's types; it knows nothing of modules, schemes or the Data Base.
//!
//! # Adding a board
//!
//! A file here that implements `Board`, its line in `boards!` below, its memory map in `build.rs`, and its
//! feature with its dependencies in `Cargo.toml` (`firmware` passes the feature on). For `cargo xtask`, its
//! budget in `xtask/src/boards.rs`, and for flashing, its chip in `chips.rs`.
#![no_std]

#[cfg(test)]
extern crate std;

#[cfg(target_os = "none")]
mod board;
pub mod chips;
pub mod encoder;
#[cfg(target_os = "none")]
pub mod handover;
pub mod motor;
#[cfg(all(target_os = "none", feature = "stm32g4"))]
mod stm32g4;

#[cfg(target_os = "none")]
pub use board::{Board, CommandPort, Idle, Joints, LinkIn, LinkOut, Parts, Storage};

/// Registers the boards; `Selected` is the one that the build chose.
macro_rules! boards {
    ($($feature:literal $module:ident $board:ident;)*) => {
        $(
            #[cfg(all(target_os = "none", feature = $feature))]
            mod $module;
            #[cfg(all(target_os = "none", feature = $feature))]
            pub use $module::$board as Selected;
        )*
    };
}

boards! {
    "mps2-an386" mps2_an386 Mps2An386;
    "nucleo-g474re" nucleo_g474re NucleoG474re;
    "b-g431b-esc1" b_g431b_esc1 BG431bEsc1;
}
