//! The modules of the library, each against an outside implementation.
//!
//! `cargo xtask test` writes the cases (`tests/oracle/modules.py`) and says in `DIMSART_ORACLE` where they are. A case is a
//! scheme, what the device measures tick by tick, and what the Data Base has to have behind each tick.
#![expect(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::panic,
    reason = "in helpers of tests as in tests"
)]

#[path = "common/evidence.rs"]
mod evidence;

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use dimsart_core::modules::Library;
use dimsart_core::{
    AxisKind, DataType, DeviceDescriptor, Dimsart, Format, ModuleList, Tick, Word, scheme, types,
};
use serde::Deserialize;

use evidence::{Curve, Evidence, write};

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

/// Rows that are given before a tick.
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

    /// A controller whose device measures the inputs.
    fn controller(&self) -> (Dimsart, Vec<&'static DataType>) {
        let outputs: Vec<&'static DataType> = self
            .inputs
            .keys()
            .map(|name| types::by_name(name).unwrap_or_else(|| panic!("no type {name}")))
            .collect();
        let widest = self.inputs.values().chain(self.expected.values()).map(|signal| signal[0].len());
        let kind = if self.axis == "linear" { AxisKind::Linear } else { AxisKind::Rotary };
        let axes = vec![kind; widest.max().unwrap()];
        let device = DeviceDescriptor::new("case", axes.leak(), self.period_s, outputs.clone().leak(), &[]);
        let mut dimsart = Dimsart::new(device.unwrap()).unwrap();
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

    /// Runs it; what is expected and what was found, signal by signal.
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
            assert_eq!(dimsart.tick(&measured, &mut []), Tick::Ran, "{}, tick {tick}", self.title());
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

/// A signal of the Data Base, whatever its format.
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

fn cases() -> Option<Vec<Case>> {
    let folder = PathBuf::from(std::env::var_os("DIMSART_ORACLE")?);
    let text = std::fs::read_to_string(folder.join("modules.json")).unwrap();
    Some(serde_json::from_str(&text).unwrap())
}

/// The largest error of the axes as a share of the largest magnitude expected, from a tick on.
fn error(case: &Case, expected: &Signal, found: &Signal) -> f64 {
    let compared = || expected.iter().zip(found).skip(case.first_tick);
    let scale = expected.iter().flatten().fold(0.0_f64, |most, value| most.max(value.abs()));
    let errors = compared().flat_map(|(expected, found)| {
        assert_eq!(expected.len(), found.len(), "{}: axes", case.title());
        expected.iter().zip(found).map(|(expected, found)| (expected - found).abs())
    });
    // Not `max`: what is not a number is the worst of all.
    let worst = errors.fold(0.0_f64, |worst, error| if error <= worst { worst } else { error });
    if scale > 0.0 { worst / scale } else { worst }
}

#[test]
fn every_module_does_what_an_outside_implementation_says() {
    let Some(cases) = cases() else {
        println!("skipped: DIMSART_ORACLE is not set, `cargo xtask test` sets it");
        return;
    };
    let mut wrong = Vec::new();
    let mut rows = Vec::new();
    for case in &cases {
        for (signal, expected, found) in case.run() {
            let error = error(case, &expected, &found);
            if error.is_nan() || error > case.tolerance {
                wrong.push(format!(
                    "{}: {signal} is off by {error:.2e} of {:.0e}",
                    case.title(),
                    case.tolerance
                ));
            }
            rows.push(Evidence {
                subject: case.module.clone(),
                name: format!("{}, {signal}", case.name),
                oracle: case.oracle.clone(),
                samples: expected.len() * expected[0].len(),
                largest_error: error,
                tolerance: case.tolerance,
                why: case.why.clone(),
                curve: Some(Curve::of(f64::from(case.period_s), &expected, &found)),
            });
        }
    }
    write("modules", &rows);
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    // The ends of a link, and what has no number to compare, have tests of their own.
    let elsewhere = ["COMM_RXMOD", "COMM_TXMOD", "RECORDER_MOD"];
    let compared: BTreeSet<&str> = cases.iter().map(|case| case.module.as_str()).chain(elsewhere).collect();
    let missing: Vec<&str> =
        Library::KINDS.iter().map(|kind| kind.name).filter(|name| !compared.contains(name)).collect();
    assert!(missing.is_empty(), "without an oracle (tests/oracle/cases): {missing:?}");
}
