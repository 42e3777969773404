//! Static chain from the hand to the environment of the slave, from the loaded schemes.
//!
//! Static stiffness (Niemeyer and Slotine; every part in series):
//! `1/K = 1/K_master + T/(2 b) + 1/K_slave + 1/K_obstacle`, `T` the round trip of the waves.

mod controller;
mod delay;
mod scheme_values;

pub use controller::Controller;
pub(super) use scheme_values::{chosen, real};

use super::obstacle::Obstacle;

/// Both controllers and the obstacle of the slave.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Chain {
    /// Master.
    pub master: Controller,
    /// Slave.
    pub slave: Controller,
    /// Obstacle stiffness by axis.
    pub obstacles: Vec<Option<Obstacle>>,
}

impl Chain {
    /// Samples of the delay modules of both sides in a round trip; `None` if a side is unknown.
    #[must_use]
    pub fn delay_ticks(&self) -> Option<u32> {
        Some(self.master.delay_ticks?.saturating_add(self.slave.delay_ticks?))
    }

    /// Ticks per packet.
    #[must_use]
    pub fn every_ticks(&self) -> u32 {
        self.master.every_ticks.max(self.slave.every_ticks).max(1)
    }

    /// Wave impedances of master and slave, `N s/m`, if different. Forces are then scaled by `sqrt(b_slave/b_master)`
    /// from master to slave, velocities by its inverse, and positions drift apart.
    #[must_use]
    pub fn mismatched_impedances_n_s_per_m(&self) -> Option<[f64; 2]> {
        let impedances = [self.master.impedance_n_s_per_m?, self.slave.impedance_n_s_per_m?];
        let [master, slave] = impedances;
        (master.to_bits() != slave.to_bits()).then_some(impedances)
    }

    /// Returns the stiffness on `axis` for a round trip of `round_trip_s`, `N/m`; `None` if a part is missing (wave
    /// transformers, PD controllers, obstacle) or the impedances differ.
    #[must_use]
    pub fn stiffness_n_per_m(&self, axis: usize, round_trip_s: f64) -> Option<f64> {
        if self.mismatched_impedances_n_s_per_m().is_some() {
            return None;
        }
        let compliance_m_per_n = 1.0 / self.master.stiffness_n_per_m.get(axis)?
            + round_trip_s / (2.0 * self.master.impedance_n_s_per_m?)
            + 1.0 / self.slave.stiffness_n_per_m.get(axis)?
            + 1.0 / self.obstacles.get(axis)?.as_ref()?.stiffness_n_per_m;
        Some(1.0 / compliance_m_per_n)
    }
}
