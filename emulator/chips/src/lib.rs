//! Emulated chips: the processor of `cycles` with memory and peripherals around it.
//!
//! ```text
//! ELF ──▶ Processor ──loads, stores──▶ Stm32g4: one file a peripheral ──▶ pins, lines, wires
//!                   ◀──interrupts────        │
//!                                            └──▶ violations: what the manual forbids
//! ```
//!
//! A peripheral is modelled as far as firmware here uses it; a register that a model does not know of is a violation,
//! never silence. Registers, their bits and their values after a reset stand in `stm32g4/registers.txt`, taken from
//! ST's headers and reference manual and not from the register crate that firmware is built with: what one has wrong the
//! other shows.
#![forbid(unsafe_code)]

mod bench;
mod can_adapter;
mod can_bus;
mod shared_board;
pub mod stm32g4;
mod verdict;

pub use bench::{BOARDS, Bench, Board, KNOWN, Transceiver};
pub use can_adapter::CanAdapter;
pub use can_bus::{CanBus, Fate, Passed};
pub use shared_board::{CommandLine, OnBench, SharedBoard};
pub use stm32g4::{Part, Stm32g4};
pub use verdict::Verdict;
