//! What the hand feels of the wall: measured in the settled contact, and predicted.
//!
//! Static chain from hand to wall (Niemeyer and Slotine; every part in series):
//! `1/K = 1/K_master + T/(2 b) + 1/K_slave + 1/K_wall`, `T` the round trip of the waves.

use dimsart_core::{Engine, Value, types};

use crate::rig::{Probe, Rig, SimulatedDimsart};
use dimsart_core::modules::Standard;

use crate::rig::DATA_BASE_WORDS;

type SimulatedEngine = Engine<Standard, DATA_BASE_WORDS>;

/// Averages force and depth of the master while the contact is settled.
#[derive(Debug)]
pub struct FeltStiffness {
    wall_position_m: f64,
    force: Probe,
    axes: Vec<Sums>,
}

#[derive(Debug, Clone, Default)]
struct Sums {
    ticks: u32,
    ticks_in_contact: u32,
    force_n: f64,
    depth_m: f64,
}

impl FeltStiffness {
    /// For a rig whose first station is the master and whose last one meets the wall.
    #[must_use]
    pub fn new(dof: usize, wall_position_m: f64) -> Self {
        Self {
            wall_position_m,
            force: Probe::new(types::DES_FORCE.first()),
            axes: vec![Sums::default(); dof],
        }
    }

    /// Adds the present tick. `touches` says for an axis whether the slave touches the wall.
    pub fn add(&mut self, rig: &Rig, touches: impl Fn(usize) -> bool) {
        let Some(master) = rig.stations().first() else { return };
        let mut forces = self.force.values(master);
        for (axis, sums) in self.axes.iter_mut().enumerate() {
            let (Some(force_n), Some(truth)) = (forces.next(), master.plant.truth(axis)) else { return };
            sums.ticks += 1;
            sums.ticks_in_contact += u32::from(touches(axis));
            // The force on the device pushes back against the hand.
            sums.force_n -= force_n;
            sums.depth_m += truth.position_m - self.wall_position_m;
        }
    }

    /// Felt stiffness per axis, `N/m`; none for an axis that was not in contact all the time.
    #[must_use]
    pub fn per_axis(&self) -> Vec<Option<f64>> {
        let is_settled = |sums: &Sums| sums.ticks > 0 && sums.ticks_in_contact == sums.ticks;
        self.axes.iter().map(|sums| is_settled(sums).then(|| sums.force_n / sums.depth_m)).collect()
    }
}

/// The static chain's stiffness per axis, `N/m`; none when a scheme has no such parameter.
pub fn predicted(
    master: &mut SimulatedDimsart,
    slave: &mut SimulatedDimsart,
    dof: usize,
    round_trip_s: f64,
    wall_n_per_m: f64,
) -> Vec<Option<f64>> {
    let chain = |axis| {
        let compliance = 1.0 / real(master, "PDCTRL_MOD", "K_PARAM", axis)?
            + round_trip_s / (2.0 * real(master, "WTRANSF_MOD", "B_PARAM", 0)?)
            + 1.0 / real(slave, "PDCTRL_MOD", "K_PARAM", axis)?
            + 1.0 / wall_n_per_m;
        Some(1.0 / compliance)
    };
    (0..dof).map(chain).collect()
}

/// Value of a module's parameter that is a real number, if the scheme has the module.
fn real(dimsart: &mut SimulatedDimsart, module: &str, parameter: &str, axis: usize) -> Option<f64> {
    match value(dimsart, module, parameter, axis)? {
        Value::Real(value) => Some(f64::from(value)),
        _ => None,
    }
}

/// Samples that the scheme's time-delay module adds; 0 without one.
pub fn time_delay_ticks(dimsart: &mut SimulatedDimsart) -> u32 {
    match value(dimsart, "TIMEDELAY_MOD", "TD_PARAM", 0) {
        Some(Value::Count(ticks)) => ticks,
        _ => 0,
    }
}

fn value(dimsart: &mut SimulatedDimsart, module: &str, parameter: &str, axis: usize) -> Option<Value> {
    let module = SimulatedEngine::module(module)?;
    let parameter = SimulatedEngine::parameter(module.kind, parameter)?;
    let engine = dimsart.engine_mut();
    if !engine.is_plugged_in(module) {
        return None;
    }
    engine.get(module, parameter, u8::try_from(axis).ok()?).ok()
}
