//! Emulated chips: the processor of `cycles` with memory and peripherals.
//!
//! ```text
//! ELF ──▶ Processor ──loads, stores──▶ Stm32g4: one file per peripheral ──▶ pins, serial lines, buses
//!                   ◀──interrupts────        │
//!                                            └──▶ violations of the reference manual
//! ```
//!
//! The models cover the features that this project's firmware uses. Access to an unknown register is a
//! violation. Registers, their bits and reset values are listed in `stm32g4/registers.txt`. The list comes
//! from ST's headers and reference manual, not from the firmware's register crate: an error in either one
//! becomes visible.
#![forbid(unsafe_code)]

mod bench;
mod can_adapter;
mod can_bus;
mod shared_board;
pub mod stm32g4;
mod verdict;

pub use bench::{BOARDS, Bench, Board, KNOWN_VIOLATIONS, Transceiver};
pub use can_adapter::CanAdapter;
pub use can_bus::{BusFrame, CanBus, FrameResult};
pub use shared_board::{CommandLine, OnBench, SharedBoard};
pub use stm32g4::{ChipModel, Stm32g4};
pub use verdict::Verdict;
