//! What a scenario's pair is made of.

use hil_sim::plant::{
    Axis, AxisWise, DeviceParameters, Environment, HandParameters, HandPhase, Plant, WallParameters,
};
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

/// A hand that swings until it lets go, and a wall in the slave's way.
pub(crate) fn plants(scenario: &Scenario) -> [Box<dyn Plant>; 2] {
    let mm = |mm: u32| f64::from(mm) * 1e-3;
    let hand = HandParameters {
        mass_kg: 0.05,
        damping_ns_per_m: 10.0,
        stiffness_n_per_m: 300.0,
        phases: vec![HandPhase::Sine {
            start_s: 0.0,
            end_s: f64::from(RELEASE_TICK) * 1e-3,
            center_m: 0.0,
            amplitude_m: mm(scenario.amplitude_mm),
            frequency_hz: 3.0,
        }],
    };
    let wall = WallParameters {
        position_m: mm(scenario.wall_mm),
        damping_ns_per_m: 10.0,
        ..WallParameters::default()
    };
    let axis = |mass_kg, damping_ns_per_m, environment: Box<dyn Environment>| {
        let device = DeviceParameters { mass_kg, damping_ns_per_m, ..DeviceParameters::default() };
        Axis::new(&device, None, vec![environment]).unwrap()
    };
    let master = (0..scenario.dof).map(|_| axis(0.05, 0.5, Box::new(hand.build().unwrap())));
    let slave = (0..scenario.dof).map(|_| axis(0.2, 10.0, Box::new(wall.build().unwrap())));
    [Box::new(AxisWise::new(master.collect())), Box::new(AxisWise::new(slave.collect()))]
}
