//! Refusals, and reasons why the device gets no commands.

use super::*;

#[test]
fn refusals() {
    let mut errors = Vec::from([
        CommandError::UnknownModule(MODULE),
        CommandError::UnknownPort(9),
        CommandError::UnknownType(SIGNAL),
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
            ParameterError::NoSuchEntry,
            ParameterError::WhilePluggedIn,
            ParameterError::NeedsCounters,
            ParameterError::Imprecise { percent: 300 },
        ]
        .map(CommandError::Parameter),
    );
    errors.extend([
        CommandError::WouldBreak(FINDING),
        CommandError::HasFaults { faults: 2 },
        CommandError::TooSlow { module: MODULE, cycles: 300, tick_cycles: 9, limit_cycles: 8 },
        CommandError::CostUnknown(MODULE),
        CommandError::TooManyWires,
        CommandError::PacketTooLong { words: 300 },
        CommandError::TransactionOpen,
        CommandError::NoTransaction,
        CommandError::StillStopping,
        CommandError::RunsEveryTick(MODULE),
        CommandError::NoLaw(MODULE),
        CommandError::Law(LawRefusal::Program(ProgramError::Damaged)),
        CommandError::Law(LawRefusal::Program(ProgramError::Register { at: 7 })),
        CommandError::Law(LawRefusal::InUse),
        CommandError::Law(LawRefusal::NoSuchNumber),
    ]);
    let expected = [
        "00 64 55 02",
        "01 09",
        "02 ac 02 01",
        "03",
        "04",
        "05 64 55 02",
        "06 64 55 02",
        "07 00",
        "07 01 ac 02 09",
        "08 00",
        "08 01",
        "08 02",
        "08 03",
        "08 04",
        "08 05",
        "08 06",
        "08 07 ac 02",
        "09 00 ac 02 01 00",
        "0a 02",
        "0b 64 55 02 ac 02 09 08",
        "0c 64 55 02",
        "0d",
        "0e ac 02",
        "0f",
        "10",
        "11",
        "12 64 55 02",
        "13 64 55 02",
        "14 00 00",
        "14 00 07 07",
        "14 01",
        "14 02",
    ];
    assert_bytes(&errors, &expected);
    let refusals = [
        Refusal::NotUnderstood,
        Refusal::NotThere,
        Refusal::TooLong,
        Refusal::Engine(CommandError::TooManyPorts),
        Refusal::Store(StoreError::NoStorage),
        Refusal::Store(StoreError::SchemeRuns),
        Refusal::Store(StoreError::TooLong),
        Refusal::Store(StoreError::NoTrial),
        Refusal::Store(StoreError::Storage),
        Refusal::Lease { holder: 3 },
        Refusal::Telemetry { client: 3 },
        Refusal::Fault(40),
    ];
    let expected =
        ["00", "01", "02", "03 04", "04 00", "04 01", "04 02", "04 03", "04 04", "05 03", "06 03", "08 28"];
    assert_bytes(&refusals, &expected);
}

#[test]
fn reasons() {
    let (first, second) = (Party::Frame, Party::Module(MODULE));
    let mismatch = |difference| Finding::Mismatch { module: MODULE, port: 4, signal: SIGNAL, difference };
    let not_finite = FrameError::NotFinite { signal: SIGNAL, word: 2 };
    let reasons = [
        Blocked::Mismatch(FINDING),
        Blocked::Mismatch(Finding::TwoProviders { signal: SIGNAL, first, second }),
        Blocked::Mismatch(mismatch(Difference::Unit)),
        Blocked::Mismatch(mismatch(Difference::Format)),
        Blocked::Mismatch(mismatch(Difference::Shape)),
        Blocked::Mismatch(mismatch(Difference::Coordinates)),
        Blocked::Mismatch(Finding::Delay {
            signal: SIGNAL,
            writer: first,
            reader: second,
            is_declared: true,
        }),
        Blocked::Mismatch(Finding::UnitsDiffer {
            module: MODULE,
            port: 1,
            signal: SIGNAL,
            other_port: 0,
            other_signal: SIGNAL,
            relation: UnitRelation::Integral,
        }),
        Blocked::Mismatch(Finding::UnitsDiffer {
            module: MODULE,
            port: 1,
            signal: SIGNAL,
            other_port: 0,
            other_signal: SIGNAL,
            relation: UnitRelation::Alike,
        }),
        Blocked::Mismatch(Finding::DuplicateLinkEnd { link: 1, first: MODULE, second: MODULE }),
        Blocked::Mismatch(Finding::MissingDelay { signal: SIGNAL, writer: MODULE, reader: MODULE }),
        Blocked::Mismatch(Finding::LateStageRate { reader: MODULE, writer: MODULE, every_ticks: 5 }),
        Blocked::Tick(Tick::Idle),
        Blocked::Tick(Tick::MeasurementRefused(FrameError::Length { expected: 3, found: 2 })),
        Blocked::Tick(Tick::CommandRefused(not_finite)),
        Blocked::Tick(Tick::Disarmed),
        Blocked::Tick(Tick::LinkLost { link: 1 }),
        Blocked::Tick(Tick::ModuleFailed(MODULE)),
        Blocked::Tick(Tick::CommandsLate),
        Blocked::Tick(Tick::DriveFailed(DriveFault::NotAligned)),
        Blocked::Tick(Tick::DriveFailed(DriveFault::Gone { axis: 1 })),
        Blocked::Tick(Tick::DriveFailed(DriveFault::EncoderSlipped)),
        Blocked::Tick(Tick::DriveFailed(DriveFault::CurrentLoop)),
        Blocked::Tick(Tick::LinkDown { link: 1 }),
    ];
    let expected = [
        "00 00 ac 02 01 00",
        "00 01 ac 02 01 00 01 64 55 02",
        "00 02 64 55 02 04 ac 02 01 00",
        "00 02 64 55 02 04 ac 02 01 01",
        "00 02 64 55 02 04 ac 02 01 02",
        "00 02 64 55 02 04 ac 02 01 03",
        "00 03 ac 02 01 00 01 64 55 02 01",
        "00 04 64 55 02 01 ac 02 01 00 ac 02 01 01",
        "00 04 64 55 02 01 ac 02 01 00 ac 02 01 03",
        "00 05 01 64 55 02 64 55 02",
        "00 07 ac 02 01 64 55 02 64 55 02",
        "00 08 64 55 02 64 55 02 05",
        "01 01",
        "01 02 00 03 02",
        "01 03 01 ac 02 01 02",
        "01 04",
        "01 05 01",
        "01 09 64 55 02",
        "01 06",
        "01 07 0b",
        "01 07 00 01",
        "01 07 0d",
        "01 07 0e",
        "01 08 01",
    ];
    assert_bytes(&reasons, &expected);
}
