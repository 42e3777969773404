//! The bytes of every variant that travels. Whoever changes one breaks every device in the field: new
//! variants go to the end of their enum, and `PROTOCOL_VERSION` counts up.

use core::fmt::Debug;
use std::format;
use std::string::String;
use std::vec::Vec;

use serde::{Deserialize, Serialize};

use super::frame::{decode, encode};
use super::*;
use crate::envelope::Class;
use crate::limits::MAX_DOF;
use crate::saved_scheme::LoadError;
use crate::*;

const MODULE: ModuleRef = ModuleRef { kind: 3, number: 2 };
const SIGNAL: TypeRef = TypeRef { id: 300, number: 1 };
const FINDING: Finding = Finding::NoProvider { signal: SIGNAL, reader: Party::Frame };

/// Sends a value through a frame, sees that it comes out again, and gives its payload.
fn round_trip<T: Serialize + Deserialize<'static> + PartialEq + Debug>(value: &T) -> String {
    let mut frame = [0; MAX_FRAME_BYTES];
    let length = encode(Class::Response, 7, value, &mut frame).ok().unwrap();
    let mut receiver = Receiver::new();
    let mut contents = Vec::new();
    receiver.take_all(&frame[..length], |content| contents.push(content.to_vec()));
    // Leaked, so that the texts in the value may be borrowed from it.
    let content = contents.pop().unwrap().leak();
    let (id, decoded) = decode::<T>(Class::Response, content).unwrap();
    assert_eq!((id, &decoded), (7, value));
    let payload: Vec<_> = content[3..].iter().map(|byte| format!("{byte:02x}")).collect();
    payload.join(" ")
}

#[track_caller]
fn assert_bytes<T: Serialize + Deserialize<'static> + PartialEq + Debug>(values: &[T], expected: &[&str]) {
    assert_eq!(values.iter().map(round_trip).collect::<Vec<_>>(), expected);
}

#[test]
fn requests() {
    assert_eq!(PROTOCOL_VERSION, 5);
    let requests = [
        Request::Identify,
        Request::Module { kind: 3 },
        Request::Parameter { kind: 3, index: 4 },
        Request::Port { module: MODULE, index: 4 },
        Request::DataType { index: 200 },
        Request::Instance { index: 5 },
        Request::Entry { index: 6 },
        Request::Command(Command::PlugIn(MODULE)),
        Request::Get { module: MODULE, parameter: 4, axis: 1 },
        Request::Signal { signal: SIGNAL, from: 7 },
        Request::Finding { index: 8 },
        Request::Status,
        Request::SchemeCommand { place: 1, index: 300 },
        Request::Timing,
        Request::Schemes(SchemeAction::Look),
        Request::Schemes(SchemeAction::Save),
        Request::Schemes(SchemeAction::Confirm),
        Request::Schemes(SchemeAction::RollBack),
        Request::Lease(LeaseAction::Look),
        Request::Lease(LeaseAction::Take),
        Request::Lease(LeaseAction::Renew),
        Request::Lease(LeaseAction::GiveBack),
        Request::Telemetry { place: 1, signal: SIGNAL, every_ticks: 300 },
        Request::Cycles { place: 1, begins_anew: true },
        Request::Safety,
    ];
    let expected = [
        "00",
        "01 03",
        "02 03 04",
        "03 03 02 04",
        "04 c8 01",
        "05 05",
        "06 06",
        "07 00 01 00 05 03 02",
        "08 03 02 04 01",
        "09 ac 02 01 07",
        "0a 08",
        "0b",
        "0c 01 ac 02",
        "0d",
        "0e 00",
        "0e 01",
        "0e 02",
        "0e 03",
        "0f 00",
        "0f 01",
        "0f 02",
        "0f 03",
        "10 01 ac 02 01 ac 02",
        "12 01 01",
        "13",
    ];
    assert_bytes(&requests, &expected);
}

#[test]
fn commands() {
    let set = |value| Command::Set { module: MODULE, parameter: 4, axis: Some(1), value };
    let commands = [
        Command::Stop,
        set(Value::Real(1.5)),
        set(Value::Count(300)),
        set(Value::Flag(true)),
        set(Value::Choice(2)),
        set(Value::Type(SIGNAL)),
        Command::PlugIn(MODULE),
        Command::bind(MODULE, 4, SIGNAL),
    ];
    let expected = [
        "00 11 00 06",
        "01 03 02 04 01 01 00 00 00 c0 3f",
        "01 03 02 04 01 01 01 ac 02",
        "01 03 02 04 01 01 02 01",
        "01 03 02 04 01 01 03 02",
        "01 03 02 04 01 01 04 ac 02 01",
        "00 01 00 05 03 02",
        "01 03 02 84 00 04 ac 02 01",
    ];
    assert_bytes(&commands, &expected);
    let numbers = EngineCommand::ALL.iter().map(|known| {
        let command = known.with(known.needs_module.then_some(MODULE)).unwrap();
        let mut buffer = [0; MAX_FRAME_BYTES];
        format!("{} {}", postcard::to_slice(&command, &mut buffer).unwrap()[1], known.name)
    });
    let numbers: Vec<_> = numbers.collect();
    let expected = [
        "1 MOD_ON",
        "2 MOD_OFF",
        "3 PLACE_BEFORE",
        "4 MOD_RESET",
        "5 MOD_INIT",
        "6 MOD_CLOSE",
        "16 MATCHING_CHECK",
        "17 STOP",
        "18 RESET",
        "19 CLOSE",
        "20 INIT",
    ];
    assert_eq!(numbers, expected);
}

#[test]
fn refusals() {
    let mut errors = Vec::from([
        CommandError::UnknownModule(MODULE),
        CommandError::UnknownVerb(9),
        CommandError::UnknownPort(9),
        CommandError::UnknownType(SIGNAL),
        CommandError::WrongValue,
        CommandError::TooManyModules,
        CommandError::TooManyPorts,
        CommandError::PluggedIn(MODULE),
        CommandError::NotPluggedIn(MODULE),
        CommandError::Storage(StorageError::NoSlot),
        CommandError::Storage(StorageError::NoRoom { wanted: 300, free: 9 }),
    ]);
    errors.extend(
        [
            ParameterError::Unknown,
            ParameterError::WrongKind,
            ParameterError::OutOfRange,
            ParameterError::ListFull,
            ParameterError::NoSuchAxis,
            ParameterError::WhilePluggedIn,
            ParameterError::NeedsCounters,
        ]
        .map(CommandError::Parameter),
    );
    errors.extend([
        CommandError::WouldBreak(FINDING),
        CommandError::DoesNotMatch { faults: 2 },
        CommandError::TooSlow { module: MODULE, cycles: 300, tick_cycles: 9, limit_cycles: 8 },
        CommandError::CostUnknown(MODULE),
    ]);
    let expected = [
        "00 03 02",
        "01 09",
        "02 09",
        "03 ac 02 01",
        "04",
        "05",
        "06",
        "07 03 02",
        "08 03 02",
        "09 00",
        "09 01 ac 02 09",
        "0a 00",
        "0a 01",
        "0a 02",
        "0a 03",
        "0a 04",
        "0a 05",
        "0a 06",
        "0b 00 ac 02 01 00",
        "0c 02",
        "0d 03 02 ac 02 09 08",
        "0e 03 02",
    ];
    assert_bytes(&errors, &expected);
    let refusals = [
        Refusal::NotUnderstood,
        Refusal::NotThere,
        Refusal::TooLong,
        Refusal::Engine(CommandError::WrongValue),
        Refusal::Store(StoreError::NoStorage),
        Refusal::Store(StoreError::SchemeRuns),
        Refusal::Store(StoreError::TooLong),
        Refusal::Store(StoreError::NotTried),
        Refusal::Store(StoreError::Storage),
        Refusal::Lease { holder: 3 },
        Refusal::Telemetry { client: 3 },
    ];
    let expected = ["00", "01", "02", "03 04", "04 00", "04 01", "04 02", "04 03", "04 04", "05 03", "06 03"];
    assert_bytes(&refusals, &expected);
}

#[cfg(feature = "auth")]
#[test]
fn keys() {
    let bytes = core::array::from_fn(|index| u8::try_from(index).unwrap());
    let requests = [
        Request::Key(KeyAction::Look),
        Request::Key(KeyAction::Set { key: KeyBytes(bytes), salt: 300 }),
        Request::Key(KeyAction::Clear),
    ];
    let expected = ["11 00", "11 01 00 01 02 03 04 05 06 07 08 09 0a 0b 0c 0d 0e 0f ac 02", "11 02"];
    assert_bytes(&requests, &expected);
    let states = [KeyState::Open, KeyState::Locked, KeyState::Damaged].map(Response::Key);
    assert_bytes(&states, &["12 00", "12 01", "12 02"]);
    let refusals = [KeyRefusal::Locked, KeyRefusal::Damaged, KeyRefusal::NotAccepted, KeyRefusal::InUse]
        .map(Refusal::Key);
    assert_bytes(&refusals, &["07 00", "07 01", "07 02", "07 03"]);
}

/// Requests about keys are not understood, and what follows them in later versions keeps its number.
#[cfg(not(feature = "auth"))]
#[test]
fn keys() {
    for payload in [(17_u8, 0_u8), (17, 2)] {
        let mut frame = [0; MAX_FRAME_BYTES];
        let length = encode(Class::Request, 7, &payload, &mut frame).ok().unwrap();
        let mut decoded = Vec::new();
        Receiver::new().take_all(&frame[..length], |content| decoded.push(decode_request(content)));
        assert_eq!(decoded, [Err(DecodeError::NotUnderstood { id: 7 })]);
    }
}

#[test]
fn reasons() {
    let (first, second) = (Party::Frame, Party::Module(MODULE));
    let mismatch = |difference| Finding::Mismatch { module: MODULE, port: 4, signal: SIGNAL, difference };
    let not_finite = FrameError::NotFinite { signal: SIGNAL, word: 2 };
    let reasons = [
        Blocked::Fault(FINDING),
        Blocked::Fault(Finding::TwoProviders { signal: SIGNAL, first, second }),
        Blocked::Fault(mismatch(Difference::Unit)),
        Blocked::Fault(mismatch(Difference::Format)),
        Blocked::Fault(mismatch(Difference::Shape)),
        Blocked::Fault(Finding::Delay { signal: SIGNAL, writer: first, reader: second, is_declared: true }),
        Blocked::Fault(Finding::UnitsDiffer {
            module: MODULE,
            port: 1,
            signal: SIGNAL,
            other_port: 0,
            other_signal: SIGNAL,
            relation: UnitRelation::Integral,
        }),
        Blocked::Fault(Finding::LinkTaken { link: 1, first: MODULE, second: MODULE }),
        Blocked::Stopped,
        Blocked::Measurement(FrameError::Length { expected: 3, found: 2 }),
        Blocked::Command(not_finite),
        Blocked::Disarmed,
        Blocked::LinkLost { link: 1 },
    ];
    let expected = [
        "00 00 ac 02 01 00",
        "00 01 ac 02 01 00 01 03 02",
        "00 02 03 02 04 ac 02 01 00",
        "00 02 03 02 04 ac 02 01 01",
        "00 02 03 02 04 ac 02 01 02",
        "00 03 ac 02 01 00 01 03 02 01",
        "00 04 03 02 01 ac 02 01 00 ac 02 01 01",
        "00 05 01 03 02 03 02",
        "01",
        "02 00 03 02",
        "03 01 ac 02 01 02",
        "04",
        "05 01",
    ];
    assert_bytes(&reasons, &expected);
}

#[test]
fn responses() {
    let unit = UnitText { linear: "m", rotary: "rad" };
    let axes = [AxisKind::Linear, AxisKind::Rotary];
    let axes = heapless::Vec::<_, MAX_DOF>::from_slice(&axes).unwrap();
    let usage = Usage { modules: 1, slots: 2, words: 3, words_in_all: 2048 };
    let first_fault = Some(FirstFault { tick: 300, reason: Blocked::Stopped });
    let parameter = |accepts| {
        let (name, default, summary) = ("P", Some(Value::Count(1)), "S");
        Response::Parameter(ParameterText { name, unit, accepts, default, is_structural: true, summary })
    };
    let port = |direction, stage, bound| {
        Response::Port(PortText { name: "P", direction, stage, is_delayed: true, default: bound, bound })
    };
    let timing = |last_mean_max_cycles| {
        Response::Timing(TimingReport { ticks: 300, late: 1, overruns: 2, last_mean_max_cycles })
    };
    let schemes =
        |origin, fallback, trial| Response::Schemes(SchemeStatus { origin, fallback, trial, is_saved: true });
    let refused = LoadError::Refused { command: 300, error: CommandError::WrongValue };
    let data_type = |format, shape| {
        Response::DataType(DataTypeText { id: 300, name: "N", unit, format, shape, summary: "S" })
    };
    let responses = [
        Response::Refused(Refusal::NotThere),
        Response::Identity(Identity {
            protocol_version: 1,
            device: "arm",
            image: "x",
            axes,
            sample_period_s: 0.5,
        }),
        Response::Module(ModuleText { name: "M", summary: "S" }),
        parameter(Accepted::Real { min: 0.0, max: 1.0, per_axis: true }),
        parameter(Accepted::Count { min: 0, max: 300 }),
        parameter(Accepted::Flag),
        parameter(Accepted::Choice(heapless::Vec::from_slice(&["A", "BC"]).unwrap())),
        parameter(Accepted::Types),
        port(Direction::Read, Stage::Early, Some(SIGNAL)),
        port(Direction::Write, Stage::Late, Some(SIGNAL)),
        port(Direction::Memory(300), Stage::Early, None),
        data_type(Format::F32, Shape::Scalar),
        data_type(Format::I32, Shape::Vector),
        data_type(Format::U32, Shape::Matrix(2, 3)),
        data_type(Format::Bool, Shape::Scalar),
        Response::Instance(InstanceText { module: MODULE, place: Some(0) }),
        Response::Entry(SIGNAL),
        Response::Effect(Effect {
            refused: None,
            blocked: Some(Blocked::Stopped),
            value: Some(Value::Real(1.0)),
        }),
        Response::Value(Value::Choice(2)),
        Response::Signal(SignalText {
            format: Format::F32,
            unit,
            words_in_all: 2,
            words: heapless::Vec::from_slice(&[0, 0x3F80_0000]).unwrap(),
        }),
        Response::Finding { finding: FINDING, faults: 1 },
        Response::Status(Status {
            ticks: 300,
            refused_ticks: 1,
            is_running: false,
            blocked: Some(Blocked::Stopped),
            first_fault,
            usage,
        }),
        Response::SchemeCommand(Command::Stop),
        timing(Some([1, 2, 300])),
        timing(None),
        schemes(Origin::Empty, None, Trial::None),
        schemes(Origin::BuiltIn, Some(Fallback::Storage), Trial::Waits),
        schemes(Origin::Saved, Some(Fallback::Unconfirmed), Trial::Tried),
        schemes(Origin::Trial, Some(Fallback::Trial(LoadError::Damaged)), Trial::Tried),
        schemes(Origin::BuiltIn, Some(Fallback::Saved(LoadError::Version { found: 9 })), Trial::None),
        schemes(Origin::BuiltIn, Some(Fallback::Saved(LoadError::OtherImage)), Trial::None),
        schemes(Origin::Empty, Some(Fallback::BuiltIn(refused)), Trial::None),
        Response::Lease(LeaseStatus { holder: 3, ticks_left: 300 }),
        Response::Telemetry { words: 9 },
        Response::Cycles(CyclesReport {
            runs: 300,
            least: 1,
            mean: 2,
            greatest: 300,
            per_1024_instructions: 0,
        }),
        Response::Safety(SafetyReport {
            reason: 16,
            ticks: heapless::Vec::from_slice(&[(16, 300), (96, 1)]).unwrap(),
        }),
    ];
    let expected = [
        "00 01",
        "01 01 03 61 72 6d 01 78 02 00 01 00 00 00 3f",
        "02 01 4d 01 53",
        "03 01 50 01 6d 03 72 61 64 00 00 00 00 00 00 00 80 3f 01 01 01 01 01 01 53",
        "03 01 50 01 6d 03 72 61 64 01 00 ac 02 01 01 01 01 01 53",
        "03 01 50 01 6d 03 72 61 64 02 01 01 01 01 01 53",
        "03 01 50 01 6d 03 72 61 64 03 02 01 41 02 42 43 01 01 01 01 01 53",
        "03 01 50 01 6d 03 72 61 64 04 01 01 01 01 01 53",
        "04 01 50 00 00 01 01 ac 02 01 01 ac 02 01",
        "04 01 50 01 01 01 01 ac 02 01 01 ac 02 01",
        "04 01 50 02 ac 02 00 01 00 00",
        "05 ac 02 01 4e 01 6d 03 72 61 64 00 00 01 53",
        "05 ac 02 01 4e 01 6d 03 72 61 64 01 01 01 53",
        "05 ac 02 01 4e 01 6d 03 72 61 64 02 02 02 03 01 53",
        "05 ac 02 01 4e 01 6d 03 72 61 64 03 00 01 53",
        "06 03 02 01 00",
        "07 ac 02 01",
        "08 00 01 01 01 00 00 00 80 3f",
        "09 03 02",
        "0a 00 01 6d 03 72 61 64 02 02 00 80 80 80 fc 03",
        "0b 00 ac 02 01 00 01",
        "0c ac 02 01 00 01 01 01 ac 02 01 01 02 03 80 10",
        "0d 00 11 00 06",
        "0e ac 02 01 02 01 01 02 ac 02",
        "0e ac 02 01 02 00",
        "0f 00 00 00 01",
        "0f 01 01 00 01 01",
        "0f 02 01 01 02 01",
        "0f 03 01 02 00 02 01",
        "0f 01 01 03 01 09 00 01",
        "0f 01 01 03 02 00 01",
        "0f 00 01 04 03 ac 02 04 00 01",
        "10 03 ac 02",
        "11 09",
        "13 ac 02 01 02 ac 02 00",
        "14 10 02 10 ac 02 60 01",
    ];
    assert_bytes(&responses, &expected);
}

/// The content without its CRC.
fn content(frame: &[u8]) -> Vec<u8> {
    let (mut receiver, mut contents) = (Receiver::new(), Vec::new());
    receiver.take_all(frame, |content| contents.push(content.to_vec()));
    contents.pop().unwrap()
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(" ")
}

#[test]
fn heartbeats() {
    let lease = LeaseStatus { holder: 3, ticks_left: 199 };
    let first_fault = Some(FirstFault { tick: 300, reason: Blocked::Stopped });
    let heartbeat =
        |blocked, first_fault| Heartbeat { ticks: 300, blocked, first_fault, lease, dropped: 1, damaged: 2 };
    for (heartbeat, expected) in [
        (heartbeat(None, None), "05 07 00 ac 02 00 00 03 c7 01 01 02"),
        (heartbeat(Some(Blocked::Disarmed), first_fault), "05 07 00 ac 02 01 04 01 ac 02 01 03 c7 01 01 02"),
    ] {
        let content = content(encode_heartbeat(&heartbeat, 7, &mut [0; MAX_FRAME_BYTES]).unwrap());
        assert_eq!(hex(&content), expected);
        assert_eq!(decode_heartbeat(&content), Ok((7, heartbeat)));
        assert_eq!(decode_response(&content), Err(DecodeError::OtherClass));
    }
}

#[test]
fn samples() {
    let words = heapless::Vec::from_slice(&[0x3F80_0000, 1]).unwrap();
    let sample = Sample { counter: 258, id: request_id(3, 4), tick: 300, words };
    let content = content(encode_sample(&sample, &mut [0; MAX_FRAME_BYTES]).unwrap());
    assert_eq!(hex(&content), "04 02 01 04 03 2c 01 00 00 00 00 80 3f 01 00 00 00");
    assert_eq!(decode_sample(&content), Ok(sample));
    assert_eq!(decode_sample(&content[..11]), Err(DecodeError::NotUnderstood { id: 258 }));
    assert_eq!(decode_heartbeat(&content), Err(DecodeError::OtherClass));
}
