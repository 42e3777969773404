//! Lost frames, absent drives, a controller that stops, faults: what the scheme sees, what the joint does, what is said.

use dimsart_core::{Command, DataType, SafetyReason, TickResult, types};
use drive::{MoteusJointFault, MoteusMode};
use hil_sim::experiment::{Experiment, run};
use hil_sim::rig::{Probe, Rig};

use super::{read, step, text};

/// A rig that is looked at between ticks.
struct Bench {
    experiment: Experiment,
}

impl Bench {
    fn new(moteus: &str) -> Self {
        let file = read(&text(moteus, &step(0, 0.05)));
        Self { experiment: Experiment::new(&file).unwrap() }
    }

    fn rig(&mut self) -> &mut Rig {
        self.experiment.rig_mut()
    }

    /// Runs to the end of tick `tick`, and says what came of it.
    fn run_to(&mut self, tick: u64) -> TickResult {
        while self.rig().ticks() <= tick {
            self.rig().step();
        }
        self.rig().stations()[0].last_tick
    }

    fn reason(&mut self) -> SafetyReason {
        self.rig().stations()[0].dimsart.safety().reason()
    }

    /// The signals of an axis in the Data Base.
    fn shows(&mut self, data_type: &'static DataType, axis: usize) -> f64 {
        let station = &self.rig().stations()[0];
        Probe::new(data_type.first()).values(station).nth(axis).unwrap()
    }

    fn trouble(&mut self, axis: usize) -> Option<MoteusJointFault> {
        #[expect(clippy::cast_possible_truncation, reason = "a whole number up to 512")]
        let number = self.shows(types::DRIVE_FAULT, axis) as u16;
        MoteusJointFault::from_number(number)
    }

    /// Torque on a joint, and how it moves, in truth.
    fn world(&mut self, axis: usize) -> (f64, f64) {
        let mut values = [0.0; 8];
        self.rig().stations()[0].plant.read_quantities(axis, &mut values);
        (values[2], values[1])
    }

    fn reset(&mut self) {
        self.rig().stations_mut()[0].dimsart.command(Command::Reset).unwrap();
    }
}

#[test]
fn a_lost_frame_repeats_a_reading_and_holds_a_torque() {
    let mut with = Bench::new("absent = [{ axis = 0, from_s = 0.0095, until_s = 0.0105 }]");
    with.run_to(9);
    let (before_nm, _) = with.world(0);
    with.run_to(10);
    let (held_nm, _) = with.world(0);
    let position = with.shows(types::POSITION, 0);
    with.run_to(11);
    assert_eq!(held_nm.to_bits(), before_nm.to_bits(), "the drive holds what it was commanded");
    assert_eq!(with.shows(types::POSITION, 0).to_bits(), position.to_bits());
    assert_eq!(with.trouble(0), None, "one of three that may be missing");
    with.run_to(12);
    assert!(with.shows(types::POSITION, 0) > position);
    assert_eq!(with.run_to(1000), TickResult::Ran);
    assert!((with.shows(types::POSITION, 0) - 0.05).abs() < 1e-4);
}

#[test]
fn a_drive_that_leaves_the_bus_is_named_and_the_others_are_let_go() {
    let mut bench = Bench::new("absent = [{ axis = 0, from_s = 0.0995, until_s = 0.2995 }]");
    bench.run_to(99);
    // Frames 100 to 102 get no reply: the third is told of in tick 103, and the next one is refused.
    assert_eq!((bench.run_to(102), bench.trouble(0)), (TickResult::Ran, None));
    assert_eq!((bench.run_to(103), bench.trouble(0)), (TickResult::Ran, Some(MoteusJointFault::Silent)));
    assert_eq!(bench.trouble(1), None);
    let refused = bench.run_to(104);
    assert!(matches!(refused, TickResult::MeasurementRefused(_)), "{refused:?}");
    assert_eq!(
        (bench.reason(), bench.trouble(0)),
        (SafetyReason::MeasurementRefused, Some(MoteusJointFault::Silent))
    );
    assert!(bench.world(1).0.abs() < 1e-12, "the other joint is off in the same tick");
    // What is absent holds its torque until its own timeout, 20 ms after the last frame.
    bench.run_to(118);
    assert!(bench.world(0).0.abs() > 1e-6);
    bench.run_to(120);
    assert!(bench.world(0).0.abs() < 1e-12);
    // It comes back stopped, and stays so until somebody resets: then it is moved again.
    bench.run_to(320);
    assert!(bench.world(0).0.abs() < 1e-12 && bench.trouble(0).is_none());
    bench.reset();
    assert_eq!(bench.run_to(321), TickResult::Ran);
    assert!(bench.world(0).0.abs() > 1e-3);
    assert_eq!(bench.run_to(1300), TickResult::Ran);
    assert!((bench.shows(types::POSITION, 0) - 0.05).abs() < 1e-4);
}

/// The controller is away for longer than the drives' timeout, and comes back in the middle of its scheme.
#[test]
fn a_controller_that_stops_is_noticed_by_the_drives() {
    let mut bench = Bench::new("missing_ticks = 254\nabsent = [{ from_s = 0.0095, until_s = 0.0495 }]");
    bench.run_to(28);
    let (torque_nm, _) = bench.world(0);
    assert!(torque_nm.abs() > 0.1, "held for 20 ms: {torque_nm}");
    bench.run_to(30);
    assert!(bench.world(0).0.abs() < 1e-12 && bench.world(1).0.abs() < 1e-12);
    // The first reply after it, to frame 50, is read in tick 51.
    assert_eq!(
        (bench.run_to(51), bench.trouble(0)),
        (TickResult::Ran, Some(MoteusJointFault::UnexpectedMode(MoteusMode::Timeout)))
    );
    assert!(matches!(bench.run_to(52), TickResult::MeasurementRefused(_)));
    assert!(bench.world(0).0.abs() < 1e-12);
    bench.run_to(60);
    bench.reset();
    assert_eq!(bench.run_to(1200), TickResult::Ran);
    assert!((bench.shows(types::POSITION, 0) - 0.05).abs() < 1e-4);
}

/// With few ticks of patience the controller has stopped itself before it comes back.
#[test]
fn replies_that_do_not_come_stop_the_scheme_before_the_drives_do() {
    let mut bench = Bench::new("absent = [{ from_s = 0.0095, until_s = 0.0495 }]");
    assert!(matches!(bench.run_to(14), TickResult::MeasurementRefused(_)));
    assert_eq!(
        (bench.trouble(0), bench.trouble(1)),
        (Some(MoteusJointFault::Silent), Some(MoteusJointFault::Silent))
    );
    bench.run_to(60);
    assert_eq!(bench.reason(), SafetyReason::MeasurementRefused);
    assert_eq!(bench.trouble(0), None, "drives that timed out are stopped, and so as good as new");
}

#[test]
fn a_fault_is_named_and_stops_all_joints_until_it_is_cleared_by_the_next_start() {
    let mut bench = Bench::new("fault = [{ axis = 1, at_s = 0.02, number = 38 }]");
    assert_eq!((bench.run_to(20), bench.trouble(1)), (TickResult::Ran, None));
    assert_eq!(bench.run_to(21), TickResult::Ran);
    let trouble = bench.trouble(1).unwrap();
    assert_eq!(trouble.to_string(), "overtemperature (38)");
    assert!(trouble.remedy().contains("cool"));
    assert!(matches!(bench.run_to(22), TickResult::MeasurementRefused(_)));
    assert!(bench.world(0).0.abs() < 1e-12 && bench.world(1).0.abs() < 1e-12);
    // It is off, moves freely, and its fault stays to be seen.
    let (_, speed) = bench.world(0);
    assert!(speed.abs() > 1e-2);
    bench.run_to(200);
    assert_eq!(bench.trouble(1), Some(trouble));
    assert_eq!(bench.reason(), SafetyReason::MeasurementRefused);
    assert!(bench.world(0).1.to_bits() == speed.to_bits(), "nothing brakes it");
    bench.reset();
    assert_eq!(bench.run_to(201), TickResult::Ran);
    assert_eq!(bench.run_to(203), TickResult::Ran);
    assert_eq!(bench.trouble(1), None);
    assert_eq!(bench.run_to(1200), TickResult::Ran);
    assert!((bench.shows(types::POSITION, 0) - 0.05).abs() < 1e-4);
}

/// A bus that damages frames sends them again: a tick has room for some.
#[test]
fn a_bus_with_bit_errors_delays_frames_and_the_joint_still_gets_there() {
    let mut bench = Bench::new("bit_error_rate = 2e-4");
    assert_eq!(bench.run_to(1000), TickResult::Ran);
    assert!((bench.shows(types::POSITION, 0) - 0.05).abs() < 1e-4);
}

#[test]
fn a_run_that_a_drive_ends_says_which_one_and_what_to_do() {
    let file = read(&text("fault = [{ axis = 1, at_s = 0.02, number = 40 }]", &step(0, 0.05)));
    let outcome = run(&file).unwrap().outcome;
    assert!(!outcome.stable);
    let said = outcome.faults.join("\n");
    assert!(said.contains("drive of axis 1") && said.contains("undervoltage (40)"), "{said}");
    assert!(said.contains("check supply, fuse and wiring under load"), "{said}");
}
