//! Worst-case cycles and stack of Cortex-M4F code, computed from the ELF that is flashed.
//!
//! ```text
//! ELF ──▶ Image ──▶ Code: every instruction, decoded once
//!                     │
//!                     ▼
//!           execute: semantics of an instruction, generic over the Domain of values
//!             │                                   │
//!   Concrete: 32-bit words              Abstract: sets of possible words
//!             │                                   │
//!        Machine: runs it               Bound: every path, merged, the longest kept
//!             └──────────┬────────────────────────┘
//!                     Timing: cycles of an instruction, for both
//! ```
//!
//! A [`Bound`](bound::Bound) starts from a given memory, such as a controller's memory with its scheme, makes
//! the inputs of a call unknown, and follows every path of the call. Paths merge where they meet, in an order
//! that visits each place once, after all paths that lead there. Loops unroll as far as their conditions
//! allow, and calls through pointers follow the pointer values, so the code needs no annotations. The longest
//! path through the unrolled graph is the optimum that an implicit path enumeration (IPET) finds by linear
//! programming, with the context of every call and iteration. For repeated calls, the memory after the calls
//! is merged into the memory before them until it converges; the result then holds for any number of
//! repetitions.
//!
//! The calls and their stack use are analysed for the whole image, independent of inputs and schemes:
//!
//! ```text
//! execute over addresses ──▶ Frames ──▶ Graph, with declared calls through pointers ──▶ stack, reach
//! ```
//!
//! Cycles come from a model built on Arm's Technical Reference Manual ("TRM-model cycles"), never measured on
//! silicon. If the analysis lacks information, it stops with an error that names the location; it never
//! guesses.
#![forbid(unsafe_code)]

mod abstraction;
pub mod bound;
mod code;
mod concrete;
pub mod declarations;
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
pub mod reachability;
pub mod sequences;
pub mod stack;
mod state;
pub mod timing;
mod values;

pub use concrete::Flags;
pub use execute::ExecuteError;
pub use graph::GraphError;
pub use state::{AccessError, Registers};
