//! Responses.

use core::num::NonZeroU32;

use super::*;

#[test]
fn responses() {
    let unit = Unit::Position;
    let axes = [AxisKind::Linear, AxisKind::Rotary];
    let axes = heapless::Vec::<_, MAX_DOF>::from_slice(&axes).unwrap();
    let usage = Usage { modules: 1, slots: 2, words: 3, total_words: 2048 };
    let first_fault = Some(FirstFault { tick: 300, reason: NotCommandedReason::Tick(TickResult::Idle) });
    let parameter = |accepts| {
        let (name, default) = ("P", Some(Value::Count(1)));
        Response::Parameter(ParameterDescription {
            name,
            unit,
            accepts,
            entries: ParameterShape { rows: 0, columns: 3 },
            default,
            is_structural: false,
        })
    };
    let port = |direction, stage, bound| {
        Response::Port(PortDescription {
            name: "P",
            direction,
            stage,
            is_delayed: true,
            default: bound,
            bound,
        })
    };
    let timing = |last_mean_max_cycles| {
        Response::Timing(TimingReport { ticks: 300, late: 1, overruns: 2, last_mean_max_cycles })
    };
    let schemes =
        |origin, fallback, trial| Response::Schemes(SchemeStatus { origin, fallback, trial, is_saved: true });
    let refused = LoadError::Refused { command: 300, error: CommandError::TooManyPorts };
    let data_type =
        |format, shape| Response::DataType(DataTypeDescription { id: 300, name: "N", unit, format, shape });
    let responses = [
        Response::Refused(Refusal::NotFound),
        Response::Identity(Identity {
            protocol_version: 1,
            device: "arm",
            image: "x",
            axes,
            sample_period_s: 0.5,
        }),
        Response::Module(ModuleDescription { name: "M" }),
        parameter(ParameterTypeDescription::Real { min: 0.0, max: 1.0 }),
        parameter(ParameterTypeDescription::Count { min: 0, max: 300 }),
        parameter(ParameterTypeDescription::Flag),
        parameter(ParameterTypeDescription::Choice(heapless::Vec::from_slice(&["A", "BC"]).unwrap())),
        parameter(ParameterTypeDescription::Types),
        parameter(ParameterTypeDescription::Integer { min: -1, max: 300 }),
        port(Direction::Read, Stage::Early, Some(SIGNAL)),
        port(Direction::Write, Stage::Late, Some(SIGNAL)),
        port(Direction::Memory(300), Stage::Early, None),
        data_type(Format::F32, Shape::Scalar),
        data_type(Format::I32, Shape::Vector),
        data_type(Format::U32, Shape::Matrix(2, 3)),
        data_type(Format::Bool, Shape::Scalar),
        data_type(Format::Bool, Shape::Square),
        Response::Instance(InstanceDescription { module: MODULE, place: Some(0) }),
        Response::Entry(SIGNAL),
        Response::Effect(Effect {
            refused: None,
            blocked: Some(NotCommandedReason::Tick(TickResult::Idle)),
            value: Some(Value::Real(1.0)),
            is_in_transaction: true,
        }),
        Response::Value(Value::Choice(2)),
        Response::Value(Value::Integer(-2)),
        Response::Signal(SignalWords {
            format: Format::F32,
            unit,
            total_words: 2,
            words: heapless::Vec::from_slice(&[0, 0x3F80_0000]).unwrap(),
        }),
        Response::Finding { finding: FINDING, faults: 1 },
        Response::Status(Status {
            ticks: 300,
            refused_ticks: 1,
            is_running: false,
            blocked: Some(NotCommandedReason::Tick(TickResult::Idle)),
            first_fault,
            usage,
            is_in_transaction: true,
            state: DriveState::Fault,
            module_fault: Some(MODULE_FAULT),
        }),
        Response::SchemeCommand(Command::Stop),
        timing(Some([1, 2, 300])),
        timing(None),
        schemes(Origin::Empty, None, Trial::None),
        schemes(Origin::BuiltIn, Some(Fallback::Storage), Trial::Pending),
        schemes(Origin::Saved, Some(Fallback::Unconfirmed), Trial::Tried),
        schemes(Origin::Trial, Some(Fallback::Trial(LoadError::Damaged)), Trial::Tried),
        schemes(Origin::BuiltIn, Some(Fallback::Saved(LoadError::Version { found: 9 })), Trial::None),
        schemes(Origin::BuiltIn, Some(Fallback::Saved(LoadError::IncompatibleImage)), Trial::None),
        schemes(Origin::Empty, Some(Fallback::BuiltIn(refused)), Trial::None),
        schemes(Origin::Saved, Some(Fallback::Damaged), Trial::None),
        schemes(Origin::Saved, Some(Fallback::NotRecorded), Trial::Pending),
        Response::Lease(LeaseStatus { holder: 3, ticks_left: 300 }),
        Response::Telemetry { words: 9 },
        Response::Cycles(CyclesReport { runs: 300, min: 1, mean: 2, max: 300, per_1024_instructions: 0 }),
        Response::Safety(SafetyReport {
            reason: 16,
            ticks: heapless::Vec::from_slice(&[(16, 300), (96, 1)]).unwrap(),
        }),
        Response::Event(Event {
            number: 300,
            tick: 9,
            what: 40,
            module: Some(MODULE),
            signal: Some(SIGNAL),
            word: 2,
            detail: 300,
        }),
        Response::DeviceType { signal: SIGNAL, is_taken: true },
        Response::Bound(BoundReport { cycles: 300, limit_cycles: NonZeroU32::new(2) }),
        Response::Bound(BoundReport { cycles: 300, limit_cycles: None }),
        Response::Motor(MotorReport {
            layout: 300,
            is_stored: true,
            fallback: None,
            is_restart_pending: true,
            words: MotorWords::from_slice(&[1, 300]).unwrap(),
        }),
        Response::Motor(MotorReport { fallback: Some(MotorFallback::Value), ..MotorReport::default() }),
        Response::Motor(MotorReport { fallback: Some(MotorFallback::Damaged), ..MotorReport::default() }),
        Response::Identification(Identification::None),
        Response::Identification(Identification::Running),
        Response::Identification(Identification::Found(IdentifiedMotor {
            resistance_ohm: 1.0,
            direct_inductance_h: 2.0,
            quadrature_inductance_h: 2.0,
            pole_pairs: 7,
            is_encoder_reversed: true,
            encoder_offset_rad: -2.0,
        })),
        Response::Identification(Identification::Failed(IdentificationFailure::Ended)),
        Response::Identification(Identification::Failed(IdentificationFailure::DidNotMove)),
        Response::Identification(Identification::Failed(IdentificationFailure::Drive(57))),
        Response::Identification(Identification::Failed(IdentificationFailure::TooLittleCurrent(300))),
        Response::Refused(Refusal::Motor(MotorRefusal::InUse)),
        Response::Refused(Refusal::Motor(MotorRefusal::Invalid(MotorFallback::Layout))),
        Response::Law(LawReport { words: 90, is_used: true, cycles: Some(300) }),
        Response::Law(LawReport::default()),
        Response::Restarts,
    ];
    let expected = [
        "00 01",
        "01 01 03 61 72 6d 01 78 02 00 01 00 00 00 3f",
        "02 01 4d",
        "03 01 50 02 00 00 00 00 00 00 00 80 3f 00 03 01 01 01 00",
        "03 01 50 02 01 00 ac 02 00 03 01 01 01 00",
        "03 01 50 02 03 00 03 01 01 01 00",
        "03 01 50 02 04 02 01 41 02 42 43 00 03 01 01 01 00",
        "03 01 50 02 05 00 03 01 01 01 00",
        "03 01 50 02 02 01 d8 04 00 03 01 01 01 00",
        "04 01 50 00 00 01 01 ac 02 01 01 ac 02 01",
        "04 01 50 01 01 01 01 ac 02 01 01 ac 02 01",
        "04 01 50 02 ac 02 00 01 00 00",
        "05 ac 02 01 4e 02 00 00",
        "05 ac 02 01 4e 02 01 01",
        "05 ac 02 01 4e 02 02 02 02 03",
        "05 ac 02 01 4e 02 03 00",
        "05 ac 02 01 4e 02 03 03",
        "06 64 55 02 01 00",
        "07 ac 02 01",
        "08 00 01 01 01 01 00 00 00 80 3f 01",
        "09 03 02",
        "09 05 03",
        "0a 00 02 02 02 00 80 80 80 fc 03",
        "0b 00 ac 02 01 00 01",
        "0c ac 02 01 00 01 01 01 01 ac 02 01 01 01 02 03 80 10 01 07 01 64 55 02 00 ac 02 01 02 80 80 80 fc 07",
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
        "0f 02 01 05 00 01",
        "0f 02 01 06 01 01",
        "10 03 ac 02",
        "11 09",
        "13 ac 02 01 02 ac 02 00",
        "14 10 02 10 ac 02 60 01",
        "15 ac 02 09 28 01 64 55 02 01 ac 02 01 02 ac 02",
        "16 ac 02 01 01",
        "17 ac 02 01 02",
        "17 ac 02 00",
        "18 ac 02 01 00 01 02 01 ac 02",
        "18 00 00 01 02 00 00",
        "18 00 00 01 03 00 00",
        "19 00",
        "19 01",
        "19 02 00 00 80 3f 00 00 00 40 00 00 00 40 07 01 00 00 00 c0",
        "19 03 00",
        "19 03 03",
        "19 03 05 39",
        "19 03 06 ac 02",
        "00 09 00",
        "00 09 02 01",
        "1a 5a 01 01 ac 02",
        "1a 00 00 00",
        "1b",
    ];
    assert_bytes(&responses, &expected);
}
