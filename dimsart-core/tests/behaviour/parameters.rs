//! Parameters of every type: one value, one per axis, a matrix; through rows, wire and saved schemes.
#![expect(clippy::unwrap_used, reason = "in helpers of tests as in tests")]

use crate::common::Bench;
use dimsart_core::{
    Command, CommandError, Context, Declarations, Dimsart, Input, Module, ModuleRef, Output, ParameterError,
    ParameterShape, Parameters, Unit, Value, choice, limits::MAX_DOF, types, words,
};
use dimsart_core::{
    ModuleKinds, ParameterDescription, ParameterSet, ParameterTypeDescription, ProvidedMemory,
};
use dimsart_link::saved_scheme::{self, fingerprint};

const DOF: usize = 3;

choice! {
    enum Law { Free = "FREE", Spring = "SPRING", Damper = "DAMPER" }
}

words! {
    parameters Settings {
        /// Signed.
        offset: i32 = integer("OFFSET", Unit::One, -100..=i32::MAX, -1),
        /// Matrix.
        matrix: [[f32; 3]; 2] = matrix("M", Unit::One, -10.0..=10.0, 0.5),
    }
    parameters Gains {
        /// Whole number.
        count: u32 = per_axis_count("COUNT", Unit::Tick, 0..=9, 1),
        /// Switch.
        flag: bool = per_axis_flag("FLAG", true),
        /// Names.
        law: Law = per_axis_choice("LAW"),
        /// Signed per axis.
        turns: i32 = per_axis_integer("TURNS", Unit::One, i32::MIN..=5, 0),
        /// Row per axis.
        row: [f32; 4] = per_axis_row("ROW", Unit::Stiffness, 0.0..=1e6, 0.0),
        /// Gain.
        square: [f32; MAX_DOF] = square("K", Unit::Stiffness, -1e6..=1e6, 0.0),
    }
    ports Ports { input: Input, output: Output }
}

/// State feedback with a gain of any kind.
#[derive(Debug)]
struct Feedback;

impl Module for Feedback {
    const NAME: &'static str = "FEEDBACK_MOD";
    const SUMMARY: &'static str = "Multiplies by a matrix.";
    type Settings = Settings;
    type Gains = Gains;
    type State = ();
    type AxisState = ();
    type Ports = Ports;

    fn parameters(settings: &mut Settings, gains: &mut Gains, visit: &mut Parameters<'_>) {
        settings.visit(visit);
        gains.visit(visit);
    }

    fn ports(_: &Settings, declare: &mut Declarations<'_>) -> Ports {
        let input = declare.input("POSITION", types::POSITION);
        Ports { input, output: declare.output("DES_FORCE", types::DES_FORCE) }
    }

    fn compute(context: &Context<'_, Self>) {
        let Ports { input, output } = context.ports();
        context.map_axis_contexts([], [output], |_, lane, []| {
            let columns = lane.gains().square.into_iter().take(context.dof());
            [columns.enumerate().map(|(column, gain)| gain * context.axis(input, column)).sum()]
        });
    }
}

const FEEDBACKS: ModuleKinds = dimsart_core::kinds![Feedback];

const MODULE: ModuleRef = ModuleRef::new("FEEDBACK_MOD", 1);

fn bench() -> Bench {
    let mut bench = Bench::with_kinds(FEEDBACKS, DOF, &[types::POSITION], &[types::DES_FORCE]);
    bench.rows("MOD_ENG MOD_ON FEEDBACK_MOD");
    bench
}

fn values(bench: &mut Bench, name: &str, count: u8) -> Vec<Value> {
    let index = FEEDBACKS.parameter(MODULE.kind, name).unwrap();
    (0..count).map(|place| bench.dimsart.engine_mut().get(MODULE, index, place).unwrap()).collect()
}

fn reals(values: &[f32]) -> Vec<Value> {
    values.iter().copied().map(Value::Real).collect()
}

const ROWS: &str = "
    FEEDBACK_MOD OFFSET -77
    FEEDBACK_MOD M[0][2] 3.5
    FEEDBACK_MOD M[1][0] -2
    FEEDBACK_MOD COUNT 4
    FEEDBACK_MOD COUNT[1] 9
    FEEDBACK_MOD FLAG[2] OFF
    FEEDBACK_MOD LAW[0] DAMPER
    FEEDBACK_MOD LAW[1] SPRING
    FEEDBACK_MOD TURNS[1] -2147483648
    FEEDBACK_MOD ROW[1][3] 7
    FEEDBACK_MOD K 1
    FEEDBACK_MOD K[0][1] -20
    FEEDBACK_MOD K[2][2] 300";

fn assert_set(bench: &mut Bench) {
    assert_eq!(values(bench, "OFFSET", 1), [Value::Integer(-77)]);
    assert_eq!(values(bench, "M", 6), reals(&[0.5, 0.5, 3.5, -2.0, 0.5, 0.5]));
    assert_eq!(values(bench, "COUNT", 3), [4, 9, 4].map(Value::Count));
    assert_eq!(values(bench, "FLAG", 3), [true, true, false].map(Value::Flag));
    assert_eq!(values(bench, "LAW", 3), [2, 1, 0].map(Value::Choice));
    assert_eq!(values(bench, "TURNS", 3), [0, i32::MIN, 0].map(Value::Integer));
    assert_eq!(values(bench, "ROW", 12), reals(&[0., 0., 0., 0., 0., 0., 0., 7., 0., 0., 0., 0.]));
    assert_eq!(values(bench, "K", 9), reals(&[1., -20., 1., 1., 1., 1., 1., 1., 300.]));
}

#[test]
fn rows_set_every_kind_of_parameter_and_a_saved_scheme_brings_it_back() {
    let mut bench = bench();
    bench.run(ROWS);
    assert_set(&mut bench);
    let force = bench.tick(&[1.0, 2.0, 3.0]);
    assert_eq!(force, [1.0 - 40.0 + 3.0, 6.0, 3.0 + 900.0]);

    let image = fingerprint(bench.dimsart.engine_mut());
    let saved = saved_scheme::save(bench.dimsart.engine_mut()).unwrap();
    let mut other = Bench::with_kinds(FEEDBACKS, DOF, &[types::POSITION], &[types::DES_FORCE]);
    saved_scheme::load(&saved, image, &mut other.dimsart).unwrap();
    assert_set(&mut other);
    assert_eq!(other.tick(&[1.0, 2.0, 3.0]), force);
    let commands: Vec<Command> = bench.dimsart.engine_mut().rebuild_commands().collect();
    assert_eq!(other.dimsart.engine_mut().rebuild_commands().collect::<Vec<_>>(), commands);
}

#[test]
fn defaults_are_those_of_every_entry_and_take_no_command() {
    let mut bench = bench();
    let defaults = |bench: &mut Bench| {
        assert_eq!(values(bench, "OFFSET", 1), [Value::Integer(-1)]);
        assert_eq!(values(bench, "M", 6), reals(&[0.5; 6]));
        assert_eq!(values(bench, "COUNT", 3), [Value::Count(1); 3]);
        assert_eq!(values(bench, "FLAG", 3), [Value::Flag(true); 3]);
        assert_eq!(values(bench, "K", 9), reals(&[0.0; 9]));
    };
    defaults(&mut bench);
    assert_eq!(bench.dimsart.engine_mut().rebuild_commands().collect::<Vec<_>>(), [Command::PlugIn(MODULE)]);
    bench.rows(ROWS);
    bench.rows("MOD_ENG MOD_OFF FEEDBACK_MOD\nMOD_ENG MOD_INIT FEEDBACK_MOD");
    defaults(&mut bench);
}

#[test]
fn what_an_entry_cannot_be_is_refused_and_changes_nothing() {
    let mut bench = bench();
    bench.rows(ROWS);
    for (row, word) in [
        ("OFFSET -101", "Value { module"),
        ("OFFSET 1.5", "Value { module"),
        ("OFFSET[0] 1", "Entry { module"),
        ("TURNS[3] 1", "Refused(Parameter(NoSuchEntry))"),
        ("TURNS[0] 6", "Value { module"),
        ("TURNS[0][0] 1", "Entry { module"),
        ("COUNT[0] -1", "Value { module"),
        ("COUNT[3] 1", "Refused(Parameter(NoSuchEntry))"),
        ("FLAG[0] 1", "Value { module"),
        ("LAW[0] SPRINGY", "Value { module"),
        ("M[0] 1", "Entry { module"),
        ("M[2][0] 1", "Entry { module"),
        ("M[0][3] 1", "Entry { module"),
        ("M[0][0] 10.5", "Value { module"),
        ("M[0][0] NaN", "Value { module"),
        ("M[0][0][0] 1", "Entry { module"),
        ("M[0]1] 1", "Entry { module"),
        ("ROW[3][0] 1", "Entry { module"),
        ("ROW[0][4] 1", "Entry { module"),
        ("K[0][3] 1", "Entry { module"),
        ("K[3][0] 1", "Entry { module"),
        ("K[255][2] 1", "Entry { module"),
    ] {
        let errors = bench.load(&format!("FEEDBACK_MOD {row}"));
        assert!(errors.len() == 1 && errors[0].contains(word), "{row}: {errors:?}");
        assert_set(&mut bench);
    }
    let set = |parameter, entry, value| Command::Set { module: MODULE, parameter, entry, value };
    for (command, expected) in [
        (set(0, None, Value::Count(1)), ParameterError::WrongKind),
        (set(0, None, Value::Real(1.0)), ParameterError::WrongKind),
        (set(0, None, Value::Integer(-101)), ParameterError::OutOfRange),
        (set(1, Some(6), Value::Real(1.0)), ParameterError::NoSuchEntry),
        (set(1, Some(0), Value::Real(f32::NAN)), ParameterError::OutOfRange),
        (set(7, Some(9), Value::Real(1.0)), ParameterError::NoSuchEntry),
        (set(9, None, Value::Integer(1)), ParameterError::Unknown),
    ] {
        assert_eq!(bench.dimsart.command(command), Err(CommandError::Parameter(expected)), "{command:?}");
        assert_set(&mut bench);
    }
    let engine = bench.dimsart.engine_mut();
    assert_eq!(engine.get(MODULE, 1, 6), Err(ParameterError::NoSuchEntry.into()));
    assert_eq!(engine.get(MODULE, 7, 9), Err(ParameterError::NoSuchEntry.into()));
}

#[test]
fn a_matrix_takes_as_many_axes_as_the_device_has() {
    for dof in 1..=MAX_DOF {
        let mut bench = Bench::with_kinds(FEEDBACKS, dof, &[types::POSITION], &[types::DES_FORCE]);
        bench.rows("MOD_ENG MOD_ON FEEDBACK_MOD");
        let last = dof - 1;
        bench.run(&format!("FEEDBACK_MOD K[0][{last}] 2\nFEEDBACK_MOD K[{last}][{last}] 5"));
        let mut expected = vec![0.0; dof];
        expected[0] += 2.0;
        expected[last] = 5.0;
        assert_eq!(bench.tick(&vec![1.0; dof]), expected);
    }
}

#[test]
fn every_kind_of_parameter_describes_itself() {
    let parameters = (0..).map_while(|index| FEEDBACKS.describe_parameter(MODULE.kind, index));
    let texts: Vec<_> =
        parameters.map(|parameter| ParameterDescription::try_from(parameter).unwrap()).collect();
    let accepts: Vec<_> = texts.into_iter().map(|text| (text.accepts, text.entries)).collect();
    let names = heapless::Vec::from_slice(&["FREE", "SPRING", "DAMPER"]).unwrap();
    assert_eq!(
        accepts,
        [
            (ParameterTypeDescription::Integer { min: -100, max: i32::MAX }, ParameterShape::ONE),
            (
                ParameterTypeDescription::Real { min: -10.0, max: 10.0 },
                ParameterShape { rows: 2, columns: 3 }
            ),
            (ParameterTypeDescription::Count { min: 0, max: 9 }, ParameterShape::AXES),
            (ParameterTypeDescription::Flag, ParameterShape::AXES),
            (ParameterTypeDescription::Choice(names), ParameterShape::AXES),
            (ParameterTypeDescription::Integer { min: i32::MIN, max: 5 }, ParameterShape::AXES),
            (ParameterTypeDescription::Real { min: 0.0, max: 1e6 }, ParameterShape { rows: 0, columns: 4 }),
            (ParameterTypeDescription::Real { min: -1e6, max: 1e6 }, ParameterShape::SQUARE),
        ]
    );
}

#[test]
fn a_controller_without_the_module_has_none_of_its_parameters() {
    let device = bench().dimsart.engine().device().clone();
    let mut dimsart = Dimsart::new(ProvidedMemory::leak_default(), device, FEEDBACKS).unwrap();
    assert_eq!(dimsart.engine_mut().get(MODULE, 0, 0), Err(CommandError::NotPluggedIn(MODULE)));
}
