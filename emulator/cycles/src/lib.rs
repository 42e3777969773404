//! Worst-case cycles and stack of Cortex-M4F code, read from the ELF that is flashed.
//!
//! ```text
//! ELF ──▶ Image ──▶ Code: every instruction, decoded once
//!                     │
//!                     ▼
//!           execute: what an instruction does, written once, over any Domain of values
//!             │                                   │
//!   Concrete: 32-bit words              Abstract: what a word can be
//!             │                                   │
//!        Machine: runs it               Bound: every path, merged, the longest kept
//!             └──────────┬────────────────────────┘
//!                     Timing: cycles of an instruction, for both
//! ```
//!
//! A [`Bound`](bound::Bound) begins with memory as it is, such as that of a controller with its scheme, makes unknown what
//! a call is given, and follows every path of the call. Paths are merged where they meet again, in such an order that
//! each place is visited once: after all ways that lead there. Loops unroll by themselves as far as their conditions
//! allow, calls through pointers go where the pointers point, so that the code needs no annotations; and the longest
//! path through what is unrolled is the very optimum that an implicit path enumeration (IPET) finds by linear
//! programming, here with the context of every call and round. For calls that are made again and again, memory after
//! them is merged into the memory before until nothing changes any more: what holds then holds for all of them.
//!
//! What is called, and what that puts on the stack, is followed for the image as a whole, all inputs and schemes alike:
//!
//! ```text
//! execute over addresses ──▶ Frames ──▶ Graph, with what is declared of calls through pointers ──▶ stack, reach
//! ```
//!
//! Cycles are those of a model built on Arm's Technical Reference Manual ("TRM-model cycles"), never measured on
//! silicon. What the analysis does not know ends in an error that names the place, never in a guess.
#![forbid(unsafe_code)]

mod abstraction;
pub mod bound;
mod code;
mod concrete;
pub mod declared;
mod domain;
mod execute;
mod explore;
mod flow;
pub mod frame;
mod graph;
pub mod image;
pub mod instruction;
pub mod machine;
pub mod processor;
pub mod reach;
pub mod sequences;
pub mod stack;
mod state;
pub mod timing;
mod values;

pub use concrete::Flags;
pub use execute::ExecuteError;
pub use graph::GraphError;
pub use state::{AccessError, Registers};
