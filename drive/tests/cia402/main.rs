//! CiA 402 joints against the simulator's drive model; both implement the protocol independently.
#![expect(clippy::unwrap_used, reason = "test helpers")]

use drive::{
    Cia402Abort, Cia402Command, Cia402Emergency, Cia402Frame, Cia402Host, Cia402Joint, Cia402JointFault,
    Cia402Node, Cia402Reading, Cia402Settings, Cia402State,
};
use hil_sim::plant::Cia402Drive;
use proptest::prelude::*;

use Cia402Command::{DisableVoltage, EnableOperation, FaultReset, QuickStop, Shutdown, SwitchOn};
use Cia402State::{
    Fault, FaultReactionActive, NotReadyToSwitchOn, OperationEnabled, QuickStopActive, ReadyToSwitchOn,
    SwitchOnDisabled, SwitchedOn, Unknown,
};

const RATED_NM: f64 = 0.5;
const COMMANDS: [Cia402Command; 6] =
    [DisableVoltage, QuickStop, Shutdown, SwitchOn, EnableOperation, FaultReset];

fn settings() -> Cia402Settings {
    let [node, host] = [5, 127].map(|number| Cia402Node::new(number).unwrap());
    let (tick_s, timeout_s, missing_ticks) = (1e-3, 0.02, 3);
    Cia402Settings {
        node,
        host,
        counts_per_turn: 4096.0,
        gear_ratio: -20.0,
        tick_s,
        timeout_s,
        missing_ticks,
    }
}

fn model() -> Cia402Drive {
    Cia402Drive::new(5, 4096.0, -20.0, RATED_NM)
}

fn state(drive: &Cia402Drive) -> Cia402State {
    Cia402State::from_statusword(drive.statusword())
}

/// Sends a controlword by SDO, in any NMT state.
fn tell(drive: &mut Cia402Drive, command: Cia402Command) {
    let [low, high] = command.controlword().to_le_bytes();
    drive.receive(0x605, &[0x2b, 0x40, 0x60, 0, low, high, 0, 0]);
}

/// Returns a drive in a given state.
fn model_in(wanted: Cia402State) -> Cia402Drive {
    let mut drive = model();
    let commands: &[_] = match wanted {
        ReadyToSwitchOn => &[Shutdown],
        SwitchedOn => &[Shutdown, SwitchOn],
        OperationEnabled => &[Shutdown, SwitchOn, EnableOperation],
        QuickStopActive => &[Shutdown, SwitchOn, EnableOperation, QuickStop],
        _ => &[],
    };
    commands.iter().for_each(|command| tell(&mut drive, *command));
    if matches!(wanted, FaultReactionActive | Fault) {
        drive.raise_fault(0x2310);
    }
    if wanted == Fault {
        drive.advance(1e-3);
    }
    assert_eq!(state(&drive), wanted);
    drive
}

/// A joint, its drive and the bus between them.
struct Bench {
    joint: Cia402Joint,
    host: Cia402Host,
    drive: Cia402Drive,
    are_wires_whole: bool,
    sent: Option<Cia402Frame>,
}

impl Bench {
    fn new(drive: Cia402Drive) -> Self {
        Self::with(drive, &settings())
    }

    fn with(drive: Cia402Drive, settings: &Cia402Settings) -> Self {
        let (joint, host) = (Cia402Joint::new(settings), Cia402Host::new(settings));
        Self { joint, host, drive, are_wires_whole: true, sent: None }
    }

    fn tick(&mut self, torque_nm: Option<f32>) -> Cia402Reading {
        let reading = self.joint.read();
        self.sent = self.joint.frame(torque_nm);
        let (sync, heartbeat) = self.host.frames();
        for frame in self.sent.into_iter().chain([sync]).chain(heartbeat).filter(|_| self.are_wires_whole) {
            self.drive.receive(frame.id(), frame.bytes());
        }
        self.drive.advance(1e-3);
        for (id, data) in self.drive.take_frames().filter(|_| self.are_wires_whole) {
            self.joint.receive(id, &data);
        }
        reading
    }

    /// Runs ticks; returns the last reading.
    fn ticks(&mut self, count: usize, torque_nm: Option<f32>) -> Cia402Reading {
        (0..count).map(|_| self.tick(torque_nm)).last().unwrap()
    }

    /// Returns a bench with a moving joint.
    fn moving() -> Self {
        let mut bench = Self::new(model());
        bench.ticks(100, None);
        bench.assert_moves();
        bench
    }

    fn assert_moves(&mut self) {
        assert_eq!(self.ticks(20, Some(4.0)).fault, None);
        assert!((self.drive.torque_nm() - 4.0).abs() < 5e-3, "{}", self.drive.torque_nm());
    }

    /// Runs until a fault is reported, once with a position and then without data.
    fn told(&mut self) -> Cia402JointFault {
        let mut readings = (0..100).map(|_| self.tick(Some(4.0)));
        let told = readings.find_map(|reading| reading.fault.filter(|_| reading.position_rad.is_finite()));
        assert!(readings.all(|reading| reading.position_rad.is_nan() && reading.torque_nm.is_nan()));
        assert!(self.drive.torque_nm().abs() < 1e-9);
        told.unwrap()
    }
}

/// A drive's count wraps after 2^32: here after 64.34 rad of the output, from 32.17 to -32.17.
#[test]
fn a_position_goes_on_where_the_drives_count_wraps() {
    let settings = Cia402Settings { counts_per_turn: 4_194_304.0, gear_ratio: 100.0, ..settings() };
    let mut bench = Bench::with(Cia402Drive::new(5, 4_194_304.0, 100.0, RATED_NM), &settings);
    bench.drive.set_state(30.0, 0.0);
    bench.ticks(100, None);
    // Up across three wraps and down across four, with lost replies.
    let up = (0..8_000).map(|tick| 30.0 + 0.02 * f64::from(tick));
    let down = (0..16_000).map(|tick| 190.0 - 0.02 * f64::from(tick));
    let mut shown_before = 30.0;
    for (tick, position_rad) in up.chain(down).enumerate() {
        bench.drive.set_state(position_rad, 0.0);
        bench.are_wires_whole = tick % 50 != 7;
        bench.tick(None);
        let shown = f64::from(bench.joint.read().position_rad);
        assert!((shown - position_rad).abs() < 0.021, "{shown} at {position_rad}");
        assert!((shown - shown_before).abs() < 0.041, "from {shown_before} to {shown}");
        shown_before = shown;
    }
    assert!((shown_before + 130.0).abs() < 0.03, "{shown_before}");
    // After a power cycle, the drive counts from its present position.
    bench.drive.boot();
    bench.drive.set_state(1.0, 0.0);
    bench.ticks(200, None);
    assert!((bench.joint.read().position_rad - 1.0).abs() < 1e-5);
}

#[test]
fn identifiers_and_statuswords_are_those_of_the_standards() {
    let node = settings().node;
    assert_eq!([1, 2, 3, 4].map(|pdo| node.tpdo_id(pdo)), [0x185, 0x285, 0x385, 0x485]);
    assert_eq!([1, 2, 3, 4].map(|pdo| node.rpdo_id(pdo)), [0x205, 0x305, 0x405, 0x505]);
    let others = [node.emergency_id(), node.response_id(), node.request_id(), node.heartbeat_id()];
    assert_eq!(others, [0x85, 0x585, 0x605, 0x705]);
    assert!([0, 128, 255].into_iter().all(|number| Cia402Node::new(number).is_none()));
    let masks = [
        (0x4f, 0x00, NotReadyToSwitchOn),
        (0x4f, 0x40, SwitchOnDisabled),
        (0x6f, 0x21, ReadyToSwitchOn),
        (0x6f, 0x23, SwitchedOn),
        (0x6f, 0x27, OperationEnabled),
        (0x6f, 0x07, QuickStopActive),
        (0x4f, 0x0f, FaultReactionActive),
        (0x4f, 0x08, Fault),
    ];
    for statusword in 0..=u16::MAX {
        let expected = masks.into_iter().find(|(mask, value, _)| statusword & mask == *value);
        assert_eq!(Cia402State::from_statusword(statusword), expected.map_or(Unknown, |(.., state)| state));
    }
}

/// Columns as [`COMMANDS`].
#[test]
fn the_model_goes_from_state_to_state_as_the_standard_s_table_says() {
    #[rustfmt::skip]
    let table = [
        (SwitchOnDisabled, [SwitchOnDisabled, SwitchOnDisabled, ReadyToSwitchOn, SwitchOnDisabled, SwitchOnDisabled, SwitchOnDisabled]),
        (ReadyToSwitchOn, [SwitchOnDisabled, SwitchOnDisabled, ReadyToSwitchOn, SwitchedOn, OperationEnabled, ReadyToSwitchOn]),
        (SwitchedOn, [SwitchOnDisabled, SwitchOnDisabled, ReadyToSwitchOn, SwitchedOn, OperationEnabled, SwitchedOn]),
        (OperationEnabled, [SwitchOnDisabled, QuickStopActive, ReadyToSwitchOn, SwitchedOn, OperationEnabled, OperationEnabled]),
        (QuickStopActive, [SwitchOnDisabled, QuickStopActive, QuickStopActive, QuickStopActive, OperationEnabled, QuickStopActive]),
        (FaultReactionActive, [FaultReactionActive; 6]),
        (Fault, [Fault, Fault, Fault, Fault, Fault, SwitchOnDisabled]),
    ];
    for (from, row) in table {
        for (command, to) in COMMANDS.into_iter().zip(row) {
            let mut drive = model_in(from);
            tell(&mut drive, command);
            assert_eq!(state(&drive), to, "{from}, {command:?}");
        }
    }
    // Only on the rising edge of its bit.
    let mut drive = model_in(Fault);
    tell(&mut drive, FaultReset);
    drive.raise_fault(0x2310);
    drive.advance(1e-3);
    tell(&mut drive, FaultReset);
    assert_eq!(state(&drive), Fault);
}

#[test]
fn a_joint_is_set_up_and_moved_whatever_its_drive_was_at() {
    for from in [SwitchOnDisabled, ReadyToSwitchOn, SwitchedOn, OperationEnabled, QuickStopActive, Fault] {
        for network in [0x01, 0x02, 0x80, 0x81] {
            let mut bench = Bench::new(model_in(from));
            bench.drive.receive(Cia402Node::NMT_ID, &[network, 5]);
            bench.drive.set_state(1.25, -2.5);
            let reading = bench.ticks(100, None);
            assert!((reading.position_rad - 1.25).abs() < 1e-4, "{reading:?}");
            assert!((reading.velocity_rad_per_s + 2.5).abs() < 1e-4, "{reading:?}");
            assert!((reading.voltage_v - 48.0).abs() < 1e-3 && reading.temperature_c.is_nan());
            assert!(matches!(state(&bench.drive), SwitchOnDisabled | Fault));
            bench.assert_moves();
            assert!((bench.tick(Some(4.0)).torque_nm - 4.0).abs() < 5e-3);
            bench.ticks(2, None);
            assert_eq!(state(&bench.drive), SwitchOnDisabled);
            assert!(bench.drive.torque_nm().abs() < 1e-9);
        }
    }
}

#[test]
fn what_a_drive_refuses_is_named_and_what_it_may_lack_is_left_out() {
    for (object, refused, code) in [
        (0x6077, 0x1a00, 0x0602_0000),
        (0x6061, 0x1a01, 0x0602_0000),
        (0x1600, 0x1600, 0x0602_0000),
        (0x6007, 0x6007, 0x0602_0000),
        (0x6076, 0x6076, 0x0602_0000),
    ] {
        let mut drive = model();
        drive.remove_object(object);
        let mut bench = Bench::new(drive);
        let reading = bench.ticks(150, Some(1.0));
        let abort = Cia402Abort::from_code(code);
        assert_eq!(reading.fault, Some(Cia402JointFault::Refused { object: refused, abort }));
        assert!(reading.position_rad.is_nan() && bench.drive.torque_nm().abs() < 1e-9);
    }
    for object in [0x6079, 0x1802, 0x1a02, 0x1803] {
        let mut bench = Bench::new(model());
        bench.drive.remove_object(object);
        assert_eq!(bench.ticks(100, None).voltage_v.is_nan(), object != 0x1803);
        bench.assert_moves();
    }
}

#[test]
fn the_model_refuses_what_no_drive_takes() {
    let mut drive = model();
    let mut refuses = |index: u16, part, bytes: u8, value: u32| {
        let [low, high] = index.to_le_bytes();
        let head = [0x23 | (4 - bytes) << 2, low, high, part];
        let question: Vec<u8> = head.into_iter().chain(value.to_le_bytes()).collect();
        let _ = drive.take_frames().count();
        drive.receive(0x605, &question);
        let (id, answer) = drive.take_frames().next().unwrap();
        assert_eq!((id, &answer[1..4]), (0x585, &question[1..4]));
        (answer[0] == 0x80).then(|| u32::from_le_bytes(answer[4..].try_into().unwrap()))
    };
    assert_eq!(refuses(0x1a00, 1, 4, 0x6041_0010), Some(0x0601_0000), "while the PDO is enabled");
    assert_eq!(refuses(0x1800, 1, 4, 0x8000_0185), None);
    assert_eq!(refuses(0x1a00, 1, 4, 0x6041_0010), None);
    assert_eq!(refuses(0x1a00, 2, 4, 0x6072_0010), Some(0x0604_0041));
    for part in 2..=4 {
        assert_eq!(refuses(0x1a00, part, 4, 0x6064_0020), None);
    }
    assert_eq!(refuses(0x1a00, 0, 1, 4), Some(0x0604_0042));
    assert_eq!(refuses(0x6041, 0, 2, 0), Some(0x0601_0002));
    assert_eq!(refuses(0x6040, 0, 4, 0), Some(0x0607_0010));
    assert_eq!(refuses(0x6040, 7, 2, 0), Some(0x0609_0011));
    assert_eq!(refuses(0x6060, 0, 1, 8), Some(0x0609_0030));
    assert_eq!(refuses(0x7000, 0, 1, 0), Some(0x0602_0000));
}

#[test]
fn a_fault_is_told_of_once_kept_and_reset_by_the_next_start_alone() {
    let mut bench = Bench::moving();
    bench.drive.raise_fault(0x3210);
    let emergency = Cia402JointFault::Emergency(Cia402Emergency::from_code(0x3210).unwrap());
    assert_eq!(bench.told(), emergency);
    let reading = bench.ticks(50, None);
    assert_eq!((reading.fault, state(&bench.drive)), (Some(emergency), Fault));
    assert!(reading.position_rad.is_finite());
    bench.assert_moves();
    // A recurring fault is not reset a second time.
    bench.drive.raise_fault(0x3210);
    bench.told();
    bench.tick(None);
    let mut resets = 0;
    for _ in 0..300 {
        bench.tick(Some(4.0));
        resets += usize::from(bench.sent.unwrap().bytes().first() == Some(&0x80));
        if state(&bench.drive) == ReadyToSwitchOn {
            bench.drive.raise_fault(0x3210);
        }
    }
    assert!((1..=3).contains(&resets) && state(&bench.drive) == Fault, "{resets}");
}

#[test]
fn an_emergency_alone_and_a_drive_that_somebody_else_turns_off_stop_the_joint() {
    let mut bench = Bench::moving();
    bench.joint.receive(0x85, &[0x10, 0x42, 0x09, 0, 0, 0, 0, 0]);
    assert!(matches!(bench.told(), Cia402JointFault::Emergency(of) if of.code() == 0x4210));
    bench.tick(None);
    bench.assert_moves();
    tell(&mut bench.drive, QuickStop);
    assert_eq!(bench.told(), Cia402JointFault::State(QuickStopActive));
    bench.tick(None);
    bench.assert_moves();
}

#[test]
fn heartbeats_that_stay_away_are_noticed_on_either_side() {
    // Drive side: with the bus cut, the drive turns off by itself.
    let mut bench = Bench::moving();
    bench.are_wires_whole = false;
    assert_eq!(bench.told(), Cia402JointFault::Silent);
    assert_eq!(state(&bench.drive), Fault);
    bench.are_wires_whole = true;
    bench.ticks(300, None);
    bench.assert_moves();
    // Controller side: process data without a heartbeat.
    let mut bench = Bench::moving();
    bench.drive.receive(0x605, &[0x2b, 0x17, 0x10, 0, 0, 0, 0, 0]);
    assert_eq!(bench.told(), Cia402JointFault::NoHeartbeat);
    bench.ticks(100, None);
    bench.assert_moves();
    // After a power failure, the drive is set up again.
    bench.drive.boot();
    assert_eq!(bench.told(), Cia402JointFault::LeftOperation);
    bench.ticks(100, None);
    bench.assert_moves();
}

#[test]
fn every_trouble_has_its_number_and_a_remedy() {
    let known = (0..=0x17_0000).filter_map(|number| Some((number, Cia402JointFault::from_number(number)?)));
    let mut kinds = 0;
    for (number, trouble) in known {
        assert_eq!(u32::from(trouble), number, "{trouble}");
        assert!(!trouble.remedy().is_empty() && !trouble.to_string().is_empty());
        kinds += usize::from(number < 0x1000);
    }
    assert_eq!(kinds, 9 + 3 + 256);
}

/// Generates frames that a node may receive or send, and arbitrary ones.
fn frames() -> impl Strategy<Value = (u16, Vec<u8>)> {
    let ids = prop_oneof![
        Just(0x000_u16),
        Just(0x080),
        Just(0x085),
        Just(0x185),
        Just(0x205),
        Just(0x285),
        Just(0x385),
        Just(0x585),
        Just(0x605),
        Just(0x705),
        Just(0x77f),
        any::<u16>()
    ];
    let bytes = prop_oneof![any::<u8>(), Just(0x27), Just(0x0a), Just(0x05), Just(0x60)];
    (ids, prop::collection::vec(bytes, 0..10))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    /// For any input, a torque is sent only in *operation enabled* and only if commanded.
    #[test]
    fn no_frames_make_a_joint_send_torque_outside_operation_enabled(
        ticks in prop::collection::vec((prop::collection::vec(frames(), 0..4), prop::option::of(any::<f32>())), 0..100),
    ) {
        let mut bench = Bench::new(model());
        bench.ticks(100, None);
        for (frames, torque_nm) in ticks {
            for (id, data) in frames {
                bench.joint.receive(id, &data);
                bench.drive.receive(id, &data);
                prop_assert!(bench.drive.torque_nm().abs() < 1e-9 || state(&bench.drive) == OperationEnabled);
            }
            bench.tick(torque_nm);
            match bench.sent.map(|sent| (sent.id(), sent.bytes().to_vec())) {
                Some((0x205, data)) => {
                    let (controlword, torque) = (data[0], &data[2..]);
                    prop_assert!(controlword == 0x0f || torque == [0, 0]);
                    prop_assert!(torque_nm.is_some() || data == [0; 4]);
                }
                Some((id, _)) => prop_assert!(id == 0x605 || id == 0x000),
                None => {}
            }
        }
        // After all faults are gone, switching off and on restores operation.
        bench.drive.boot();
        bench.ticks(350, None);
        bench.assert_moves();
    }
}
