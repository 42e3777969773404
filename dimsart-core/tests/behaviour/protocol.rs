//! Command protocol: line errors, and a host that uses only the device's answers.
#![expect(clippy::unwrap_used, clippy::panic, reason = "in helpers of tests as in tests")]

macro_rules! unwrap {
    ($variant:ident, $response:expr) => {
        match $response {
            Response::$variant(content) => content,
            other => panic!("{other:?}"),
        }
    };
}

mod looking;
mod noise;
mod served;

use crate::common::module_at;
use dimsart_core::{
    AxisKind, Command, CommandError, DataTypeDescription, Endpoint, EngineCommand, Finding, Format,
    FrameError, ModuleRef, ParameterDescription, ParameterError, ParameterType, ParameterTypeDescription,
    PortDescription, TickResult, Timing, TypeRef, Unit, Value, scheme, types,
};
use dimsart_link::protocol::{
    Effect, MAX_SIGNAL_WORDS, NotCommandedReason, PROTOCOL_VERSION, Refusal, Request, Response, SchemeAction,
    StoreError, TimingReport,
};
use dimsart_modules::ALL;

use served::{MAP, ServedDevice, frame, module, robot};

const SIDES: &[&str] = &["master", "slave"];
const SCHEME: &str = include_str!("../../../schemes/bilateral.scheme");

#[test]
fn a_frame_has_these_bytes() {
    let command = Command::PlugIn(ModuleRef::new("PDCTRL_MOD", 1));
    // Class, id, request, engine, MOD_ON, no axis, module, CRC (which includes channel 0); each zero is
    // replaced by the distance to the next one.
    let expected = [0, 5, 1, 2, 1, 7, 2, 1, 9, 5, 0x9E, 0x73, 1, 0x4D, 0x78, 0x09, 0xDE, 0];
    assert_eq!(frame(Request::Command(command), 0x0102), expected);
}

#[test]
fn the_device_introduces_itself() {
    let identity = unwrap!(Identity, ServedDevice::new().ask(Request::Identify));
    assert_eq!(
        (identity.protocol_version, identity.device, identity.image),
        (PROTOCOL_VERSION, "arm", "test 0.1")
    );
    assert_eq!(identity.axes, [AxisKind::Linear, AxisKind::Rotary, AxisKind::Linear]);
    assert_eq!(identity.sample_period_s.to_bits(), 1e-3_f32.to_bits());
}

#[test]
fn every_module_and_parameter_of_the_library_is_described_as_the_engine_has_it() {
    let mut served = ServedDevice::new();
    let kinds = served.list(|place| Request::Module { place });
    assert_eq!(kinds.len(), ALL.list().len());
    for (found, expected) in kinds.into_iter().zip(ALL.list()) {
        let kind = expected.id;
        let found = unwrap!(Module, found);
        assert_eq!(found.name, expected.name);
        let found = served.list(|index| Request::Parameter { kind, index });
        let expected = (0..).map_while(|index| ALL.describe_parameter(kind, index));
        let expected: Vec<_> = expected.collect();
        assert_eq!(found.len(), expected.len());
        for (found, expected) in found.into_iter().zip(expected) {
            let found = unwrap!(Parameter, found);
            assert_eq!((found.name, found.unit), (expected.name, expected.unit));
            assert_eq!(found.default, expected.default);
            assert_eq!(found.is_structural, expected.is_structural);
            assert_eq!(found.entries, expected.entries);
            assert_same(&found.accepts, expected.accepts);
        }
    }
}

fn assert_same(found: &ParameterTypeDescription<'_>, expected: ParameterType) {
    match (found, expected) {
        (ParameterTypeDescription::Choice(found), ParameterType::Choice(expected)) => {
            assert_eq!(found, expected)
        }
        // All other variants have the same fields with the same names.
        (found, expected) => assert_eq!(format!("{found:?}"), format!("{expected:?}")),
    }
}

#[test]
fn ports_are_described_with_what_they_are_bound_to() {
    let mut served = ServedDevice::new();
    let second = ModuleRef { number: 2, ..module("PDCTRL_MOD") };
    let elsewhere = TypeRef { id: types::DES_POSITION.id, number: 2 };
    assert_eq!(served.command(Command::bind(second, 1, elsewhere)).refused, None);
    let modules = (0..16).map(|place| module_at(place, 1)).chain([second]);
    for module in modules {
        let found = served.list(|index| Request::Port { module, index });
        let expected = served.dimsart.engine_mut().ports(module).unwrap();
        assert_eq!(found.len(), expected.len());
        for (found, spec) in found.into_iter().zip(expected) {
            let engine = served.dimsart.engine();
            let default = spec.data_type.map(|(_, signal)| signal);
            let bound = engine.binding(module, spec.name).or(default);
            let (name, direction, stage) = (spec.name, spec.direction, spec.stage);
            let expected =
                PortDescription { name, direction, stage, is_delayed: spec.is_delayed, default, bound };
            assert_eq!(unwrap!(Port, found), expected);
        }
    }
    let bound = unwrap!(Port, served.ask(Request::Port { module: second, index: 1 })).bound;
    assert_eq!(bound, Some(elsewhere));
}

#[test]
fn data_types_are_the_catalogue_and_the_devices_own() {
    let mut served = ServedDevice::new();
    let found = served.list(|index| Request::DataType { index: index.into() });
    let expected = types::ALL.iter().chain([MAP]);
    assert_eq!(found.len(), types::ALL.len() + 1);
    for (found, expected) in found.into_iter().zip(expected) {
        let DataTypeDescription { id, name, unit, format, shape } = unwrap!(DataType, found);
        assert_eq!((id, name, unit), (expected.id, expected.name, expected.unit));
        assert_eq!((format, shape), (expected.format, expected.shape));
    }
}

/// What a host has learned about a device by asking.
struct Catalogue {
    modules: Vec<&'static str>,
    types: Vec<DataTypeDescription<'static>>,
}

impl Catalogue {
    fn learn(served: &mut ServedDevice) -> Self {
        let modules = served.list(|place| Request::Module { place });
        let types = served.list(|index| Request::DataType { index: index.into() });
        Self {
            modules: modules.into_iter().map(|module| unwrap!(Module, module).name).collect(),
            types: types.into_iter().map(|data_type| unwrap!(DataType, data_type)).collect(),
        }
    }

    fn module(&self, name: &str) -> ModuleRef {
        assert!(self.modules.contains(&name), "{name}");
        ModuleRef::new(name, 1)
    }

    fn command(&self, row: &scheme::Row<'_>, served: &mut ServedDevice) -> Command {
        if row.word(1) == scheme::ENGINE {
            let command = EngineCommand::from_name(row.word(2)).unwrap();
            let module = command.needs_module.then(|| self.module(row.word(3)));
            return command.with(module).unwrap();
        }
        let module = self.module(row.word(1));
        let parameters = served.list(|index| Request::Parameter { kind: module.kind, index });
        let mut parameters = (0..).zip(parameters).map(|(index, found)| (index, unwrap!(Parameter, found)));
        let (index, parameter) = parameters.find(|(_, parameter)| parameter.name == row.word(2)).unwrap();
        Command::set(module, index, self.value(&parameter, row.word(3)))
    }

    fn value(&self, parameter: &ParameterDescription<'_>, word: &str) -> Value {
        match &parameter.accepts {
            ParameterTypeDescription::Real { .. } => Value::Real(word.parse().unwrap()),
            ParameterTypeDescription::Count { .. } => Value::Count(word.parse().unwrap()),
            ParameterTypeDescription::Flag => Value::Flag(word == "ON"),
            ParameterTypeDescription::Choice(names) => {
                let index = names.iter().position(|name| *name == word).unwrap();
                Value::Choice(u8::try_from(index).unwrap())
            }
            ParameterTypeDescription::Integer { .. } => Value::Integer(word.parse().unwrap()),
            ParameterTypeDescription::Types => {
                let found = self.types.iter().find(|data_type| data_type.name == word).unwrap();
                Value::Type(TypeRef { id: found.id, number: 1 })
            }
        }
    }
}

#[test]
fn a_scheme_sent_row_by_row_leaves_the_controller_as_loading_it_does() {
    for side in SIDES {
        let mut served = ServedDevice::new();
        let catalogue = Catalogue::learn(&mut served);
        for row in scheme::rows(SCHEME).filter(|row| row.applies_to(side, SIDES).unwrap()) {
            let command = catalogue.command(&row, &mut served);
            assert_eq!(served.command(command).refused, None, "line {} on the {side}", row.line());
        }
        let mut loaded = robot();
        assert_eq!(scheme::load(SCHEME, side, SIDES, &mut loaded, |error| panic!("{error:?}")), 0);
        assert_eq!(served.state(), format!("{loaded:?}"));
        let status = unwrap!(Status, served.ask(Request::Status));
        assert!(status.is_running);
        assert_eq!((status.blocked, status.usage), (None, loaded.engine().usage()));
        let instances = served.list(|index| Request::Instance { index });
        let names: Vec<_> = instances
            .into_iter()
            .map(|found| unwrap!(Instance, found))
            .map(|found| (ALL.module_name(found.module).name, found.place.unwrap()))
            .collect();
        let order = ["COMM_RXMOD", "WTRANSF_MOD", "PDCTRL_MOD", "TIMEDELAY_MOD", "COMM_TXMOD"];
        assert_eq!(names, order.into_iter().zip(0..).collect::<Vec<_>>());
    }
}

#[test]
fn an_accepted_command_says_what_still_keeps_the_device_still() {
    let mut served = ServedDevice::new();
    let pd = module("PDCTRL_MOD");
    let effect = served.command(Command::PlugIn(pd));
    let wanted = Finding::NoWriter { signal: types::DES_POSITION.first(), reader: Endpoint::Module(pd) };
    assert_eq!(
        effect,
        Effect {
            refused: None,
            blocked: Some(NotCommandedReason::Mismatch(wanted)),
            value: None,
            is_in_transaction: false
        }
    );
    assert_eq!(served.ask(Request::Finding { index: 0 }), Response::Finding { finding: wanted, faults: 1 });
    assert_eq!(served.ask(Request::Finding { index: 1 }), Response::Refused(Refusal::NotFound));
    let effect = served.command(Command::Check);
    assert_eq!(effect.refused, Some(CommandError::HasFaults { faults: 1 }));

    // Its own measured position can serve as the desired position.
    served.command(Command::Unplug(pd));
    let port = served.list(|index| Request::Port { module: pd, index });
    let port = port.into_iter().position(|found| unwrap!(Port, found).name == "DES_POSITION").unwrap();
    let bind = Command::bind(pd, u8::try_from(port).unwrap(), types::POSITION.first());
    assert_eq!(served.command(bind).value, Some(Value::Type(types::POSITION.first())));
    let effect = served.command(Command::PlugIn(pd));
    assert_eq!(
        effect,
        Effect {
            refused: None,
            blocked: Some(NotCommandedReason::Tick(TickResult::Idle)),
            value: None,
            is_in_transaction: false
        }
    );
    let effect = served.command(Command::Check);
    assert_eq!(effect, Effect { refused: None, blocked: None, value: None, is_in_transaction: false });

    served.tick(0.5);
    served.tick(f32::NAN);
    let reason = NotCommandedReason::Tick(TickResult::MeasurementRefused(FrameError::NotFinite {
        signal: types::POSITION.first(),
        word: 0,
    }));
    served.tick(0.5);
    assert_eq!(served.command(Command::Check).blocked, Some(reason));
    assert_eq!(served.command(Command::Reset).blocked, None);
    let status = unwrap!(Status, served.ask(Request::Status));
    let first = status.first_fault.unwrap();
    assert_eq!((status.ticks, status.refused_ticks, first.tick, first.reason), (3, 1, 2, reason));
}

#[test]
fn a_refused_command_changes_nothing_and_shows_the_value_that_holds() {
    let mut served = ServedDevice::new();
    let pd = module("PDCTRL_MOD");
    let one_axis =
        |axis, value| Command::Set { module: pd, parameter: 0, entry: Some(axis), value: Value::Real(value) };
    assert_eq!(served.command(Command::set(pd, 0, Value::Real(300.0))).value, Some(Value::Real(300.0)));
    assert_eq!(served.command(one_axis(1, 500.0)).value, Some(Value::Real(500.0)));
    assert_eq!(
        served.ask(Request::Get { module: pd, parameter: 0, entry: 0 }),
        Response::Value(Value::Real(300.0))
    );
    let before = served.state();
    for value in [f32::NAN, f32::INFINITY, -1.0] {
        let effect = served.command(one_axis(1, value));
        assert_eq!(effect.refused, Some(ParameterError::OutOfRange.into()));
        assert_eq!(effect.value, Some(Value::Real(500.0)));
    }
    let nobody = ModuleRef::new("NO_MOD", 1);
    for (command, error) in [
        (Command::PlugIn(nobody), CommandError::UnknownModule(nobody)),
        (Command::set(pd, 100, Value::Flag(true)), ParameterError::Unknown.into()),
        (Command::bind(pd, 100, types::POSITION.first()), CommandError::UnknownPort(100)),
    ] {
        assert_eq!(served.command(command).refused, Some(error));
    }
    let absent = served.ask(Request::Get { module: nobody, parameter: 0, entry: 0 });
    assert_eq!(absent, Response::Refused(Refusal::Engine(CommandError::NotPluggedIn(nobody))));
    assert_eq!(served.state(), before);
}

#[test]
fn signals_are_read_in_pieces_as_the_last_tick_left_them() {
    let mut served = ServedDevice::new();
    served.tick(0.25);
    let entries = served.list(|index| Request::Entry { index });
    let expected =
        [types::POSITION, MAP, types::DES_FORCE].map(|data_type| Response::Entry(data_type.first()));
    assert_eq!(entries, expected);
    let position = Request::Signal { signal: types::POSITION.first(), from: 0 };
    let position = unwrap!(Signal, served.ask(position));
    assert_eq!((position.format, position.unit, position.total_words), (Format::F32, Unit::Position, 3));
    assert_eq!(position.words, [0.25_f32.to_bits(), 0, 0]);
    let mut words = Vec::new();
    for from in [0, 32] {
        let part = unwrap!(Signal, served.ask(Request::Signal { signal: MAP.first(), from }));
        assert_eq!(part.total_words, 40);
        assert!(part.words.len() <= MAX_SIGNAL_WORDS);
        words.extend(part.words.into_iter().map(f32::from_bits));
    }
    assert_eq!(words, (1..=40_u8).map(f32::from).collect::<Vec<_>>());
    let missing = TypeRef { number: 2, ..MAP.first() };
    for (signal, from) in [(MAP.first(), 41), (missing, 0)] {
        assert_eq!(served.ask(Request::Signal { signal, from }), Response::Refused(Refusal::NotFound));
    }
}

#[test]
fn a_scheme_is_told_command_by_command() {
    let mut served = ServedDevice::new();
    assert_eq!(scheme::load(SCHEME, "slave", SIDES, &mut served.dimsart, |error| panic!("{error:?}")), 0);
    let expected: Vec<Command> = served.dimsart.engine_mut().rebuild_commands().collect();
    let mut found = Vec::new();
    for place in 0..=u8::MAX {
        let of_module = (0..=u16::MAX).map(|index| served.ask(Request::SchemeCommand { place, index }));
        let of_module: Vec<_> =
            of_module.take_while(|answer| *answer != Response::Refused(Refusal::NotFound)).collect();
        if of_module.is_empty() {
            break;
        }
        found.extend(of_module.into_iter().map(|answer| unwrap!(SchemeCommand, answer)));
    }
    assert_eq!(found, expected);
    assert!(found.len() >= 10, "{found:?}");
}

#[test]
fn timing_is_told_by_a_device_that_has_a_clock_and_a_controller_alone_keeps_no_schemes() {
    let mut served = ServedDevice::new();
    assert_eq!(served.ask(Request::Timing), Response::Refused(Refusal::NotFound));
    let mut timing = Timing::default();
    timing.count(true, false);
    timing.count(false, true);
    timing.measure(25);
    served.info.set_timing(timing);
    let report = TimingReport { ticks: 2, late: 1, overruns: 1, last_mean_max_cycles: Some([25; 3]) };
    assert_eq!(unwrap!(Timing, served.ask(Request::Timing)), report);
    let refused = Response::Refused(Refusal::Store(StoreError::NoStorage));
    assert_eq!(served.ask(Request::Schemes(SchemeAction::Save)), refused);
}
