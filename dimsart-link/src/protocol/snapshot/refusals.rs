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
        CommandError::Storage(StorageError::OutOfSlots),
        CommandError::Storage(StorageError::OutOfMemory { wanted: 300, free: 9 }),
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
        CommandError::BreaksScheme(FINDING),
        CommandError::HasFaults { faults: 2 },
        CommandError::TooSlow { module: MODULE, cycles: 300, tick_cycles: 9, limit_cycles: 8 },
        CommandError::CostUnknown(MODULE),
        CommandError::TooManyWires,
        CommandError::PacketTooLong { words: 300 },
        CommandError::TransactionOpen,
        CommandError::NoTransaction,
        CommandError::StillStopping,
        CommandError::RunsEveryTick(MODULE),
        CommandError::UnknownLaw(MODULE),
        CommandError::Law(LawRefusal::Program(ProgramError::Damaged)),
        CommandError::Law(LawRefusal::Program(ProgramError::Register { at: 7 })),
        CommandError::Law(LawRefusal::InUse),
        CommandError::Law(LawRefusal::UnknownNumber),
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
        Refusal::Unsupported,
        Refusal::NotFound,
        Refusal::TooLong,
        Refusal::Engine(CommandError::TooManyPorts),
        Refusal::Store(StoreError::NoStorage),
        Refusal::Store(StoreError::SchemeIsRunning),
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
    let (first, second) = (Endpoint::Frame, Endpoint::Module(MODULE));
    let mismatch =
        |difference| Finding::Mismatch { module: MODULE, port: 4, signal: SIGNAL, mismatch: difference };
    let not_finite = FrameError::NotFinite { signal: SIGNAL, word: 2 };
    let reasons = [
        NotCommandedReason::Mismatch(FINDING),
        NotCommandedReason::Mismatch(Finding::MultipleWriters { signal: SIGNAL, first, second }),
        NotCommandedReason::Mismatch(mismatch(TypeMismatch::Unit)),
        NotCommandedReason::Mismatch(mismatch(TypeMismatch::Format)),
        NotCommandedReason::Mismatch(mismatch(TypeMismatch::Shape)),
        NotCommandedReason::Mismatch(mismatch(TypeMismatch::Coordinates)),
        NotCommandedReason::Mismatch(Finding::Delay {
            signal: SIGNAL,
            writer: first,
            reader: second,
            is_declared: true,
        }),
        NotCommandedReason::Mismatch(Finding::UnitsDiffer {
            module: MODULE,
            port: 1,
            signal: SIGNAL,
            other_port: 0,
            other_signal: SIGNAL,
            relation: UnitRelation::Integral,
        }),
        NotCommandedReason::Mismatch(Finding::UnitsDiffer {
            module: MODULE,
            port: 1,
            signal: SIGNAL,
            other_port: 0,
            other_signal: SIGNAL,
            relation: UnitRelation::SameType,
        }),
        NotCommandedReason::Mismatch(Finding::DuplicateLinkEnd { link: 1, first: MODULE, second: MODULE }),
        NotCommandedReason::Mismatch(Finding::MissingDelay {
            signal: SIGNAL,
            writer: MODULE,
            reader: MODULE,
        }),
        NotCommandedReason::Mismatch(Finding::LateStageRate {
            reader: MODULE,
            writer: MODULE,
            every_ticks: 5,
        }),
        NotCommandedReason::Tick(TickResult::Idle),
        NotCommandedReason::Tick(TickResult::MeasurementRefused(FrameError::Length {
            expected: 3,
            found: 2,
        })),
        NotCommandedReason::Tick(TickResult::CommandRefused(not_finite)),
        NotCommandedReason::Tick(TickResult::Disarmed),
        NotCommandedReason::Tick(TickResult::LinkLost { link: 1 }),
        NotCommandedReason::Tick(TickResult::ModuleFailed(MODULE)),
        NotCommandedReason::Tick(TickResult::CommandsLate),
        NotCommandedReason::Tick(TickResult::DriveFailed(DriveFault::NotAligned)),
        NotCommandedReason::Tick(TickResult::DriveFailed(DriveFault::NoResponse { axis: 1 })),
        NotCommandedReason::Tick(TickResult::DriveFailed(DriveFault::EncoderSlipped)),
        NotCommandedReason::Tick(TickResult::DriveFailed(DriveFault::CurrentLoop)),
        NotCommandedReason::Tick(TickResult::LinkDown { link: 1 }),
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
