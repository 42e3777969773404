//! Watches whether every position, force and wave stays in its declared range.

use dimsart_core::{Tick, types};

use crate::rig::{Probe, Rig};
use crate::scenario::LimitsSection;

/// Watches a rig tick by tick and keeps the first thing that went wrong.
#[derive(Debug)]
pub struct Watch {
    limits: LimitsSection,
    stations: Vec<StationProbes>,
}

#[derive(Debug)]
struct StationProbes {
    force: Probe,
    waves: [Probe; 2],
}

impl Watch {
    /// A watch over all stations of a rig.
    #[must_use]
    pub fn new(rig: &Rig, limits: &LimitsSection) -> Self {
        let probes = |_| StationProbes {
            force: Probe::new(types::DES_FORCE.first()),
            waves: [Probe::new(types::CH1_WAVES.first()), Probe::new(types::CH2_WAVES.first())],
        };
        Self { limits: limits.clone(), stations: rig.stations().iter().map(probes).collect() }
    }

    /// What is out of its range in the present tick, in words; none while all is well.
    pub fn look(&mut self, rig: &Rig) -> Option<String> {
        let LimitsSection { position_m, force_n, wave } = self.limits;
        let time_s = rig.time_s();
        for (probes, station) in self.stations.iter_mut().zip(rig.stations()) {
            let name = &station.name;
            let dof = station.plant.dof();
            let positions =
                (0..dof).filter_map(|axis| station.plant.truth(axis)).map(|truth| truth.position_m);
            let [outgoing, incoming] = &mut probes.waves;
            let found = outside(positions, position_m, "position", "m")
                .or_else(|| outside(probes.force.values(station), force_n, "force", "N"))
                .or_else(|| outside(outgoing.values(station), wave, "outgoing wave", "sqrt(W)"))
                .or_else(|| outside(incoming.values(station), wave, "incoming wave", "sqrt(W)"));
            if let Some(found) = found {
                return Some(format!("{name} {found} at {time_s:.3} s"));
            }
            match station.last_tick {
                Tick::Ran | Tick::Idle => {}
                Tick::MeasurementRefused(error) => {
                    return Some(format!("{name} measurement refused at {time_s:.3} s: {error}"));
                }
                Tick::CommandRefused(error) => {
                    return Some(format!("{name} command refused at {time_s:.3} s: {error}"));
                }
            }
        }
        None
    }
}

/// The first value beyond `limit` either way, or not a number.
fn outside(values: impl Iterator<Item = f64>, limit: f64, what: &str, unit: &str) -> Option<String> {
    let (axis, value) = values.enumerate().find(|(_, value)| !(-limit..=limit).contains(value))?;
    Some(format!("{what} of axis {axis} left its range ±{limit} {unit}: {value:.4} {unit}"))
}
