//! The chain from the hand to what the slave meets, as the loaded schemes set it up.
//!
//! Static stiffness (Niemeyer and Slotine; every part in series):
//! `1/K = 1/K_master + T/(2 b) + 1/K_slave + 1/K_obstacle`, `T` the round trip of the waves.

mod controller;
mod delay;

pub use controller::Controller;

use crate::plant::{Obstacle, ParameterError};
use crate::scenario::Scenario;

/// Both controllers and what the slave is pressed against.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    /// The operator's end.
    pub master: Controller,
    /// The remote end.
    pub slave: Controller,
    /// By axis.
    pub obstacles: Vec<Option<Obstacle>>,
}

impl Chain {
    /// The chain of these controllers before the scenario's environment.
    ///
    /// # Errors
    /// [`ParameterError`] for an environment that cannot exist.
    pub fn new(scenario: &Scenario, master: Controller, slave: Controller) -> Result<Self, ParameterError> {
        let obstacles = (0..scenario.dof).map(|axis| scenario.obstacle(axis)).collect::<Result<_, _>>()?;
        Ok(Self { master, slave, obstacles })
    }

    /// Samples that the delay modules of both sides add to a round trip; none when a side is not known.
    #[must_use]
    pub fn delay_ticks(&self) -> Option<u32> {
        Some(self.master.delay_ticks?.saturating_add(self.slave.delay_ticks?))
    }

    /// Stiffness on `axis` for a round trip of `round_trip_s`, `N/m`; none for a chain that lacks a part: wave
    /// transformer, PD controllers, or something to meet.
    #[must_use]
    pub fn stiffness_n_per_m(&self, axis: usize, round_trip_s: f64) -> Option<f64> {
        let compliance_m_per_n = 1.0 / self.master.stiffness_n_per_m.get(axis)?
            + round_trip_s / (2.0 * self.master.impedance_ns_per_m?)
            + 1.0 / self.slave.stiffness_n_per_m.get(axis)?
            + 1.0 / self.obstacles.get(axis)?.as_ref()?.stiffness_n_per_m;
        Some(1.0 / compliance_m_per_n)
    }
}
