//! Cycles and stack of a controller's ticks on a board, measured and bounded with its firmware image.
//!
//! ```text
//! ELF ──▶ Firmware: entry points, board
//!             │
//!             ▼              rig: the same controller on the host, plant, peer
//!        Controller ◀─ trace ─┘   every tick: measurements, received packets
//!             │
//!             ├─ identical commands and packets, or an error
//!             └─ Statistics of cycles: tick, modules, packets, commands ──▶ Figures
//! ```
//! Cycles come from a model of the Cortex-M4F based on Arm's tables (crate `cycles`), not from silicon.

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
pub use steady::SteadyTick;

/// Unit of the figures.
pub const UNIT: &str = "TRM-model cycles";
