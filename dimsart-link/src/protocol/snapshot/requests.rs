//! Requests and commands.

use super::*;

#[test]
fn requests() {
    assert_eq!(PROTOCOL_VERSION, 17);
    let requests = [
        Request::Identify,
        Request::Module { place: 3 },
        Request::Parameter { kind: MODULE.kind, index: 4 },
        Request::Port { module: MODULE, index: 4 },
        Request::DataType { index: 200 },
        Request::Instance { index: 5 },
        Request::Entry { index: 6 },
        Request::Command(Command::PlugIn(MODULE)),
        Request::Get { module: MODULE, parameter: 4, entry: 1 },
        Request::Signal { signal: SIGNAL, from: 7 },
        Request::Finding { index: 8 },
        Request::Status,
        Request::SchemeCommand { place: 1, index: 300 },
        Request::Timing,
        Request::Schemes(SchemeAction::Read),
        Request::Schemes(SchemeAction::Save),
        Request::Schemes(SchemeAction::Confirm),
        Request::Schemes(SchemeAction::RollBack),
        Request::Lease(LeaseAction::Read),
        Request::Lease(LeaseAction::Take),
        Request::Lease(LeaseAction::Renew),
        Request::Lease(LeaseAction::Release),
        Request::Telemetry { place: 1, signal: SIGNAL, every_ticks: 300 },
        Request::Cycles { place: 1, clears: true },
        Request::Safety,
        Request::Memory { module: MODULE, port: 4, from: 300 },
        Request::Event { back: 3 },
        Request::DeviceType { index: 9 },
        Request::Bound,
        Request::Motor(MotorAction::Read),
        Request::Motor(MotorAction::PutWord { place: 3, word: 300 }),
        Request::Motor(MotorAction::Store { layout: 300, count: 25, checksum: 300 }),
        Request::Motor(MotorAction::Delete),
        Request::Motor(MotorAction::Identify { current_a: 2.0 }),
        Request::Motor(MotorAction::ReadIdentification),
        Request::Law(LawAction::Status { number: 3 }),
        Request::Law(LawAction::Read { number: 3, from: 32 }),
        Request::Restart,
    ];
    let expected = [
        "00",
        "01 03",
        "02 64 55 04",
        "03 64 55 02 04",
        "04 c8 01",
        "05 05",
        "06 06",
        "07 00 01 00 05 64 55 02",
        "08 64 55 02 04 01",
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
        "14 64 55 02 04 ac 02",
        "15 03",
        "16 09",
        "17",
        "18 00",
        "18 01 03 ac 02",
        "18 02 ac 02 19 ac 02",
        "18 03",
        "18 04 00 00 00 40",
        "18 05",
        "19 00 03",
        "19 01 03 20",
        "1a",
    ];
    assert_bytes(&requests, &expected);
}

#[test]
fn commands() {
    let set = |value| Command::Set { module: MODULE, parameter: 4, entry: Some(1), value };
    let commands = [
        Command::Stop,
        set(Value::Real(1.5)),
        set(Value::Count(300)),
        set(Value::Flag(true)),
        set(Value::Choice(2)),
        set(Value::Type(SIGNAL)),
        set(Value::Integer(-2)),
        Command::PlugIn(MODULE),
        Command::bind(MODULE, 4, SIGNAL),
        Command::UploadLaw { place: 2, words: [300, u32::MAX] },
        Command::StoreLaw { number: 3, count: 90 },
        Command::RemoveLaw { number: 3 },
    ];
    let expected = [
        "00 11 00 06",
        "01 64 55 02 04 01 01 00 00 00 c0 3f",
        "01 64 55 02 04 01 01 01 ac 02",
        "01 64 55 02 04 01 01 02 01",
        "01 64 55 02 04 01 01 03 02",
        "01 64 55 02 04 01 01 04 ac 02 01",
        "01 64 55 02 04 01 01 07 03",
        "00 01 00 05 64 55 02",
        "01 64 55 02 84 00 04 ac 02 01",
        "00 20 01 02 08 ac 02 ff ff ff ff 0f",
        "00 21 01 03 01 5a",
        "00 22 01 03 06",
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
        "21 BEGIN",
        "22 COMMIT",
        "23 ABORT",
    ];
    assert_eq!(numbers, expected);
}
