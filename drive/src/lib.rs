//! What runs below a joint controller's tick and makes the torque that it commands: field-oriented control of a
//! three-phase motor, and its protection, once per period of the pulse-width modulation.
//!
//! ```text
//!   phase currents ─▶ Clarke ─▶ Park ─▶ CurrentController ─▶ inverse Park ─▶ space vector ─▶ duty cycles
//!   encoder ─▶ Tracking ──angle, speed──┴────────────────────────┘                │
//!   torque of the tick ─▶ wanted current                                          │
//!   all of what is measured ─▶ Protection ──────────── off, in the same period ───┘
//! ```
//! [`Drive::step`] writes this order down, once. There are no registers here, no clock and no random source: a board hands
//! in a [`Sample`] of what its converters show, and puts the [`Duties`] into its timer. So the same bits come out on a host,
//! where `hil_sim`'s motor stands behind them, and on a chip.
//!
//! Quantities are in SI units. Phases are amplitude-invariant: the length of a current vector is the peak of a phase
//! current. Positive `q` current makes positive torque.
#![no_std]
#![forbid(unsafe_code)]

mod angle;
mod configuration;
mod current_controller;
mod drive;
mod encoder;
mod identification;
mod modulation;
mod number;
mod protection;
mod sample;
mod tracking;
mod vector;

pub use angle::Angle;
pub use configuration::{Configuration, ConfigurationError, Limits, Motor};
pub use current_controller::CurrentController;
pub use drive::{Drive, Measured};
pub use encoder::{As5047p, As5600, Mt6701};
pub use identification::{Identification, IdentificationError, IdentificationStep, Identified};
pub use modulation::{Duties, Modulation, Supply};
pub use protection::{Fault, Protection};
pub use sample::{Rotor, Sample};
pub use tracking::Tracking;
pub use vector::{Dq, Stator, Turn};
