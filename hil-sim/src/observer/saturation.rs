//! Saturation of actuators: the safety stage limits their commands.

use core::ops::ControlFlow;

use dimsart_core::limits::MAX_DOF;
use dimsart_core::{TickResult, types};
use serde::Serialize;

use super::Observer;
use crate::outcome::Outcome;
use crate::rig::{Probe, Rig, Station};

/// A saturated actuator.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Saturation {
    /// The device.
    pub device: String,
    /// The axis, from 0.
    pub axis: usize,
    /// Time with a command beyond its range or its rate limit, `s`.
    pub time_s: f64,
}

/// Counts saturated ticks of actuators by station.
#[derive(Debug)]
pub(crate) struct Saturated {
    stations: Vec<SaturatedStation>,
}

#[derive(Debug)]
struct SaturatedStation {
    command: Probe,
    ticks: [u64; MAX_DOF],
}

impl Saturated {
    pub(crate) fn new(rig: &Rig) -> Self {
        let new = |_| SaturatedStation { command: Probe::new(types::DES_FORCE.first()), ticks: [0; MAX_DOF] };
        Self { stations: rig.stations().iter().map(new).collect() }
    }
}

impl Observer for Saturated {
    fn observe(&mut self, rig: &Rig) -> ControlFlow<()> {
        self.stations.iter_mut().zip(rig.stations()).for_each(|(saturated, station)| saturated.add(station));
        ControlFlow::Continue(())
    }

    fn report(&mut self, rig: &Rig, outcome: &mut Outcome) {
        for (saturated, station) in self.stations.iter().zip(rig.stations()) {
            outcome.saturated.extend(saturated.found(&station.name, rig.period_s()));
        }
    }
}

impl SaturatedStation {
    /// Adds the present tick of its station.
    fn add(&mut self, station: &Station) {
        if station.last_tick != TickResult::Ran {
            return;
        }
        let commands = self.command.values(station).zip(station.command());
        for (ticks, (command, given)) in self.ticks.iter_mut().zip(commands) {
            *ticks += u64::from((command - f64::from(*given)).abs() > 0.0);
        }
    }

    /// Returns the saturated actuators of a device.
    fn found<'a>(&'a self, device: &'a str, period_s: f64) -> impl Iterator<Item = Saturation> + 'a {
        let saturated = self.ticks.iter().enumerate().filter(|(_, ticks)| **ticks > 0);
        saturated.map(move |(axis, ticks)| {
            #[expect(clippy::cast_precision_loss, reason = "no run has so many ticks")]
            let time_s = *ticks as f64 * period_s;
            Saturation { device: device.to_owned(), axis, time_s }
        })
    }
}
