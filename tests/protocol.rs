//! The command protocol: what goes wrong on a line, and what a host can do with nothing but answers.
#![expect(clippy::unwrap_used, clippy::panic, reason = "in helpers of tests as in tests")]

use dimsart_core::protocol::{
    Accepted, Blocked, Counters, DataTypeText, DeviceInfo, Effect, MAX_FRAME_BYTES, MAX_SIGNAL_WORDS,
    PROTOCOL_VERSION, ParameterText, PortText, Receiver, Refusal, Request, Response, SchemeAction,
    StoreError, TimingReport, answer, client_of, decode_request, decode_response, encode_request, request_id,
};
use dimsart_core::{
    Accepts, AxisKind, Command, CommandError, DataType, DeviceDescriptor, Dimsart, Engine, Finding, Format,
    FrameError, ModuleList, ModuleRef, PORT, ParameterError, Party, Shape, Target, Timing, TypeRef, Unit,
    Value, Verb, Word, modules::Standard, scheme, types,
};
use proptest::prelude::Rng;
use proptest::test_runner::{RngAlgorithm, TestRng};

const SIDES: &[&str] = &["master", "slave"];
const SCHEME: &str = include_str!("../schemes/bilateral.scheme");

/// A type of this device alone, larger than one answer.
const MAP: &DataType = &DataType {
    id: 0x8001,
    name: "MAP",
    unit: Unit::One,
    format: Format::F32,
    shape: Shape::Matrix(5, 8),
    summary: "A map.",
};

fn robot() -> Dimsart {
    let axes = [AxisKind::Linear, AxisKind::Rotary, AxisKind::Linear];
    let device = DeviceDescriptor::new("arm", &axes, 1e-3, &[types::POSITION, MAP], &[types::DES_FORCE]);
    Dimsart::new(device.unwrap()).unwrap()
}

/// A controller at the far end of a line.
struct Line {
    dimsart: Dimsart,
    info: DeviceInfo,
    device: Receiver,
    host: Receiver,
    id: u16,
}

impl Line {
    fn new() -> Self {
        let info = DeviceInfo::new("test 0.1");
        Self { dimsart: robot(), info, device: Receiver::new(), host: Receiver::new(), id: 0 }
    }

    /// Sends bytes and gives what comes back.
    fn send(&mut self, bytes: &[u8]) -> Vec<(u16, Response<'static>)> {
        let mut answers = Vec::new();
        let Self { dimsart, info, device, host, .. } = self;
        device.take_all(bytes, |content| {
            let mut buffer = [0; MAX_FRAME_BYTES];
            let frame = answer(content, dimsart, info, &mut buffer).unwrap().unwrap();
            host.take_all(frame, |content| {
                // Leaked, so that the texts in the response outlive the frame.
                answers.push(decode_response(content.to_vec().leak()).unwrap());
            });
        });
        answers
    }

    fn ask(&mut self, request: Request) -> Response<'static> {
        self.id += 1;
        let answers = self.send(&frame(request, self.id));
        let [(id, response)] = answers.try_into().unwrap();
        assert_eq!(id, self.id);
        response
    }

    fn command(&mut self, command: Command) -> Effect {
        match self.ask(Request::Command(command)) {
            Response::Effect(effect) => effect,
            other => panic!("{other:?}"),
        }
    }

    /// Asks for index 0, 1, ... until the device says that there are no more.
    fn list(&mut self, request: impl Fn(u8) -> Request) -> Vec<Response<'static>> {
        let answers = (0..=u8::MAX).map(|index| self.ask(request(index)));
        answers.take_while(|response| *response != Response::Refused(Refusal::NotThere)).collect()
    }

    fn tick(&mut self, position: f32) {
        let mut measured = [Word(0); 43];
        measured[0] = position.into();
        measured[3..].iter_mut().zip(1u8..).for_each(|(word, value)| *word = f32::from(value).into());
        let tick = self.dimsart.tick(&measured, &mut [Word(0); 3]);
        self.info.count(tick);
    }

    fn state(&self) -> String {
        format!("{:?}", self.dimsart)
    }
}

fn frame(request: Request, id: u16) -> Vec<u8> {
    encode_request(&request, id, &mut [0; MAX_FRAME_BYTES]).unwrap().to_vec()
}

fn module(name: &str) -> ModuleRef {
    Engine::<Standard>::module(name).unwrap()
}

macro_rules! unwrap {
    ($variant:ident, $response:expr) => {
        match $response {
            Response::$variant(content) => content,
            other => panic!("{other:?}"),
        }
    };
}

#[test]
fn a_frame_has_these_bytes() {
    let command = Command::engine(Verb::ModOn, ModuleRef { kind: 6, number: 1 });
    // Class, id, request, engine, MOD_ON, no axis, module, CRC (of channel 0 too); each zero replaced by the way to the next.
    let expected = [0, 5, 1, 2, 1, 7, 2, 1, 8, 5, 6, 1, 0x0D, 0xAD, 0x0B, 0x80, 0];
    assert_eq!(frame(Request::Command(command), 0x0102), expected);
}

#[test]
fn a_valid_request_is_answered_after_ten_million_bytes_of_noise() {
    let mut line = Line::new();
    let before = line.state();
    let mut noise = vec![0; 1 << 20];
    let mut random = TestRng::deterministic_rng(RngAlgorithm::XorShift);
    for _ in 0..10 {
        random.fill_bytes(&mut noise);
        assert_eq!(line.send(&noise), []);
    }
    assert_eq!(line.send(&vec![0xAA; 100_000]), []);
    assert_eq!(line.state(), before);
    unwrap!(Identity, line.ask(Request::Identify));
    let Counters { frames, damaged, too_long } = line.device.counters();
    assert_eq!(frames, 1);
    assert!(damaged > 10_000 && too_long > 1_000, "{damaged} {too_long}");
}

#[test]
fn every_single_bit_error_costs_one_frame_and_changes_nothing() {
    let mut line = Line::new();
    let before = line.state();
    let good = frame(Request::Identify, 7);
    let pd = module("PDCTRL_MOD");
    for request in [
        Request::Command(Command::engine(Verb::ModOn, pd)),
        Request::Command(Command::set(pd, 0, Value::Real(3000.0))),
        Request::Status,
    ] {
        let whole = frame(request, 0x0100);
        for bit in 0..whole.len() * 8 {
            let mut damaged = whole.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(line.send(&damaged), [], "bit {bit} of {request:?}");
            assert_eq!(line.send(&good).len(), 1, "after bit {bit} of {request:?}");
        }
    }
    assert_eq!(line.state(), before);
}

#[test]
fn a_truncated_frame_costs_nothing_but_itself() {
    let mut line = Line::new();
    let before = line.state();
    let whole = frame(Request::Command(Command::engine(Verb::ModOn, module("PDCTRL_MOD"))), 1);
    // The last byte is the zero that ends the frame; the next frame's first zero does that too.
    for length in 0..whole.len() - 1 {
        assert_eq!(line.send(&whole[..length]), [], "cut to {length}");
        assert_eq!(line.send(&frame(Request::Status, 2)).len(), 1, "after a cut to {length}");
    }
    assert_eq!(line.state(), before);
}

#[test]
fn frames_one_behind_the_other_are_answered_in_order_however_they_arrive() {
    let mut line = Line::new();
    let bytes: Vec<u8> = (0..300).flat_map(|id| frame(Request::Identify, id)).collect();
    for size in [1, 2, 3, 7, 100, bytes.len()] {
        let ids = bytes.chunks(size).flat_map(|chunk| line.send(chunk)).map(|(id, _)| id);
        assert!(ids.eq(0..300), "in pieces of {size}");
    }
    let counters = Counters { frames: 1800, damaged: 0, too_long: 0 };
    assert_eq!(line.device.counters(), counters);
}

#[test]
fn the_device_introduces_itself() {
    let identity = unwrap!(Identity, Line::new().ask(Request::Identify));
    assert_eq!(
        (identity.protocol_version, identity.device, identity.image),
        (PROTOCOL_VERSION, "arm", "test 0.1")
    );
    assert_eq!(identity.axes, [AxisKind::Linear, AxisKind::Rotary, AxisKind::Linear]);
    assert_eq!(identity.sample_period_s.to_bits(), 1e-3_f32.to_bits());
}

#[test]
fn every_module_and_parameter_of_the_library_is_described_as_the_engine_has_it() {
    let mut line = Line::new();
    let kinds = line.list(|kind| Request::Module { kind });
    assert_eq!(kinds.len(), Standard::KINDS.len());
    for ((kind, found), expected) in (0..).zip(kinds).zip(Standard::KINDS) {
        let found = unwrap!(Module, found);
        assert_eq!((found.name, found.summary), (expected.name, expected.summary));
        let found = line.list(|index| Request::Parameter { kind, index });
        let expected = (0..).map_while(|index| Engine::<Standard>::describe_parameter(kind, index));
        let expected: Vec<_> = expected.collect();
        assert_eq!(found.len(), expected.len());
        for (found, expected) in found.into_iter().zip(expected) {
            let found = unwrap!(Parameter, found);
            assert_eq!((found.name, found.summary), (expected.name, expected.summary));
            assert_eq!(found.default, expected.default);
            assert_eq!(found.is_structural, expected.is_structural);
            let symbols = [AxisKind::Linear, AxisKind::Rotary].map(|axis| expected.unit.symbol(axis));
            assert_eq!([found.unit.linear, found.unit.rotary], symbols);
            assert_same(&found.accepts, expected.accepts);
        }
    }
}

fn assert_same(found: &Accepted<'_>, expected: Accepts) {
    match (found, expected) {
        (Accepted::Choice(found), Accepts::Choice(expected)) => assert_eq!(found, expected),
        // All the other variants have the same fields under the same names.
        (found, expected) => assert_eq!(format!("{found:?}"), format!("{expected:?}")),
    }
}

#[test]
fn ports_are_described_with_what_they_are_bound_to() {
    let mut line = Line::new();
    let second = ModuleRef { number: 2, ..module("PDCTRL_MOD") };
    let elsewhere = TypeRef { id: types::DES_POSITION.id, number: 2 };
    assert_eq!(line.command(Command::bind(second, 1, elsewhere)).refused, None);
    let modules = (0..16).map(|kind| ModuleRef { kind, number: 1 }).chain([second]);
    for module in modules {
        let found = line.list(|index| Request::Port { module, index });
        let expected = line.dimsart.engine_mut().ports(module).unwrap();
        assert_eq!(found.len(), expected.len());
        for (found, spec) in found.into_iter().zip(expected) {
            let engine = line.dimsart.engine();
            let default = spec.data_type.map(|(_, signal)| signal);
            let bound = engine.binding(module, spec.name).or(default);
            let (name, direction, stage) = (spec.name, spec.direction, spec.stage);
            let expected = PortText { name, direction, stage, is_delayed: spec.is_delayed, default, bound };
            assert_eq!(unwrap!(Port, found), expected);
        }
    }
    let bound = unwrap!(Port, line.ask(Request::Port { module: second, index: 1 })).bound;
    assert_eq!(bound, Some(elsewhere));
}

#[test]
fn data_types_are_the_catalogue_and_the_devices_own() {
    let mut line = Line::new();
    let found = line.list(|index| Request::DataType { index: index.into() });
    let expected = types::ALL.iter().copied().chain([MAP]);
    assert_eq!(found.len(), types::ALL.len() + 1);
    for (found, expected) in found.into_iter().zip(expected) {
        let DataTypeText { id, name, unit, format, shape, summary } = unwrap!(DataType, found);
        assert_eq!((id, name, summary), (expected.id, expected.name, expected.summary));
        assert_eq!((format, shape), (expected.format, expected.shape));
        assert_eq!(unit.rotary, expected.unit.symbol(AxisKind::Rotary));
    }
}

/// What a host has learnt about a device by asking.
struct Catalogue {
    modules: Vec<&'static str>,
    types: Vec<DataTypeText<'static>>,
}

impl Catalogue {
    fn learn(line: &mut Line) -> Self {
        let modules = line.list(|kind| Request::Module { kind });
        let types = line.list(|index| Request::DataType { index: index.into() });
        Self {
            modules: modules.into_iter().map(|module| unwrap!(Module, module).name).collect(),
            types: types.into_iter().map(|data_type| unwrap!(DataType, data_type)).collect(),
        }
    }

    fn module(&self, name: &str) -> ModuleRef {
        let kind = self.modules.iter().position(|known| *known == name).unwrap();
        ModuleRef { kind: u8::try_from(kind).unwrap(), number: 1 }
    }

    fn command(&self, row: &scheme::Row<'_>, line: &mut Line) -> Command {
        if row.word(1) == scheme::ENGINE {
            let (verb, _, needs_module) = Verb::ALL.iter().find(|(_, name, _)| *name == row.word(2)).unwrap();
            return if *needs_module {
                Command::engine(*verb, self.module(row.word(3)))
            } else {
                Command::plain(*verb)
            };
        }
        let module = self.module(row.word(1));
        let parameters = line.list(|index| Request::Parameter { kind: module.kind, index });
        let mut parameters = (0..).zip(parameters).map(|(index, found)| (index, unwrap!(Parameter, found)));
        let (index, parameter) = parameters.find(|(_, parameter)| parameter.name == row.word(2)).unwrap();
        Command::set(module, index, self.value(&parameter, row.word(3)))
    }

    fn value(&self, parameter: &ParameterText<'_>, word: &str) -> Value {
        match &parameter.accepts {
            Accepted::Real { .. } => Value::Real(word.parse().unwrap()),
            Accepted::Count { .. } => Value::Count(word.parse().unwrap()),
            Accepted::Flag => Value::Flag(word == "ON"),
            Accepted::Choice(names) => {
                let index = names.iter().position(|name| *name == word).unwrap();
                Value::Choice(u8::try_from(index).unwrap())
            }
            Accepted::Types => {
                let found = self.types.iter().find(|data_type| data_type.name == word).unwrap();
                Value::Type(TypeRef { id: found.id, number: 1 })
            }
        }
    }
}

#[test]
fn a_scheme_sent_row_by_row_leaves_the_controller_as_loading_it_does() {
    for side in SIDES {
        let mut line = Line::new();
        let catalogue = Catalogue::learn(&mut line);
        for row in scheme::rows(SCHEME).filter(|row| row.is_for(side, SIDES).unwrap()) {
            let command = catalogue.command(&row, &mut line);
            assert_eq!(line.command(command).refused, None, "line {} on the {side}", row.line());
        }
        let mut loaded = robot();
        assert_eq!(scheme::load(SCHEME, side, SIDES, &mut loaded, |error| panic!("{error:?}")), 0);
        assert_eq!(line.state(), format!("{loaded:?}"));
        let status = unwrap!(Status, line.ask(Request::Status));
        assert!(status.is_running);
        assert_eq!((status.blocked, status.usage), (None, loaded.engine().usage()));
        let instances = line.list(|index| Request::Instance { index });
        let names: Vec<_> = instances
            .into_iter()
            .map(|found| unwrap!(Instance, found))
            .map(|found| (catalogue.modules[usize::from(found.module.kind)], found.place.unwrap()))
            .collect();
        let order = ["COMM_RXMOD", "WTRANSF_MOD", "PDCTRL_MOD", "TIMEDELAY_MOD", "COMM_TXMOD"];
        assert_eq!(names, order.into_iter().zip(0..).collect::<Vec<_>>());
    }
}

#[test]
fn an_accepted_command_says_what_still_keeps_the_device_still() {
    let mut line = Line::new();
    let pd = module("PDCTRL_MOD");
    let effect = line.command(Command::engine(Verb::ModOn, pd));
    let wanted = Finding::NoProvider { signal: types::DES_POSITION.first(), reader: Party::Module(pd) };
    assert_eq!(effect, Effect { refused: None, blocked: Some(Blocked::Fault(wanted)), value: None });
    assert_eq!(line.ask(Request::Finding { index: 0 }), Response::Finding { finding: wanted, faults: 1 });
    assert_eq!(line.ask(Request::Finding { index: 1 }), Response::Refused(Refusal::NotThere));
    let effect = line.command(Command::plain(Verb::MatchingCheck));
    assert_eq!(effect.refused, Some(CommandError::DoesNotMatch { faults: 1 }));

    // Its own measured position will do for a desired one.
    line.command(Command::engine(Verb::ModOff, pd));
    let port = line.list(|index| Request::Port { module: pd, index });
    let port = port.into_iter().position(|found| unwrap!(Port, found).name == "DES_POSITION").unwrap();
    let bind = Command::bind(pd, u8::try_from(port).unwrap(), types::POSITION.first());
    assert_eq!(line.command(bind).value, Some(Value::Type(types::POSITION.first())));
    let effect = line.command(Command::engine(Verb::ModOn, pd));
    assert_eq!(effect, Effect { refused: None, blocked: Some(Blocked::Stopped), value: None });
    let effect = line.command(Command::plain(Verb::MatchingCheck));
    assert_eq!(effect, Effect { refused: None, blocked: None, value: None });

    line.tick(0.5);
    line.tick(f32::NAN);
    let reason = Blocked::Measurement(FrameError::NotFinite { signal: types::POSITION.first(), word: 0 });
    assert_eq!(line.command(Command::plain(Verb::Reset)).blocked, Some(reason));
    line.tick(0.5);
    assert_eq!(line.command(Command::plain(Verb::Reset)).blocked, None);
    let status = unwrap!(Status, line.ask(Request::Status));
    let first = status.first_fault.unwrap();
    assert_eq!((status.ticks, status.refused_ticks, first.tick, first.reason), (3, 1, 2, reason));
}

#[test]
fn a_refused_command_changes_nothing_and_shows_the_value_that_holds() {
    let mut line = Line::new();
    let pd = module("PDCTRL_MOD");
    let one_axis = |axis, value| Command { axis: Some(axis), ..Command::set(pd, 0, Value::Real(value)) };
    assert_eq!(line.command(Command::set(pd, 0, Value::Real(300.0))).value, Some(Value::Real(300.0)));
    assert_eq!(line.command(one_axis(1, 500.0)).value, Some(Value::Real(500.0)));
    assert_eq!(
        line.ask(Request::Get { module: pd, parameter: 0, axis: 0 }),
        Response::Value(Value::Real(300.0))
    );
    let before = line.state();
    for value in [f32::NAN, f32::INFINITY, -1.0] {
        let effect = line.command(one_axis(1, value));
        assert_eq!(effect.refused, Some(ParameterError::OutOfRange.into()));
        assert_eq!(effect.value, Some(Value::Real(500.0)));
    }
    let nobody = ModuleRef { kind: 200, number: 1 };
    for (command, error) in [
        (Command::engine(Verb::ModOn, nobody), CommandError::UnknownModule(nobody)),
        (Command::set(pd, 100, Value::Flag(true)), ParameterError::Unknown.into()),
        (Command::bind(pd, 100, types::POSITION.first()), CommandError::UnknownPort(100)),
        (Command { param: PORT, ..Command::set(pd, 0, Value::Flag(true)) }, CommandError::WrongValue),
        (
            Command { module: Target::Engine, ..Command::set(pd, 99, Value::Nothing) },
            CommandError::UnknownVerb(99),
        ),
    ] {
        assert_eq!(line.command(command).refused, Some(error));
    }
    let absent = line.ask(Request::Get { module: nobody, parameter: 0, axis: 0 });
    assert_eq!(absent, Response::Refused(Refusal::Engine(CommandError::NotPluggedIn(nobody))));
    assert_eq!(line.state(), before);
}

#[test]
fn signals_are_read_in_pieces_as_the_last_tick_left_them() {
    let mut line = Line::new();
    line.tick(0.25);
    let entries = line.list(|index| Request::Entry { index });
    let expected =
        [types::POSITION, MAP, types::DES_FORCE].map(|data_type| Response::Entry(data_type.first()));
    assert_eq!(entries, expected);
    let position = Request::Signal { signal: types::POSITION.first(), from: 0 };
    let position = unwrap!(Signal, line.ask(position));
    assert_eq!((position.format, position.unit.linear, position.words_in_all), (Format::F32, "m", 3));
    assert_eq!(position.words, [0.25_f32.to_bits(), 0, 0]);
    let mut words = Vec::new();
    for from in [0, 32] {
        let part = unwrap!(Signal, line.ask(Request::Signal { signal: MAP.first(), from }));
        assert_eq!(part.words_in_all, 40);
        assert!(part.words.len() <= MAX_SIGNAL_WORDS);
        words.extend(part.words.into_iter().map(f32::from_bits));
    }
    assert_eq!(words, (1..=40_u8).map(f32::from).collect::<Vec<_>>());
    let missing = TypeRef { number: 2, ..MAP.first() };
    for (signal, from) in [(MAP.first(), 41), (missing, 0)] {
        assert_eq!(line.ask(Request::Signal { signal, from }), Response::Refused(Refusal::NotThere));
    }
}

#[test]
fn a_scheme_is_told_command_by_command() {
    let mut line = Line::new();
    assert_eq!(scheme::load(SCHEME, "slave", SIDES, &mut line.dimsart, |error| panic!("{error:?}")), 0);
    let expected: Vec<Command> = line.dimsart.engine_mut().commands().collect();
    let mut found = Vec::new();
    for place in 0..=u8::MAX {
        let of_module = (0..=u16::MAX).map(|index| line.ask(Request::SchemeCommand { place, index }));
        let of_module: Vec<_> =
            of_module.take_while(|answer| *answer != Response::Refused(Refusal::NotThere)).collect();
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
    let mut line = Line::new();
    assert_eq!(line.ask(Request::Timing), Response::Refused(Refusal::NotThere));
    let mut timing = Timing::default();
    timing.count(true, false);
    timing.count(false, true);
    timing.measure(5, 30, 32);
    line.info.set_timing(timing);
    let report = TimingReport { ticks: 2, late: 1, overruns: 1, last_mean_max_cycles: Some([25; 3]) };
    assert_eq!(unwrap!(Timing, line.ask(Request::Timing)), report);
    let refused = Response::Refused(Refusal::Store(StoreError::NoStorage));
    assert_eq!(line.ask(Request::Schemes(SchemeAction::Save)), refused);
}

#[test]
fn eight_clients_on_one_line_get_their_own_answers() {
    const CLIENTS: u8 = 8;
    let mut line = Line::new();
    let requests =
        (1..=CLIENTS).flat_map(|client| (0..=u8::MAX).map(move |number| request_id(client, number)));
    let mut random = TestRng::deterministic_rng(RngAlgorithm::XorShift);
    let mut ids: Vec<u16> = requests.collect();
    for place in (1..ids.len()).rev() {
        ids.swap(place, usize::try_from(random.next_u64()).unwrap() % (place + 1));
    }
    let bytes: Vec<u8> = ids.iter().flat_map(|id| frame(Request::Identify, *id)).collect();
    let mut rest = bytes.as_slice();
    let mut answered = Vec::new();
    while !rest.is_empty() {
        let size = usize::try_from(random.next_u32() % 20).unwrap().clamp(1, rest.len());
        answered.extend(line.send(&rest[..size]).into_iter().map(|(id, _)| id));
        rest = &rest[size..];
    }
    assert_eq!(answered, ids);
}

/// Clients that write into each other's frames cost frames, and nothing else: what comes through is what was sent.
#[test]
fn eight_clients_that_cut_into_each_other_s_frames_lose_some_and_forge_none() {
    const CLIENTS: u8 = 8;
    const FRAMES: u8 = 200;
    let request = |client| Request::Get { module: module("PDCTRL_MOD"), parameter: client, axis: client };
    let mut waiting: Vec<Vec<u8>> = (1..=CLIENTS)
        .map(|client| {
            (0..FRAMES).flat_map(|number| frame(request(client), request_id(client, number))).collect()
        })
        .collect();
    let mut random = TestRng::deterministic_rng(RngAlgorithm::XorShift);
    let (mut receiver, mut taken) = (Receiver::new(), 0_u32);
    while waiting.iter().any(|bytes| !bytes.is_empty()) {
        let client = usize::try_from(random.next_u32()).unwrap() % waiting.len();
        let bytes = &mut waiting[client];
        let size = usize::try_from(random.next_u32() % 60).unwrap().min(bytes.len());
        let piece: Vec<u8> = bytes.drain(..size).collect();
        receiver.take_all(&piece, |content| {
            let (id, found) = decode_request(content).unwrap();
            assert_eq!(found, request(client_of(id)));
            taken += 1;
        });
    }
    let Counters { frames, damaged, .. } = receiver.counters();
    assert_eq!(frames, taken);
    assert!(frames > 400 && damaged > 100, "{frames} whole, {damaged} damaged");
    receiver.take_all(&frame(request(1), 7), |_| taken += 1);
    assert_eq!(taken, frames + 1, "the next whole frame is found");
}
