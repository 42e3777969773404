//! Parts of a scenario's pair.

use hil_sim::plant::{Actuation, ExternalForce, JointParameters, Joints, Plant, StopsParameters};
use hil_sim::schemes::SchemeText;

use crate::play::RELEASE_TICK;
use crate::scenario::Scenario;

/// The shipped scheme with the scenario's values.
pub(crate) fn scheme(scenario: &Scenario) -> String {
    let shipped = SchemeText::read("builtin:bilateral").unwrap().text;
    let row = |row: &str| {
        let words: Vec<&str> = row.split_whitespace().collect();
        let setting = scenario.settings.iter().find(|(name, _)| words.get(2) == Some(name));
        match (words.as_slice(), setting) {
            ([to, module, name, _], Some((_, value))) => format!("{to} {module} {name} {value}\n"),
            ([_, _, "MOD_ON", "COMM_RXMOD"], _) => {
                format!("m&s COMM_RXMOD STALE {}\n{row}\n", scenario.stale)
            }
            _ => format!("{row}\n"),
        }
    };
    shipped.lines().map(row).collect()
}

/// When the hand lets go, s.
const RELEASE_S: f64 = RELEASE_TICK as f64 * 1e-3;
/// Of the hand's spring, N/m.
const HAND_N_PER_M: f64 = 300.0;

/// A hand that swings until it lets go, and a wall in the slave's way.
pub(crate) fn plants(scenario: &Scenario) -> [Box<dyn Plant>; 2] {
    let mm = |mm: u32| f64::from(mm) * 1e-3;
    let amplitude_m = mm(scenario.amplitude_mm);
    let swing = move |t: f64| match t < RELEASE_S {
        true => HAND_N_PER_M * amplitude_m * libm::sin(core::f64::consts::TAU * 3.0 * t),
        false => 0.0,
    };
    let joint = |mass_kg, damping_n_s_per_m| {
        let mut joint = JointParameters::of_inertia(mass_kg);
        joint.load.damping = damping_n_s_per_m;
        joint
    };
    let (mut held, mut free) = (joint(0.1, 10.5), joint(0.2, 10.0));
    held.load.stiffness = HAND_N_PER_M;
    let max = mm(scenario.wall_mm);
    free.stops = Some(StopsParameters { max, damping: 10.0, ..StopsParameters::default() });
    let master = (0..scenario.dof).map(|_| (held.build().unwrap(), Some(Box::new(swing) as ExternalForce)));
    let slave = (0..scenario.dof).map(|_| (free.build().unwrap(), None));
    [Box::new(Hand(Joints::new(master.collect()))), Box::new(Joints::new(slave.collect()))]
}

/// Joints that a hand lets go of.
#[derive(Debug)]
struct Hand(Joints);

impl Plant for Hand {
    fn dof(&self) -> usize {
        self.0.dof()
    }

    fn sense(&mut self, measured: &mut [f32]) {
        self.0.sense(measured);
    }

    fn advance(&mut self, start_s: f64, period_s: f64, command: &[f32]) {
        if start_s >= RELEASE_S {
            self.0.joints_mut().for_each(|joint| joint.set_load_spring(0.0, 0.0));
        }
        self.0.advance(start_s, period_s, command);
    }

    fn add_actuations(&self, actuations: &mut Vec<Actuation>) {
        self.0.add_actuations(actuations);
    }

    fn is_touching(&self, axis: usize) -> bool {
        self.0.is_touching(axis)
    }

    fn quantities(&self, axis: usize) -> &'static [(&'static str, &'static str)] {
        self.0.quantities(axis)
    }

    fn read_quantities(&self, axis: usize, values: &mut [f64]) {
        self.0.read_quantities(axis, values);
    }
}
