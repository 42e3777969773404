//! The types matching check names every fault of a scheme, and only those.

use dimsart_core::{
    AxisKind, DeviceDescriptor, Dimsart, Engine, Finding, Party, modules::Standard, scheme, types,
};

const SIDES: &[&str] = &["master", "slave"];

fn robot() -> Dimsart {
    let axes = [AxisKind::Linear; 3];
    let device = DeviceDescriptor::new("arm", &axes, 1e-3, &[types::POSITION], &[types::DES_FORCE]);
    Dimsart::new(device.unwrap()).unwrap()
}

/// Loads a scheme and gives what went wrong, in words.
fn load(dimsart: &mut Dimsart, text: &str, side: &str) -> Vec<String> {
    let mut errors = Vec::new();
    scheme::load(text, side, SIDES, dimsart, |error| {
        errors.push(format!("{}:{} {:?}", error.place.line, error.place.column, error.problem));
    });
    errors
}

fn findings(dimsart: &Dimsart) -> Vec<String> {
    let report = dimsart.engine().check();
    report.findings().iter().map(|finding| dimsart.engine().explain(*finding).to_string()).collect()
}

#[test]
fn table_1_as_printed_matches_on_the_master() {
    let mut master = robot();
    assert_eq!(load(&mut master, include_str!("../schemes/table1.scheme"), "master"), [""; 0]);
    assert_eq!(findings(&master), [""; 0]);
    assert!(master.engine().is_running());
}

#[test]
fn table_1_as_printed_lacks_exactly_one_provider_on_the_slave() {
    let mut slave = robot();
    let errors = load(&mut slave, include_str!("../schemes/table1.scheme"), "slave");
    assert_eq!(errors, ["20:25 Refused(DoesNotMatch { faults: 1 })"]);
    let report = slave.engine().check();
    let tx = Engine::<Standard>::module("COMM_TXMOD").unwrap();
    let expected = Finding::NoProvider { signal: types::CH1_TD_WAVES.first(), reader: Party::Module(tx) };
    assert_eq!(report.findings(), [expected]);
    assert!(!slave.engine().is_running());
}

#[test]
fn the_shipped_scheme_runs_on_both_sides() {
    for side in SIDES {
        let mut dimsart = robot();
        assert_eq!(load(&mut dimsart, include_str!("../schemes/bilateral.scheme"), side), [""; 0]);
        assert!(dimsart.engine().is_running(), "{:?}", findings(&dimsart));
    }
}
