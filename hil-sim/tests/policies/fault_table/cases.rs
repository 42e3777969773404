//! The rows of the table.

use crate::faulty_pair::{Fault, Line, Shows, Writes};

/// A row of the table: faults that are tried in turn.
#[derive(Debug, Clone)]
pub(crate) struct Case {
    pub(crate) name: String,
    pub(crate) faults: Vec<Fault>,
    /// What interrupts may take in the midst of a call.
    pub(crate) spare_cycles: u32,
}

/// What boards leave for interrupts in the midst of a call (`firmware/src/entry_points.rs`).
pub(crate) const SPARE_CYCLES: u32 = 2_000;
/// Modules that the device depends on, and those that it does not.
const BEFORE_DEVICE: [&str; 3] = ["COMM_RXMOD", "WTRANSF_MOD", "PDCTRL_MOD"];
const BEHIND_DEVICE: [&str; 2] = ["TIMEDELAY_MOD", "COMM_TXMOD"];

/// Every row.
pub(crate) fn cases() -> Vec<Case> {
    let one = |name: &str, fault| Case { name: name.to_owned(), faults: vec![fault], spare_cycles: 0 };
    let sensor = |name, shows| one(name, Fault::Sensor(shows));
    let mut cases = vec![
        one("no fault (reference)", Fault::None),
        sensor("a sensor outputs NaN", Shows::This(f32::NAN)),
        sensor("a sensor outputs infinity", Shows::This(f32::INFINITY)),
        sensor("a sensor outputs 1e38 m", Shows::This(1e38)),
        sensor("a sensor outputs 1000 km", Shows::This(1e6)),
        sensor("a sensor jumps by 1 mm", Shows::More(1e-3)),
        sensor("a sensor jumps by 10 mm", Shows::More(1e-2)),
        sensor("a sensor jumps by 1000 mm", Shows::More(1.0)),
        sensor("a sensor is stuck", Shows::Stuck),
        sensor("a sensor drifts by 10 mm/s", Shows::Drift(1e-5)),
        sensor("a sensor drifts by 1 m/s", Shows::Drift(1e-3)),
        one("the sensor frame is one word too short", Fault::ShortFrame),
        one("the sensor frame is one word too long", Fault::LongFrame),
        one("an actuator is stuck", Fault::ActuatorStuck),
    ];
    for (written, writes) in [("NaN", Writes::Nan), ("infinity", Writes::Infinity), ("1e38", Writes::Large)] {
        for (places, name) in
            [(&[1, 2][..], "upstream of the device"), (&[3], "without effect on the device")]
        {
            let faults = places.iter().map(|place| Fault::Writes(*place, writes)).collect();
            cases.push(Case { name: format!("a module {name} writes {written}"), faults, spare_cycles: 0 });
        }
    }
    for percent in [10, 30, 50, 100, 500] {
        for (modules, name) in
            [(&BEFORE_DEVICE[..], "upstream of the device"), (&BEHIND_DEVICE, "without effect on the device")]
        {
            let faults = modules.iter().map(|module| Fault::TakesLonger(module, percent)).collect();
            let name = format!("a module {name} exceeds its cost by {percent} %");
            cases.push(Case { name, faults, spare_cycles: 0 });
        }
    }
    for module in BEFORE_DEVICE.into_iter().chain(BEHIND_DEVICE) {
        let name = format!("{module} exceeds its cost by 500 %, {SPARE_CYCLES} cycles spare for interrupts");
        let faults = vec![Fault::TakesLonger(module, 500)];
        cases.push(Case { name, faults, spare_cycles: SPARE_CYCLES });
    }
    let line = |name, line| one(name, Fault::Line(line));
    cases.extend([
        line("the link is silent for 19 ticks", Line::Silent(19)),
        line("the link is silent for 20 ticks", Line::Silent(20)),
        line("the link is permanently silent", Line::Silent(u32::MAX)),
        line("every other packet is damaged", Line::Damaged { every: 2 }),
        line("every packet is damaged", Line::Damaged { every: 1 }),
        line("the same packet arrives repeatedly", Line::Repeats),
        one("the lease is not renewed", Fault::LeaseNotRenewed),
    ]);
    cases
}
