//! The library's modules, each compared with another implementation.
//!
//! The cases are from `modules.py`. A case is a scheme, the measurements of each tick, and the expected data
//! base after each tick.
use std::collections::{BTreeMap, BTreeSet};

use dimsart_core::{
    AxisKind, DataType, DeviceDescriptor, Dimsart, Format, ProvidedMemory, TickResult, Word, scheme, types,
};
use dimsart_modules::ALL;
use serde::Deserialize;

use crate::evidence::{self, Compared, Evidence, column};

/// Ticks x axes.
type Signal = Vec<Vec<f64>>;

#[derive(Deserialize)]
struct Case {
    module: String,
    name: String,
    oracle: String,
    rows: String,
    inputs: BTreeMap<String, Signal>,
    expected: BTreeMap<String, Signal>,
    tolerance: f64,
    why: String,
    axis: String,
    period_s: f32,
    first_tick: usize,
    commands: Vec<Late>,
}

/// Rows to load before a tick.
#[derive(Deserialize)]
struct Late {
    tick: usize,
    rows: String,
}

impl Case {
    fn title(&self) -> String {
        format!("{}: {}", self.module, self.name)
    }

    fn ticks(&self) -> usize {
        self.expected.values().chain(self.inputs.values()).map(Vec::len).max().unwrap()
    }

    /// Creates a controller whose device measures the inputs.
    fn controller(&self) -> (Dimsart, Vec<&'static DataType>) {
        let outputs: Vec<&'static DataType> = self
            .inputs
            .keys()
            .map(|name| types::find_by_name(name).unwrap_or_else(|| panic!("no type {name}")))
            .collect();
        let widest = self.inputs.values().chain(self.expected.values()).map(|signal| signal[0].len());
        let kind = if self.axis == "linear" { AxisKind::Linear } else { AxisKind::Rotary };
        let axes = vec![kind; widest.max().unwrap()];
        let device = DeviceDescriptor::new("case", axes.leak(), self.period_s, outputs.clone().leak(), &[]);
        let mut dimsart = Dimsart::new(ProvidedMemory::leak_default(), device.unwrap(), ALL).unwrap();
        let named: BTreeSet<&str> =
            self.rows.lines().filter_map(|row| row.split_whitespace().next()).collect();
        let is_on = |module: &str| self.rows.contains(&format!("MOD_ON {module}\n"));
        let others = [self.module.as_str()].into_iter().filter(|module| !named.contains(module));
        let mut rows = self.rows.clone() + "\n";
        for module in named.iter().copied().chain(others).filter(|name| *name != "MOD_ENG" && !is_on(name)) {
            rows += &format!("MOD_ENG MOD_ON {module}\n");
        }
        self.give(&mut dimsart, &(rows + "MOD_ENG MATCHING_CHECK"));
        assert!(dimsart.engine().is_running(), "{}: {:?}", self.title(), findings(&dimsart));
        (dimsart, outputs)
    }

    fn give(&self, dimsart: &mut Dimsart, rows: &str) {
        let rows: String = rows
            .lines()
            .filter(|row| !row.trim().is_empty())
            .map(|row| format!("all {}\n", row.trim()))
            .collect();
        let mut errors = Vec::new();
        scheme::load(&rows, "all", &[], dimsart, |error| errors.push(format!("{error:?}")));
        assert!(errors.is_empty(), "{}: {errors:?}\n{rows}", self.title());
    }

    /// Runs the case; returns expected and actual values of each signal.
    fn run(&self) -> Vec<(String, Signal, Signal)> {
        let (mut dimsart, outputs) = self.controller();
        let mut found: Vec<(String, Signal, Signal)> = self
            .expected
            .iter()
            .map(|(name, expected)| (name.clone(), expected.clone(), Vec::new()))
            .collect();
        for tick in 0..self.ticks() {
            for late in self.commands.iter().filter(|late| late.tick == tick) {
                self.give(&mut dimsart, &late.rows);
            }
            let measured = outputs.iter().flat_map(|data_type| {
                let row =
                    self.inputs[data_type.name].get(tick).or(self.inputs[data_type.name].last()).unwrap();
                row.iter().map(|value| word(data_type, *value))
            });
            let measured: Vec<Word> = measured.collect();
            assert_eq!(dimsart.tick(&measured, &mut []), TickResult::Ran, "{}, tick {tick}", self.title());
            for (name, _, rows) in &mut found {
                rows.push(signal(&dimsart, name));
            }
        }
        found
    }
}

fn findings(dimsart: &Dimsart) -> Vec<String> {
    let report = dimsart.engine().check();
    report.findings().iter().map(|finding| dimsart.engine().explain(*finding).to_string()).collect()
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "as the types' formats are")]
fn word(data_type: &DataType, value: f64) -> Word {
    match data_type.format {
        Format::F32 => Word::from(value as f32),
        Format::I32 => Word::from(value as i32),
        _ => Word::from(value as u32),
    }
}

/// Returns a signal of the data base in any format.
fn signal(dimsart: &Dimsart, name: &str) -> Vec<f64> {
    let engine = dimsart.engine();
    let signal = engine.device().signal(name).unwrap_or_else(|| panic!("no signal {name}"));
    let slot = engine.data_base().slot(signal).unwrap_or_else(|| panic!("{name} is not in the Data Base"));
    let format = engine.device().data_type(signal.id).unwrap().format;
    let number = |word: &u32| match format {
        Format::F32 => f64::from(f32::from_bits(*word)),
        Format::I32 => f64::from(word.cast_signed()),
        _ => f64::from(*word),
    };
    engine.data_base().words(slot).iter().map(number).collect()
}

#[test]
fn every_module_does_what_an_outside_implementation_says() {
    let Some(folder) = test_requirements::reference_runs("the oracles of the modules") else { return };
    let cases: Vec<Case> = evidence::read(&folder.join("modules.json"));
    let mut evidence = Evidence::new("modules");
    for case in &cases {
        for (signal, expected, found) in case.run() {
            let scale = expected.iter().flatten().fold(0.0_f64, |most, value| most.max(value.abs()));
            for axis in 0..expected[0].len() {
                let name = if expected[0].len() == 1 { signal.clone() } else { format!("{signal}[{axis}]") };
                evidence.judge(&Compared {
                    subject: &case.module,
                    name: format!("{}, {name}", case.name),
                    oracle: &case.oracle,
                    expected: &column(&expected[case.first_tick..], axis),
                    found: &column(&found[case.first_tick..], axis),
                    scale: Some(scale),
                    tolerance: case.tolerance,
                    why: &case.why,
                    period_s: Some(case.period_s.into()),
                });
            }
        }
    }
    evidence.end();
    // Link modules and modules without a numeric result have other tests.
    let elsewhere = ["COMM_RXMOD", "COMM_TXMOD", "RECORDER_MOD", "ONLINE_MOD"];
    let compared: BTreeSet<&str> = cases.iter().map(|case| case.module.as_str()).chain(elsewhere).collect();
    let missing: Vec<&str> =
        ALL.list().iter().map(|kind| kind.name).filter(|name| !compared.contains(name)).collect();
    assert!(missing.is_empty(), "without an oracle (tests/oracle/cases): {missing:?}");
}
