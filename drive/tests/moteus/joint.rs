//! A moteus joint and its drive model, tick by tick.

use drive::{MoteusJoint, MoteusJointFault, MoteusReading};

use super::*;

const MISSING_TICKS: u8 = 3;

/// A joint, its drive and the bus between them.
struct Bench {
    joint: MoteusJoint,
    drive: MoteusDrive,
    are_wires_whole: bool,
    /// Last frame sent.
    sent: MoteusFrame,
}

impl Bench {
    fn new() -> Self {
        let joint = MoteusJoint::new(address(), TIMEOUT_S, MISSING_TICKS);
        Self { joint, drive: model(), are_wires_whole: true, sent: MoteusFrame::query() }
    }

    /// Runs a tick: reads, then commands.
    fn tick(&mut self, torque_nm: Option<f32>) -> MoteusReading {
        let reading = self.joint.read();
        self.sent = self.joint.frame(torque_nm);
        if self.are_wires_whole {
            let (id, reply) = self.drive.receive(address().command_id(), self.sent.bytes()).unwrap();
            assert_eq!(self.joint.receive(id, &reply), Ok(true));
        }
        self.drive.advance(1e-3);
        reading
    }

    /// Runs ticks; returns the last reading.
    fn ticks(&mut self, count: usize, torque_nm: Option<f32>) -> MoteusReading {
        (0..count).map(|_| self.tick(torque_nm)).last().unwrap()
    }

    /// Returns a bench with a moving joint.
    fn moving() -> Self {
        let mut bench = Self::new();
        bench.tick(None);
        assert_eq!(bench.ticks(5, Some(1.0)).fault, None);
        bench
    }
}

fn shows_nothing(reading: &MoteusReading) -> bool {
    let MoteusReading { position_rad, velocity_rad_per_s, torque_nm, voltage_v, temperature_c, .. } =
        *reading;
    [position_rad, velocity_rad_per_s, torque_nm, voltage_v, temperature_c].into_iter().all(f32::is_nan)
}

#[test]
fn nothing_is_read_before_the_first_reply_and_then_what_it_says() {
    let mut bench = Bench::new();
    bench.drive.set_state(1.25, -2.5);
    assert!(shows_nothing(&bench.tick(None)));
    assert_eq!(bench.sent, MoteusFrame::query());
    let reading = bench.tick(Some(1.0));
    assert!(is_near(reading.position_rad, 1.25) && is_near(reading.velocity_rad_per_s, -2.5));
    assert_eq!((reading.fault, reading.fault().to_bits()), (None, 0));
    assert_eq!(bench.sent, MoteusFrame::torque(1.0, TIMEOUT_S));
    assert!((bench.drive.torque_nm() - 1.0).abs() < 1e-9, "in the tick of its first command");
    bench.ticks(2, Some(0.5));
    assert!(is_near(bench.tick(None).torque_nm, 0.5));
    assert_eq!(bench.sent, MoteusFrame::stop());
    assert!(bench.drive.torque_nm().abs() < 1e-9);
}

#[test]
fn replies_that_do_not_come_are_bridged_then_told_of_then_nothing() {
    let mut bench = Bench::moving();
    bench.are_wires_whole = false;
    // The reply to the previous frame is still read.
    for tick in 0..MISSING_TICKS {
        assert_eq!(bench.tick(Some(1.0)).fault, None, "{tick}");
    }
    let told = bench.tick(Some(1.0));
    assert_eq!((told.fault, told.fault().to_bits()), (Some(MoteusJointFault::Silent), 512.0_f32.to_bits()));
    assert!(told.position_rad.is_finite());
    for _ in 0..1000 {
        assert!(shows_nothing(&bench.tick(Some(1.0))));
    }
    // The drive has timed out, is stopped and continues.
    bench.are_wires_whole = true;
    bench.ticks(2, None);
    assert_eq!(bench.ticks(5, Some(2.0)).fault, None);
    assert!((bench.drive.torque_nm() - 2.0).abs() < 1e-9);
}

#[test]
fn a_fault_under_command_is_told_of_once_and_kept_until_the_next_start() {
    let mut bench = Bench::moving();
    bench.drive.raise_fault(33);
    bench.tick(Some(1.0));
    let told = bench.tick(Some(1.0));
    assert_eq!(told.fault, MoteusJointFault::from_number(33));
    assert!(told.position_rad.is_finite());
    // Continuing to command does not clear the fault.
    for _ in 0..100 {
        assert!(shows_nothing(&bench.tick(Some(1.0))));
        assert_eq!(bench.sent, MoteusFrame::query());
    }
    bench.tick(None);
    for _ in 0..100 {
        let reading = bench.tick(None);
        assert_eq!((reading.fault, reading.position_rad.is_finite()), (told.fault, true));
        assert_eq!(bench.sent, MoteusFrame::query());
    }
    bench.tick(Some(1.0));
    assert_eq!(bench.sent, MoteusFrame::stop());
    assert_eq!(bench.ticks(3, Some(1.0)).fault, None);
    assert!((bench.drive.torque_nm() - 1.0).abs() < 1e-9);
}

#[test]
fn a_fault_that_comes_back_is_cleared_no_second_time() {
    let mut bench = Bench::new();
    bench.drive.raise_fault(40);
    assert_eq!(bench.ticks(3, None).fault, MoteusJointFault::from_number(40));
    let (mut stops, mut told) = (0, 0);
    for _ in 0..200 {
        told += u32::from(bench.tick(Some(1.0)).position_rad.is_finite());
        stops += u32::from(bench.sent == MoteusFrame::stop());
        if bench.sent == MoteusFrame::torque(1.0, TIMEOUT_S) {
            bench.drive.raise_fault(40);
        }
    }
    assert_eq!(stops, 2, "one stop to clear the fault, one before its reply arrives");
    assert!(told < 6, "{told}");
}

#[test]
fn a_drive_that_somebody_else_stops_is_not_started_again() {
    let mut bench = Bench::moving();
    let _ = bench.drive.receive(0x0001, MoteusFrame::stop().bytes());
    bench.tick(Some(1.0));
    let told = bench.tick(Some(1.0)).fault.unwrap();
    assert_eq!((told, told.number()), (MoteusJointFault::UnexpectedMode(MoteusMode::Stopped), 256));
    for _ in 0..10 {
        assert!(shows_nothing(&bench.tick(Some(1.0))));
        assert_eq!(bench.sent, MoteusFrame::stop());
    }
}

#[test]
fn a_drive_that_never_gets_ready_is_told_of() {
    let mut joint = MoteusJoint::new(address(), TIMEOUT_S, MISSING_TICKS);
    let preparing = b"\x21\x00\x04\x2f\x01\0\0\0\0\0\0\0\0\0\0\0\0\x23\x0d\0\0\0";
    let stopped = b"\x21\x00\x00\x2f\x01\0\0\0\0\0\0\0\0\0\0\0\0\x23\x0d\0\0\0";
    assert_eq!(joint.receive(0x100, stopped), Ok(true));
    let mut shown = Vec::new();
    for _ in 0..100 {
        shown.push(joint.read());
        joint.frame(Some(1.0));
        assert_eq!(joint.receive(0x100, preparing), Ok(true));
    }
    let first = shown.iter().position(|reading| reading.fault.is_some()).unwrap();
    assert_eq!(shown[first].fault, Some(MoteusJointFault::UnexpectedMode(MoteusMode::Preparing)));
    assert!((40..60).contains(&first) && shown[first + 1..].iter().all(shows_nothing), "{first}");
}

#[test]
fn what_is_another_s_or_says_nothing_is_no_reply() {
    let mut joint = MoteusJoint::new(address(), TIMEOUT_S, MISSING_TICKS);
    let reply = model().receive(0x8001, MoteusFrame::query().bytes()).unwrap().1;
    assert_eq!(joint.receive(0x200, &reply), Ok(false));
    assert_eq!(joint.receive(0x100, &reply[..5]), Err(MoteusReplyError::Truncated));
    assert!(shows_nothing(&joint.read()));
    assert_eq!(joint.receive(0x100, &reply), Ok(true));
    assert!(joint.read().position_rad.is_finite());
}

#[test]
fn every_trouble_has_its_number_and_a_remedy() {
    for number in 0..=600 {
        let Some(trouble) = MoteusJointFault::from_number(number) else {
            assert!(number == 0 || number > 512, "{number}");
            continue;
        };
        // Three mode numbers mean preparing.
        let is_same = trouble.number() == number || (256 + 2..=256 + 4).contains(&number);
        assert!(is_same, "{number}: {trouble}");
        assert!(!trouble.remedy().is_empty() && !trouble.to_string().is_empty());
    }
    let timed_out = MoteusJointFault::from_number(267).unwrap();
    assert_eq!(timed_out.to_string(), "unexpected mode: timeout (267)");
}

proptest! {
    /// For any sequence of events: no torque while off, and readings are complete or empty.
    #[test]
    fn a_joint_that_is_off_is_sent_no_torque(
        events in prop::collection::vec((0..6_u8, any::<bool>(), any::<f32>()), 0..400),
    ) {
        let mut bench = Bench::new();
        for (event, is_on, torque_nm) in events {
            match event {
                0 => bench.drive.raise_fault(38),
                1 => bench.are_wires_whole = !bench.are_wires_whole,
                2 => bench.drive.advance(1.0),
                3 => { let _ = bench.drive.receive(0x0001, MoteusFrame::stop().bytes()); }
                _ => {}
            }
            let reading = bench.tick(is_on.then_some(torque_nm));
            prop_assert!(shows_nothing(&reading) || reading.position_rad.is_finite());
            if !is_on {
                prop_assert!([MoteusFrame::stop(), MoteusFrame::query()].contains(&bench.sent));
                prop_assert!(!bench.are_wires_whole || bench.drive.torque_nm().abs() < 1e-9);
            }
        }
        // After all faults are gone, switching off and on restores operation.
        bench.are_wires_whole = true;
        bench.ticks(3, None);
        let reading = bench.ticks(5, Some(1.0));
        prop_assert_eq!(reading.fault, None);
        prop_assert!((bench.drive.torque_nm() - 1.0).abs() < 1e-9);
    }
}
