//! What a controller's ticks cost on a board: the cycles and the stack of the very image that is flashed.
//!
//! ```text
//! ELF ──▶ Firmware: entry points, board
//!             │
//!             ▼              rig: the same controller here, its plant, the other side
//!        Controller ◀─ trace ─┘   every tick: what was measured, what came in
//!             │
//!             ├─ the same bits commanded and sent, or an error
//!             └─ Statistics of cycles: tick, modules, packets, commands ──▶ Figures
//! ```
//! All cycles are those of a model of the Cortex-M4F that is built on Arm's tables (the crate `cycles`).

mod controller;
mod costs;
mod error;
mod figures;
mod firmware;
mod interrupt;
mod law_costs;
mod memory;
mod random;
mod replay;
mod scheme_bound;
mod statistics;
mod steady;
mod worst;

pub use controller::Controller;
pub use costs::ImageCosts;
pub(crate) use costs::{name_of, runs_laws};
pub use error::CyclesError;
pub use figures::{Figures, Row};
pub use firmware::Firmware;
pub use memory::Memory;
pub use replay::{Setup, measure};
pub use steady::Steady;

/// What the figures count.
pub const UNIT: &str = "TRM-model cycles";
