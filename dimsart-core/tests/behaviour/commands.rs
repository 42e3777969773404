//! Every command has its effect or is refused, and a refused command changes nothing.
#![expect(clippy::unwrap_used, reason = "in helpers of tests as in tests")]
#![expect(clippy::cast_possible_truncation, reason = "numbers of a test, small by construction")]

use crate::common::{self, Bench, Snapshot};
use dimsart_core::ModuleKinds;
use dimsart_core::{
    Command, CommandError, Context, Declarations, Endpoint, Finding, Input, Module, ModuleRef,
    ParameterError, StorageError, TypeRef, Value, limits::MAX_MODULES, types,
};
use dimsart_modules::ALL;

fn module(name: &str) -> ModuleRef {
    ALL.module(name).unwrap()
}

fn on(name: &str) -> Command {
    Command::PlugIn(module(name))
}

fn off(name: &str) -> Command {
    Command::Unplug(module(name))
}

fn close(name: &str) -> Command {
    Command::CloseModule(module(name))
}

fn set(name: &str, parameter: &str, value: Value) -> Command {
    let module = module(name);
    Command::set(module, ALL.parameter(module.kind, parameter).unwrap(), value)
}

fn robot() -> Bench {
    Bench::of(3, &[types::POSITION, types::DES_POSITION], &[types::DES_FORCE])
}

const RUNNING: &str = "PDCTRL_MOD K_PARAM 100
    PDCTRL_MOD D_PARAM 2
    MOD_ENG MOD_ON PDCTRL_MOD
    PIDCTRL_MOD K_PARAM 7
    RECORDER_MOD PORT_SIGNAL_IN DES_FORCE
    MOD_ENG MOD_ON RECORDER_MOD
    MOD_ENG MATCHING_CHECK";

const TOO_LONG: &str = "TIMEDELAY_MOD TD_PARAM 60000";

/// The maximum number of instances, one of them plugged in.
fn full_house() -> String {
    let delays: String =
        (1..=MAX_MODULES).map(|number| format!("TIMEDELAY_MOD.{number} TD_PARAM 5\n")).collect();
    delays + "MOD_ENG MOD_ON TIMEDELAY_MOD.3"
}

/// Modules that use all slots but two, with signals and memories.
fn no_slots() -> String {
    // A recorder uses a memory and, with its ports bound, two signals.
    let bind = "RECORDER_MOD.N PORT_SIGNAL_IN SIGNAL.N\nRECORDER_MOD.N PORT_ROWS RECORDED_ROWS.N\n";
    let wave = "WTRANSF_MOD.N PORT_POSITION POSITION.N\nWTRANSF_MOD.N PORT_WAVES_IN CH2_WAVES.N\n\
         WTRANSF_MOD.N PORT_DES_POSITION DES_POSITION.N\nWTRANSF_MOD.N PORT_DES_FORCE DES_FORCE.N\n\
         WTRANSF_MOD.N PORT_WAVES_OUT CH1_WAVES.N\nWTRANSF_MOD.N PORT_LINE_FORCE LINE_FORCE.N\n\
         WTRANSF_MOD.N PORT_LINE_VELOCITY LINE_VELOCITY.N\n";
    let several = |rows: &str, name: &str, numbers: std::ops::RangeInclusive<u8>| -> String {
        let rows = |n: u8| rows.replace(".N", &format!(".{n}")) + &format!("MOD_ENG MOD_ON {name}.{n}\n");
        numbers.map(rows).collect()
    };
    // 3 of the device, 8 x 7 of the wave transformers, 3 of the recorder.
    several(wave, "WTRANSF_MOD", 2..=9) + &several(bind, "RECORDER_MOD", 2..=2)
}

fn refusals() -> Vec<(String, Command, CommandError)> {
    let nowhere = ModuleRef::new("NO_MOD", 1);
    let zeroth = ModuleRef::new("PCTRL_MOD", 0);
    let unknown = TypeRef { id: 999, number: 1 };
    let zeroth_type = TypeRef { number: 0, ..types::FORCE.first() };
    let pd = module("PDCTRL_MOD");
    let delay = module("TIMEDELAY_MOD");
    let force = types::DES_FORCE.first();
    let second = |name| Finding::MultipleWriters {
        signal: force,
        first: Endpoint::Module(pd),
        second: Endpoint::Module(module(name)),
    };
    let missing = Finding::NoWriter { signal: force, reader: Endpoint::Module(module("RECORDER_MOD")) };
    let refused = |error| CommandError::Parameter(error);
    let axis = |axis, command: Command| match command {
        Command::Set { module, parameter, value, .. } => {
            Command::Set { module, parameter, entry: Some(axis), value }
        }
        other => other,
    };
    let nan = Value::Real(f32::NAN);
    let k_param = |value| set("PDCTRL_MOD", "K_PARAM", value);
    let rows: Vec<(&str, Command, CommandError)> = vec![
        ("", Command::PlugIn(nowhere), CommandError::UnknownModule(nowhere)),
        ("", Command::InitModule(zeroth), CommandError::UnknownModule(zeroth)),
        ("", Command::set(nowhere, 0, Value::Real(0.0)), CommandError::UnknownModule(nowhere)),
        ("", Command::bind(zeroth, 0, force), CommandError::UnknownModule(zeroth)),
        ("", Command::bind(pd, 3, force), CommandError::UnknownPort(3)),
        ("", Command::bind(pd, 127, force), CommandError::UnknownPort(127)),
        ("", Command::bind(delay, 2, types::FORCE.first()), CommandError::UnknownPort(2)),
        ("", Command::bind(pd, 0, unknown), CommandError::UnknownType(unknown)),
        ("", Command::bind(pd, 0, zeroth_type), CommandError::UnknownType(zeroth_type)),
        ("", set("COMM_RXMOD", "CRX_ADD_DATA", Value::Type(unknown)), CommandError::UnknownType(unknown)),
        ("", off("PDCTRL_MOD"), CommandError::NotPluggedIn(pd)),
        ("PDCTRL_MOD K_PARAM 1", off("PDCTRL_MOD"), CommandError::NotPluggedIn(pd)),
        ("", close("PDCTRL_MOD"), CommandError::NotPluggedIn(pd)),
        ("", Command::ResetModule(pd), CommandError::NotPluggedIn(pd)),
        ("", Command::PlaceBefore(pd), CommandError::NotPluggedIn(pd)),
        ("PDCTRL_MOD K_PARAM 1", Command::PlaceBefore(pd), CommandError::NotPluggedIn(pd)),
        ("MOD_ENG MOD_ON PDCTRL_MOD", on("PDCTRL_MOD"), CommandError::PluggedIn(pd)),
        ("MOD_ENG MOD_ON PDCTRL_MOD", Command::InitModule(pd), CommandError::PluggedIn(pd)),
        ("MOD_ENG MOD_ON PDCTRL_MOD", Command::bind(pd, 2, types::FORCE.first()), CommandError::PluggedIn(pd)),
        (
            TOO_LONG,
            on("TIMEDELAY_MOD"),
            // The device's three signals, the module's own words, and its two signals.
            StorageError::OutOfMemory { wanted: 180_000, free: 2048 - 9 - 6 - 6 }.into(),
        ),
        ("", k_param(nan), refused(ParameterError::OutOfRange)),
        ("", k_param(Value::Real(f32::INFINITY)), refused(ParameterError::OutOfRange)),
        ("", k_param(Value::Real(-1.0)), refused(ParameterError::OutOfRange)),
        ("", k_param(Value::Real(1.1e6)), refused(ParameterError::OutOfRange)),
        ("", set("TIMEDELAY_MOD", "TD_PARAM", Value::Count(60_001)), refused(ParameterError::OutOfRange)),
        ("", set("WTRANSF_MOD", "FORM", Value::Choice(3)), refused(ParameterError::OutOfRange)),
        ("", k_param(Value::Count(1)), refused(ParameterError::WrongKind)),
        ("", k_param(Value::Type(force)), refused(ParameterError::WrongKind)),
        ("", set("WTRANSF_MOD", "FORM", Value::Flag(true)), refused(ParameterError::WrongKind)),
        ("", set("COMM_RXMOD", "CRX_ADD_DATA", Value::Real(1.0)), refused(ParameterError::WrongKind)),
        ("", Command::set(pd, 3, Value::Real(1.0)), refused(ParameterError::Unknown)),
        ("", Command::set(pd, 126, Value::Real(1.0)), refused(ParameterError::Unknown)),
        ("", Command::set(pd, 127, Value::Real(1.0)), refused(ParameterError::WrongKind)),
        (RUNNING, Command::set(pd, 127, Value::Choice(1)), refused(ParameterError::WhilePluggedIn)),
        ("COMM_TXMOD EVERY_TICKS 2", on("COMM_TXMOD"), CommandError::RunsEveryTick(module("COMM_TXMOD"))),
        ("", axis(3, k_param(Value::Real(1.0))), refused(ParameterError::NoSuchEntry)),
        ("", axis(255, k_param(Value::Real(1.0))), refused(ParameterError::NoSuchEntry)),
        ("", axis(0, set("WTRANSF_MOD", "B_PARAM", Value::Real(1.0))), refused(ParameterError::NoSuchEntry)),
        (
            "COMM_RXMOD CRX_ADD_DATA CH2_WAVES\nCOMM_RXMOD CRX_ADD_DATA FORCE\nCOMM_RXMOD CRX_ADD_DATA FORCE.2
             COMM_RXMOD CRX_ADD_DATA FORCE.3",
            set("COMM_RXMOD", "CRX_ADD_DATA", Value::Type(force)),
            refused(ParameterError::ListFull),
        ),
        (
            "MOD_ENG MOD_ON TIMEDELAY_MOD",
            set("TIMEDELAY_MOD", "TD_PARAM", Value::Count(1)),
            refused(ParameterError::WhilePluggedIn),
        ),
        (
            "MOD_ENG MOD_ON PDCTRL_MOD",
            set("PDCTRL_MOD", "LAW_OUTPUT", Value::Flag(true)),
            refused(ParameterError::WhilePluggedIn),
        ),
        (
            "MOD_ENG MOD_ON RECORDER_MOD",
            Command::Check,
            CommandError::HasFaults { faults: 2 },
        ),
        (RUNNING, off("PDCTRL_MOD"), CommandError::BreaksScheme(missing)),
        (RUNNING, close("PDCTRL_MOD"), CommandError::BreaksScheme(missing)),
        (RUNNING, on("PIDCTRL_MOD"), CommandError::BreaksScheme(second("PIDCTRL_MOD"))),
        (RUNNING, on("PCTRL_MOD"), CommandError::BreaksScheme(second("PCTRL_MOD"))),
        (RUNNING, k_param(nan), refused(ParameterError::OutOfRange)),
        (RUNNING, on("PDCTRL_MOD"), CommandError::PluggedIn(pd)),
    ];
    let mut all: Vec<_> =
        rows.into_iter().map(|(rows, command, error)| (rows.to_owned(), command, error)).collect();
    for command in [
        on("PCTRL_MOD"),
        set("PCTRL_MOD", "K_PARAM", Value::Real(1.0)),
        Command::bind(module("PCTRL_MOD"), 0, force),
        Command::InitModule(module("PCTRL_MOD")),
    ] {
        all.push((full_house(), command, CommandError::TooManyModules));
    }
    all.push((no_slots(), on("TIMEDELAY_MOD"), StorageError::OutOfSlots.into()));
    all
}

/// A measurement that differs in every tick.
fn measurement(tick: u8) -> Vec<f32> {
    (0..6).map(|word| (f32::from(tick) * 0.37 + f32::from(word as u8)).sin()).collect()
}

#[test]
fn a_refused_command_changes_nothing_that_can_be_seen_now_or_later() {
    for (rows, command, error) in refusals() {
        let (mut bench, mut untouched) = (robot(), robot());
        bench.rows(&rows);
        untouched.rows(&rows);
        for tick in 0..5 {
            bench.try_tick(&common::words(&measurement(tick)));
            untouched.try_tick(&common::words(&measurement(tick)));
        }
        let before = bench.snapshot();
        assert_eq!(bench.dimsart.command(command), Err(error), "{rows}");
        assert_eq!(bench.snapshot(), before, "{command:?}");
        for tick in 5..10 {
            let measured = common::words(&measurement(tick));
            assert_eq!(bench.try_tick(&measured), untouched.try_tick(&measured), "{command:?}");
        }
        assert_eq!(bench.snapshot(), untouched.snapshot(), "{command:?}");
        assert!(error.to_string().len() > 20, "text too short: {error}");
    }
}

/// Declares one port more than the maximum.
#[derive(Debug)]
struct Greedy;

impl Module for Greedy {
    const NAME: &'static str = "GREEDY_MOD";
    const SUMMARY: &'static str = "Wants too many ports.";
    type Settings = ();
    type Gains = ();
    type State = ();
    type AxisState = ();
    type Ports = [Input; 13];

    fn ports(_: &(), declare: &mut Declarations<'_>) -> [Input; 13] {
        [(); 13].map(|()| declare.input("INPUT", types::FORCE))
    }

    fn compute(_: &Context<'_, Self>) {}
}

const GREEDIES: ModuleKinds = dimsart_core::kinds![Greedy];

#[test]
fn a_module_of_too_many_ports_is_refused() {
    let mut bench = Bench::with_kinds(GREEDIES, 3, &[types::FORCE], &[]);
    let before = bench.snapshot();
    let greedy = ModuleRef::new(Greedy::NAME, 1);
    for command in [Command::PlugIn(greedy), Command::bind(greedy, 0, types::FORCE.first())] {
        assert_eq!(bench.dimsart.command(command), Err(CommandError::TooManyPorts));
        assert_eq!(bench.snapshot(), before);
    }
}

fn steps(bench: &Bench) -> Vec<String> {
    bench.steps().iter().map(|step| step.replace(" Early", "")).collect()
}

#[test]
fn modules_run_in_the_order_of_their_plug_ins_unless_placed() {
    let mut bench = robot();
    bench.rows("MOD_ENG MOD_ON PCTRL_MOD\nMOD_ENG MOD_ON PDCTRL_MOD\nMOD_ENG MOD_ON SUM_MOD");
    assert_eq!(steps(&bench), ["PCTRL_MOD", "PDCTRL_MOD", "SUM_MOD"]);
    bench.rows("MOD_ENG PLACE_BEFORE PDCTRL_MOD\nMOD_ENG MOD_ON VWALL_MOD");
    assert_eq!(steps(&bench), ["PCTRL_MOD", "VWALL_MOD", "PDCTRL_MOD", "SUM_MOD"]);
    bench.rows("MOD_ENG MOD_ON SIGGEN_MOD");
    assert_eq!(steps(&bench).last().unwrap(), "SIGGEN_MOD", "a place is used once");
    bench.rows("MOD_ENG MOD_OFF PCTRL_MOD\nMOD_ENG MOD_CLOSE SUM_MOD\nMOD_ENG MOD_ON PCTRL_MOD");
    assert_eq!(steps(&bench), ["VWALL_MOD", "PDCTRL_MOD", "SIGGEN_MOD", "PCTRL_MOD"]);
}

#[test]
fn a_place_outlives_a_refused_plug_in() {
    let mut bench = robot();
    bench.rows("MOD_ENG MOD_ON PDCTRL_MOD\nMOD_ENG PLACE_BEFORE PDCTRL_MOD");
    bench.rows(TOO_LONG);
    assert!(bench.order("MOD_ENG MOD_ON TIMEDELAY_MOD").is_err());
    bench.rows("MOD_ENG MOD_ON VWALL_MOD");
    assert_eq!(steps(&bench), ["VWALL_MOD", "PDCTRL_MOD"]);
}

#[test]
fn a_place_is_forgotten_when_its_module_is_unplugged() {
    for rows in ["MOD_ENG MOD_OFF PDCTRL_MOD", "MOD_ENG MOD_CLOSE PDCTRL_MOD"] {
        let mut bench = robot();
        bench.rows("MOD_ENG MOD_ON PDCTRL_MOD\nMOD_ENG MOD_ON SUM_MOD\nMOD_ENG PLACE_BEFORE PDCTRL_MOD");
        bench.rows(rows);
        bench.rows("MOD_ENG MOD_ON PDCTRL_MOD\nMOD_ENG MOD_ON VWALL_MOD");
        assert_eq!(steps(&bench), ["SUM_MOD", "PDCTRL_MOD", "VWALL_MOD"]);
    }
    // The place before another module is kept.
    let mut bench = robot();
    bench.rows("MOD_ENG MOD_ON PDCTRL_MOD\nMOD_ENG MOD_ON SUM_MOD\nMOD_ENG PLACE_BEFORE PDCTRL_MOD");
    bench.rows("MOD_ENG MOD_OFF SUM_MOD\nMOD_ENG MOD_ON VWALL_MOD");
    assert_eq!(steps(&bench), ["VWALL_MOD", "PDCTRL_MOD"]);
}

#[test]
fn a_module_can_be_swapped_in_while_the_scheme_runs() {
    let mut bench = robot();
    bench.rows(RUNNING);
    bench.tick(&measurement(0));
    bench.rows("PIDCTRL_MOD PORT_DES_FORCE DES_FORCE.2\nMOD_ENG MOD_ON PIDCTRL_MOD");
    let commanded = bench.tick(&[0.0, 0.0, 0.0, 0.1, 0.2, 0.3]);
    let close = |found: f32, expected: f32| common::assert_close(found, expected, 1e-6);
    (0..3).for_each(|axis| close(bench.signal("DES_FORCE.2")[axis], 0.7 * [1.0, 2.0, 3.0][axis]));
    assert_eq!(commanded, bench.signal("DES_FORCE"));
    bench.rows("MOD_ENG MOD_OFF PIDCTRL_MOD");
    assert!(bench.dimsart.engine().is_running());
    assert_eq!(steps(&bench), ["PDCTRL_MOD", "RECORDER_MOD"]);
}

#[test]
fn gains_are_per_axis_and_an_axis_keeps_its_own() {
    let mut bench = robot();
    bench.run("PCTRL_MOD K_PARAM 10\nPCTRL_MOD K_PARAM[1] 20\nMOD_ENG MOD_ON PCTRL_MOD");
    let reach = [0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
    assert_eq!(bench.tick(&reach), [10.0, 20.0, 10.0]);
    bench.rows("PCTRL_MOD K_PARAM[2] 30");
    assert_eq!(bench.tick(&reach), [10.0, 20.0, 30.0], "in a running scheme from the next tick on");
    let engine = bench.dimsart.engine_mut();
    let p = module("PCTRL_MOD");
    assert_eq!([0, 1, 2].map(|axis| engine.get(p, 0, axis)), [10.0, 20.0, 30.0].map(|k| Ok(Value::Real(k))));
    assert_eq!(engine.get(p, 9, 0), Err(CommandError::Parameter(ParameterError::Unknown)));
    let other = module("PIDCTRL_MOD");
    assert_eq!(engine.get(other, 0, 0), Err(CommandError::NotPluggedIn(other)));
}

#[test]
fn unplugging_keeps_parameters_init_forgets_them_and_close_gives_the_place_back() {
    let mut bench = robot();
    let empty = bench.snapshot();
    bench.rows("PCTRL_MOD K_PARAM 10\nPCTRL_MOD PORT_DES_FORCE FORCE\nMOD_ENG MOD_ON PCTRL_MOD");
    bench.rows("MOD_ENG MOD_OFF PCTRL_MOD");
    let p = module("PCTRL_MOD");
    let engine = bench.dimsart.engine_mut();
    assert_eq!(engine.get(p, 0, 2), Ok(Value::Real(10.0)));
    assert_eq!(engine.binding(p, "DES_FORCE"), Some(types::FORCE.first()));
    bench.rows("MOD_ENG MOD_INIT PCTRL_MOD");
    let engine = bench.dimsart.engine_mut();
    assert_eq!(engine.get(p, 0, 2), Ok(Value::Real(0.0)));
    assert_eq!(engine.binding(p, "DES_FORCE"), None);
    bench.rows("MOD_ENG MOD_ON PCTRL_MOD\nMOD_ENG MOD_CLOSE PCTRL_MOD");
    assert_eq!(bench.snapshot(), empty);
}

#[test]
fn close_and_init_of_the_engine_lead_back_to_power_up() {
    for verb in ["CLOSE", "INIT"] {
        let mut bench = robot();
        let empty: Snapshot = bench.snapshot();
        bench.rows(RUNNING);
        bench.rows("MOD_ENG PLACE_BEFORE PDCTRL_MOD");
        bench.rows(&format!("MOD_ENG {verb}"));
        assert_eq!(bench.snapshot(), empty);
        bench.rows(RUNNING);
        assert!(bench.dimsart.engine().is_running());
        assert_eq!(steps(&bench), ["PDCTRL_MOD", "RECORDER_MOD"], "the place is cancelled, too");
    }
}

#[test]
fn stop_lets_the_scheme_be_rebuilt_and_the_check_starts_it_again() {
    let mut bench = robot();
    bench.rows(RUNNING);
    bench.rows("MOD_ENG STOP\nMOD_ENG MOD_OFF PDCTRL_MOD");
    assert_eq!(bench.order("MOD_ENG MATCHING_CHECK"), Err(CommandError::HasFaults { faults: 2 }));
    assert!(!bench.dimsart.engine().is_running());
    bench.rows("MOD_ENG MOD_ON PIDCTRL_MOD");
    assert_eq!(
        bench.findings(),
        ["RECORDER_MOD reads DES_FORCE before PIDCTRL_MOD writes it, so the value is one tick old: \
         plug in the writer first"]
    );
    bench.rows("MOD_ENG MOD_OFF RECORDER_MOD\nMOD_ENG MOD_ON RECORDER_MOD\nMOD_ENG MATCHING_CHECK");
    bench.tick(&measurement(0));
}

/// The master of the bilateral scheme with damping.
fn master(rows: &str) -> Bench {
    let text = include_str!("../../../schemes/bilateral.scheme");
    let sides = text.lines().filter(|row| row.starts_with("m"));
    let own: Vec<&str> = sides.filter_map(|row| row.split_once(' ')).map(|(_, row)| row.trim()).collect();
    let mut bench = Bench::of(1, &[types::POSITION], &[types::DES_FORCE]);
    bench.rows(&format!("PDCTRL_MOD D_PARAM 2\n{rows}\n{}", own.join("\n")));
    bench
}

#[test]
fn a_start_after_a_stop_is_as_the_first_one() {
    let implicit = "WTRANSF_MOD FORM IMPLICIT\nPDCTRL_MOD LAW_OUTPUT ON";
    for rows in ["", "COMM_RXMOD STALE HOLD", "COMM_RXMOD STALE LIMITED", implicit] {
        let (mut used, mut fresh) = (master(rows), master(rows));
        let mut sender = Bench::of(1, &[types::CH1_WAVES], &[]);
        sender.run("COMM_TXMOD CTX_CHANNEL 2\nCOMM_TXMOD CTX_ADD_DATA CH1_WAVES\nMOD_ENG MOD_ON COMM_TXMOD");
        for tick in 0..100 {
            sender.tick(&[2.0]);
            let packet = sender.dimsart.take_outgoing(0).unwrap();
            used.dimsart.receive(0, &packet.to_bytes()).unwrap();
            used.tick(&[1e-4 * f32::from(tick as u8)]);
        }
        assert!(used.signal("DES_FORCE")[0].abs() > 1.0);
        used.rows("MOD_ENG STOP");
        used.try_tick(&common::words(&[0.1]));
        used.rows("MOD_ENG MATCHING_CHECK");
        for tick in 0..100 {
            // Moved by hand while stopped.
            let position = 0.3 + 1e-4 * measurement(tick)[0];
            assert_eq!(used.tick(&[position]), fresh.tick(&[position]), "{rows}: {tick}");
            assert!(tick > 0 || used.signal("DES_FORCE") == [0.0], "{rows}: from rest");
        }
    }
}

#[test]
fn a_check_of_a_running_scheme_does_not_disturb_it() {
    let (mut checked, mut other) = (master(""), master(""));
    for tick in 0..20 {
        let position = measurement(tick)[0];
        checked.rows("MOD_ENG MATCHING_CHECK");
        assert_eq!(checked.tick(&[position]), other.tick(&[position]));
    }
}
