//! Schemes are parsed word by word; an error names line, column and word.
#![expect(clippy::unwrap_used, reason = "in helpers of tests as in tests")]

use crate::common::Bench;
use dimsart_core::scheme::{self, RowError, SchemeError, SourceLocation};
use dimsart_core::{CommandError, ModuleRef, ParameterError, ParameterType, Value, types};
use dimsart_modules::ALL;
use proptest::prelude::*;
use proptest::test_runner::FileFailurePersistence;

const SIDES: &[&str] = &["master", "slave"];

fn robot() -> Bench {
    Bench::of(3, &[types::POSITION], &[types::DES_FORCE])
}

/// Loads a text on the master; returns the errors.
fn load<'a>(bench: &mut Bench, text: &'a str) -> Vec<SchemeError<'a>> {
    let mut errors = Vec::new();
    let failed =
        scheme::load(text, "master", SIDES, &mut bench.dimsart, |error: SchemeError<'a>| errors.push(error));
    assert_eq!(failed, errors.len());
    errors
}

fn module(name: &str) -> ModuleRef {
    ALL.module(name).unwrap()
}

/// Invalid value of this parameter, with the accepted values.
fn value(name: &str, parameter: &str, accepts: ParameterType) -> RowError {
    let module = module(name);
    let parameter = ALL.parameter(module.kind, parameter).unwrap();
    let found = ALL.describe_parameter(module.kind, parameter).unwrap();
    assert_eq!(found.accepts, accepts, "{name} {}", found.name);
    RowError::Value { module, parameter }
}

/// Invalid entry of the parameter of another problem.
fn entry(value: RowError) -> RowError {
    match value {
        RowError::Value { module, parameter } => RowError::Entry { module, parameter },
        other => other,
    }
}

#[test]
fn what_is_wrong_is_named_with_its_place() {
    let pd = module("PDCTRL_MOD");
    let transformer = value("WTRANSF_MOD", "FORM", ParameterType::Choice(&["SPLIT", "IMPLICIT", "PRINTED"]));
    let stiffness = value("PDCTRL_MOD", "K_PARAM", ParameterType::Real { min: 0.0, max: 1e6 });
    let ticks = value("TIMEDELAY_MOD", "TD_PARAM", ParameterType::Count { min: 0, max: 60_000 });
    let switch = value("PDCTRL_MOD", "LAW_OUTPUT", ParameterType::Flag);
    let cases = [
        ("boss MOD_ENG STOP", 1, "boss", RowError::Destination),
        ("m&s& MOD_ENG STOP", 1, "m&s&", RowError::Destination),
        ("m&x MOD_ENG STOP", 1, "m&x", RowError::Destination),
        ("x&m MOD_ENG STOP", 1, "x&m", RowError::Destination),
        ("ma MOD_ENG STOP", 1, "ma", RowError::Destination),
        ("all&m MOD_ENG STOP", 1, "all&m", RowError::Destination),
        ("ALL MOD_ENG STOP", 1, "ALL", RowError::Destination),
        ("m", 2, "", RowError::Module),
        ("m   # MOD_ENG STOP", 2, "", RowError::Module),
        ("m PDCTRL K_PARAM 1", 3, "PDCTRL", RowError::Module),
        ("m pdctrl_mod K_PARAM 1", 3, "pdctrl_mod", RowError::Module),
        ("m PDCTRL_MOD.0 K_PARAM 1", 3, "PDCTRL_MOD.0", RowError::Module),
        ("m PDCTRL_MOD.256 K_PARAM 1", 3, "PDCTRL_MOD.256", RowError::Module),
        ("m PDCTRL_MOD. K_PARAM 1", 3, "PDCTRL_MOD.", RowError::Module),
        ("m\tMOD_ENG\t\tMOD_UP\tPDCTRL_MOD", 12, "MOD_UP", RowError::EngineCommand),
        ("m MOD_ENG", 10, "", RowError::EngineCommand),
        ("m MOD_ENG MOD_ON", 17, "", RowError::ModuleValue),
        ("m MOD_ENG MOD_ON   PD", 20, "PD", RowError::ModuleValue),
        ("m MOD_ENG STOP now", 16, "now", RowError::Surplus),
        ("m MOD_ENG MOD_ON PDCTRL_MOD now or never", 29, "now", RowError::Surplus),
        ("m PDCTRL_MOD K_PARAM 1 N/m", 24, "N/m", RowError::Surplus),
        ("m PDCTRL_MOD P_PARAM 1", 14, "P_PARAM", RowError::ModuleCommand(pd)),
        ("m PDCTRL_MOD K_PARAM[ 1", 14, "K_PARAM[", entry(stiffness)),
        ("m PDCTRL_MOD K_PARAM] 1", 14, "K_PARAM]", RowError::ModuleCommand(pd)),
        ("m PDCTRL_MOD K_PARAM[x] 1", 14, "K_PARAM[x]", entry(stiffness)),
        ("m PDCTRL_MOD K_PARAM[-1] 1", 14, "K_PARAM[-1]", entry(stiffness)),
        ("m PDCTRL_MOD K_PARAM[1][2] 1", 14, "K_PARAM[1][2]", entry(stiffness)),
        ("m PDCTRL_MOD PORT_FORCE FORCE", 14, "PORT_FORCE", RowError::ModuleCommand(pd)),
        ("m PDCTRL_MOD PORT_ FORCE", 14, "PORT_", RowError::ModuleCommand(pd)),
        (
            "m TIMEDELAY_MOD PORT_LINE FORCE",
            17,
            "PORT_LINE",
            RowError::ModuleCommand(module("TIMEDELAY_MOD")),
        ),
        ("m PDCTRL_MOD PORT_DES_FORCE FORZE", 29, "FORZE", RowError::Type),
        ("m PDCTRL_MOD PORT_DES_FORCE FORCE.0", 29, "FORCE.0", RowError::Type),
        ("m PDCTRL_MOD PORT_DES_FORCE", 28, "", RowError::Type),
        ("m COMM_RXMOD CRX_ADD_DATA WAVES", 27, "WAVES", RowError::Type),
        ("m PDCTRL_MOD K_PARAM", 21, "", stiffness),
        ("m PDCTRL_MOD K_PARAM much", 22, "much", stiffness),
        ("m PDCTRL_MOD K_PARAM 3,5", 22, "3,5", stiffness),
        ("m PDCTRL_MOD K_PARAM -1", 22, "-1", stiffness),
        ("m PDCTRL_MOD K_PARAM 1e7", 22, "1e7", stiffness),
        ("m PDCTRL_MOD K_PARAM NaN", 22, "NaN", stiffness),
        ("m PDCTRL_MOD K_PARAM inf", 22, "inf", stiffness),
        ("m TIMEDELAY_MOD TD_PARAM 1.5", 26, "1.5", ticks),
        ("m TIMEDELAY_MOD TD_PARAM -1", 26, "-1", ticks),
        ("m TIMEDELAY_MOD TD_PARAM 60001", 26, "60001", ticks),
        ("m TIMEDELAY_MOD TD_PARAM 99999999999", 26, "99999999999", ticks),
        ("m WTRANSF_MOD FORM split", 20, "split", transformer),
        ("m PDCTRL_MOD LAW_OUTPUT YES", 25, "YES", switch),
        ("m PDCTRL_MOD LAW_OUTPUT[0] ON", 14, "LAW_OUTPUT[0]", entry(switch)),
        (
            "m PDCTRL_MOD K_PARAM[3] 1",
            14,
            "K_PARAM[3]",
            RowError::Refused(CommandError::Parameter(ParameterError::NoSuchEntry)),
        ),
        ("m MOD_ENG MOD_OFF PDCTRL_MOD", 19, "PDCTRL_MOD", RowError::Refused(CommandError::NotPluggedIn(pd))),
        (
            "m MOD_ENG MATCHING_CHECK",
            11,
            "MATCHING_CHECK",
            RowError::Refused(CommandError::HasFaults { faults: 1 }),
        ),
        // Words may contain non-ASCII characters; columns count bytes.
        ("m PDCTRL_MOD K_PARAM ½", 22, "½", stiffness),
        ("m PDCTRL_MOD K_PÄRAM 1", 14, "K_PÄRAM", RowError::ModuleCommand(pd)),
        ("ä PDCTRL_MOD K_PARAM 1", 1, "ä", RowError::Destination),
        ("m PÄ MOD 1", 3, "PÄ", RowError::Module),
        ("m\u{a0}PDCTRL_MOD K_PARAM x", 23, "x", stiffness),
    ];
    for (row, column, word, problem) in cases {
        let mut bench = robot();
        let before = bench.snapshot();
        let text =
            format!("# a comment\n\n   \t \r\n  # another\r\n{row}\r\nm PCTRL_MOD K_PARAM 2 # continues");
        let place = SourceLocation { line: 5, column, word };
        assert_eq!(load(&mut bench, &text), [SchemeError { place, problem }], "{row}");
        bench.rows("MOD_ENG MOD_CLOSE PCTRL_MOD");
        assert_eq!(bench.snapshot(), before, "{row}");
    }
}

#[test]
fn a_row_is_for_the_sides_it_names() {
    let cases: &[(&str, [bool; 2])] = &[
        ("master", [true, false]),
        ("slave", [false, true]),
        ("m", [true, false]),
        ("s", [false, true]),
        ("m&s", [true, true]),
        ("s&m", [true, true]),
        ("master&s", [true, true]),
        ("m&m", [true, false]),
        ("all", [true, true]),
    ];
    for (destination, expected) in cases {
        let text = format!("{destination} MOD_ENG STOP");
        let row = scheme::rows(&text).next().unwrap();
        let found = [0, 1].map(|side| row.applies_to(SIDES[side], SIDES).unwrap());
        assert_eq!(found, *expected, "{destination}");
    }
}

#[test]
fn what_a_row_says_does_not_depend_on_how_it_is_set() {
    let plain = "m PDCTRL_MOD K_PARAM 5\nm PDCTRL_MOD K_PARAM[1] 7\nm MOD_ENG MOD_ON PDCTRL_MOD";
    let mut expected = robot();
    assert_eq!(load(&mut expected, plain), []);
    let pd = module("PDCTRL_MOD");
    let gains = [0, 1, 2].map(|axis| expected.dimsart.engine_mut().get(pd, 0, axis).unwrap());
    assert_eq!(gains, [5.0, 7.0, 5.0].map(Value::Real));
    for text in [
        plain.replace('\n', "\r\n"),
        plain.replace('\n', "\n\n\n"),
        plain.replace(' ', "\t  \t"),
        plain.replace('\n', " # K_PARAM 9 and more words than a row has\n"),
        plain.replace('\n', "#\n"),
        plain.replace('\n', "\n\tslave PDCTRL_MOD K_PARAM 900\n"),
        plain.replace("5", "5.0").replace("7", "+.7e1"),
        plain.replace("PDCTRL_MOD", "PDCTRL_MOD.1"),
        format!("  \t{plain}   \n"),
        format!("\u{feff}# saved by an editor that marks its files\n{plain}"),
        format!("\u{feff}{plain}"),
    ] {
        let mut bench = robot();
        assert_eq!(load(&mut bench, &text), [], "{text:?}");
        assert_eq!(bench.snapshot(), expected.snapshot(), "{text:?}");
    }
}

#[test]
fn ports_are_bound_by_name_whether_or_not_the_module_exists() {
    let mut bench = robot();
    let text = "all TIMEDELAY_MOD.2 PORT_SIGNAL_IN FORCE.3\nall TIMEDELAY_MOD.2 PORT_SIGNAL_OUT FORCE.4
        all COMM_TXMOD CTX_ADD_DATA FORCE.3\nall COMM_TXMOD PORT_DATA_1 FORCE.4";
    assert_eq!(load(&mut bench, text), []);
    let engine = bench.dimsart.engine();
    let force = |number| Some(dimsart_core::TypeRef { number, ..types::FORCE.first() });
    let delay = module("TIMEDELAY_MOD.2");
    assert_eq!(engine.binding(delay, "SIGNAL_IN"), force(3));
    assert_eq!(engine.binding(delay, "SIGNAL_OUT"), force(4));
    assert_eq!(engine.binding(module("COMM_TXMOD"), "DATA_1"), force(4));
}

#[test]
fn every_module_parameter_and_port_can_be_named_in_a_scheme() {
    let mut bench = robot();
    for known in ALL.list() {
        let kind = known.id;
        let mut rows = String::new();
        for index in 0.. {
            let Some(parameter) = ALL.describe_parameter(kind, index) else { break };
            let value = match parameter.accepts {
                ParameterType::Real { min, max } => 1.0_f32.clamp(min, max).to_string(),
                ParameterType::Count { max, .. } => max.to_string(),
                ParameterType::Integer { max, .. } => max.to_string(),
                ParameterType::Flag => "ON".to_owned(),
                ParameterType::Choice(names) => (*names.last().unwrap()).to_owned(),
                ParameterType::Types => "POSITION".to_owned(),
            };
            rows += &format!("all {} {} {value}\n", known.name, parameter.name);
        }
        assert_eq!(load(&mut bench, &rows), [], "{rows}");
        // The parameters determine the ports.
        let ports = bench.dimsart.engine_mut().ports(ModuleRef { kind, number: 1 }).unwrap();
        let signals = ports.iter().filter(|port| port.data_type.is_some());
        let rows: String =
            signals.map(|port| format!("all {} PORT_{} FORCE.9\n", known.name, port.name)).collect();
        assert_eq!(load(&mut bench, &rows), [], "{rows}");
        bench.rows("MOD_ENG CLOSE");
    }
}

/// Words of schemes and similar ones.
fn word() -> impl Strategy<Value = String> {
    let known = prop::sample::select(vec![
        "m",
        "s",
        "m&s",
        "all",
        "master",
        "MOD_ENG",
        "MOD_ON",
        "MOD_OFF",
        "MOD_CLOSE",
        "MOD_INIT",
        "MOD_RESET",
        "PLACE_BEFORE",
        "MATCHING_CHECK",
        "STOP",
        "CLOSE",
        "PDCTRL_MOD",
        "PDCTRL_MOD.2",
        "WTRANSF_MOD",
        "TIMEDELAY_MOD",
        "COMM_RXMOD",
        "VEL2POS_MOD",
        "K_PARAM",
        "K_PARAM[1]",
        "K_PARAM[9]",
        "LAW_OUTPUT",
        "TD_PARAM",
        "FORM",
        "CRX_ADD_DATA",
        "PORT_POSITION",
        "PORT_DES_FORCE",
        "FORCE",
        "FORCE.255",
        "CH2_WAVES",
        "ON",
        "IMPLICIT",
        "0",
        "1000",
        "3e38",
        "-0",
        "nan",
        "#",
        "\r",
    ]);
    prop_oneof![8 => known.prop_map(str::to_owned), 1 => "\\PC{0,6}", 1 => any::<String>()]
}

/// Rows that are sometimes valid, so that some take effect.
fn row() -> impl Strategy<Value = String> {
    let module = || prop::sample::select(vec!["PDCTRL_MOD", "PCTRL_MOD", "TIMEDELAY_MOD", "VEL2POS_MOD"]);
    let verb = prop::sample::select(vec!["MOD_ON", "MOD_OFF", "MOD_CLOSE", "MOD_INIT", "PLACE_BEFORE"]);
    prop_oneof![
        2 => prop::collection::vec(word(), 0..7).prop_map(|words| words.join(" ")),
        2 => (verb, module()).prop_map(|(verb, module)| format!("m MOD_ENG {verb} {module}")),
        1 => (module(), word(), word()).prop_map(|(module, name, value)| format!("m {module} {name} {value}")),
        1 => Just("m MOD_ENG MATCHING_CHECK".to_owned()),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig {
        failure_persistence: Some(Box::new(FileFailurePersistence::WithSource("regressions"))),
        ..ProptestConfig::default()
    })]

    #[test]
    fn no_row_whatsoever_changes_anything_when_it_fails(rows in prop::collection::vec(row(), 1..12)) {
        let mut bench = Bench::of(3, &[types::POSITION, types::DES_POSITION], &[types::DES_FORCE]);
        for row in rows {
            for line in row.lines() {
                let before = bench.snapshot();
                if !load(&mut bench, line).is_empty() {
                    prop_assert_eq!(bench.snapshot(), before, "{:?}", line);
                }
            }
        }
    }

    #[test]
    fn every_error_points_at_its_word(text in any::<String>(), rows in prop::collection::vec(row(), 0..4)) {
        let text = rows.join("\n") + &text;
        let mut bench = robot();
        for SchemeError { place, .. } in load(&mut bench, &text) {
            let line = text.lines().nth(place.line - 1).unwrap();
            prop_assert!(line[place.column - 1..].starts_with(place.word), "{:?} {:?}", place, line);
        }
    }
}
