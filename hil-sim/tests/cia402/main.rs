//! Devices whose joints are drives of CiA 402 behind a CAN bus: what a scheme sees, and what the joints do.
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "in helpers of tests as in tests")]

use std::path::PathBuf;

use dimsart_core::{Command, DataType, SafetyReason, TickResult, types};
use drive::{Cia402Emergency, Cia402JointFault, JointFault};
use hil_sim::experiment::{Experiment, run};
use hil_sim::rig::{Probe, Rig};
use hil_sim::rig_file::RigFile;

/// Two inertias with drives, under a PD scheme, without margins; `cia402` are lines of the drives' section.
fn text(cia402: &str) -> String {
    format!(
        r#"
        duration_s = 1.0
        [[device]]
        name = "robot"
        measures = ["POSITION", "VELOCITY", "MEASURED_TORQUE", "BUS_VOLTAGE", "DRIVE_FAULT", "DES_POSITION"]
        [device.cia402]
        nodes = [1, 2]
        gear_ratio = 10
        rated_torque_nm = 0.3
        {cia402}
        [[device.axis]]
        plant.load.inertia = 0.03
        [[device.axis]]
        plant.load.inertia = 0.03
        [[controller]]
        device = "robot"
        scheme = "builtin:moteus"
        [experiment]
        margins = false
        [[experiment.move]]
        device = "robot"
        on = "DES_POSITION"
        step = {{ at_s = 0.05, amplitude = 0.05 }}
        "#
    )
}

fn read(text: &str) -> RigFile {
    RigFile::read(text, "test", PathBuf::new(), &[]).unwrap()
}

/// A rig that is looked at between ticks.
struct Bench(Experiment);

impl Bench {
    fn new(cia402: &str) -> Self {
        Self(Experiment::new(&read(&text(cia402))).unwrap())
    }

    fn rig(&mut self) -> &mut Rig {
        self.0.rig_mut()
    }

    /// Runs to the end of tick `tick`, and says what came of it.
    fn run_to(&mut self, tick: u64) -> TickResult {
        while self.rig().ticks() <= tick {
            self.rig().step();
        }
        self.rig().stations()[0].last_tick
    }

    /// The signals of an axis in the Data Base.
    fn shows(&mut self, data_type: &'static DataType, axis: usize) -> f64 {
        Probe::new(data_type.first()).values(&self.rig().stations()[0]).nth(axis).unwrap()
    }

    fn trouble(&mut self, axis: usize) -> Option<Cia402JointFault> {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a whole number")]
        let number = self.shows(types::DRIVE_FAULT, axis) as u32;
        Cia402JointFault::from_number(number)
    }

    /// In truth, `N m`.
    fn torque_nm(&mut self, axis: usize) -> f64 {
        let mut values = [0.0; 8];
        self.rig().stations()[0].plant.read_quantities(axis, &mut values);
        values[2]
    }

    /// What went wrong is over: `reset` is all that it takes until the joint is where it should be.
    fn gets_there_after_a_reset(mut self) {
        assert_eq!(self.rig().stations()[0].dimsart.safety().reason(), SafetyReason::MeasurementRefused);
        assert!(self.torque_nm(0).abs() < 1e-12 && self.torque_nm(1).abs() < 1e-12);
        self.rig().stations_mut()[0].dimsart.command(Command::Reset).unwrap();
        let tick = self.rig().ticks();
        assert_eq!(self.run_to(tick + 1000), TickResult::Ran);
        assert_eq!(self.trouble(0).or(self.trouble(1)), None);
        assert!((self.shows(types::POSITION, 0) - 0.05).abs() < 1e-4);
    }
}

fn is_refused(tick: TickResult) -> bool {
    matches!(tick, TickResult::MeasurementRefused(_))
}

fn emergency(code: u16) -> Option<Cia402JointFault> {
    Cia402Emergency::from_code(code).map(Cia402JointFault::Emergency)
}

/// A pendulum hangs `m g l sin(x) / K` below where it is wanted.
#[test]
fn the_shipped_rig_runs_and_its_pendulum_hangs_as_much_lower_as_its_weight_says() {
    let file = RigFile::read(RigFile::shipped("cia402").unwrap(), "cia402", PathBuf::new(), &[]).unwrap();
    let run = run(&file).unwrap();
    assert!(run.outcome.stable && run.outcome.faults.is_empty(), "{:?}", run.outcome.faults);
    let last = |signal: &str, axis| {
        let place = run.recording.find("robot", signal, Some(axis)).unwrap();
        run.recording.column(place).last().unwrap()
    };
    let position = last("POSITION", 0);
    let weight = 1.5 * position.sin();
    // A count more or less, by which the damper sees a motion; and half a thousandth of 3 N m.
    let coarse = 1.2 / 1e-3 * core::f64::consts::TAU / 655_360.0 + 1.5e-3;
    assert!((30.0 * (0.8 - position) - weight).abs() < coarse, "{position}");
    assert!((last("MEASURED_TORQUE", 0) - weight).abs() < 2.0 * coarse);
    assert!((last("POSITION", 1) - (0.05 - 1.0 / 30.0)).abs() < 2e-4);
    assert!((last("BUS_VOLTAGE", 1) - 48.0).abs() < 1e-3 && last("DRIVE_FAULT", 0).abs() < 1e-9);
}

/// A torque comes of where the joint was exactly a tick ago, by SYNC, and is held for a tick.
#[test]
fn a_joint_moves_as_its_difference_equations_say() {
    // No heartbeat of a drive comes before SYNC: there is none within the run.
    let run = run(&read(&text("timeout_s = 8.0"))).unwrap();
    assert!(run.outcome.stable, "{:?}", run.outcome);
    let place = run.recording.find("robot", "POSITION", Some(0)).unwrap();
    let positions: Vec<f64> = run.recording.column(place).collect();
    let (mut expected, mut x, mut v, mut fastest) = (vec![0.0], 0.0, 0.0_f64, 0.0_f64);
    for tick in 0..positions.len() {
        let target = |tick: usize| if tick >= 50 { 0.05 } else { 0.0 };
        let error = |tick: usize| target(tick) - expected[tick];
        let torque: f64 = 30.0 * error(tick) + 1.2 * (error(tick) - error(tick.saturating_sub(1))) / 1e-3;
        // A drive of 3 N m makes three times as much.
        let torque = torque.clamp(-9.0, 9.0);
        expected.push(x);
        x += 1e-3 * v + 0.5e-6 * torque / 0.03;
        v += 1e-3 * torque / 0.03;
        fastest = fastest.max(v.abs());
    }
    assert!(fastest > 0.2, "{fastest}");
    for (tick, (position, expected)) in positions.iter().zip(&expected).enumerate() {
        // Half a thousandth of 3 N m against the stiffness, and a count of what is read.
        let coarse = 1.5e-3 / 30.0 + core::f64::consts::TAU / 655_360.0;
        assert!((position - expected).abs() < coarse, "{tick}: {position} {expected}");
    }
}

#[test]
fn a_fault_is_named_and_stops_all_joints_until_the_next_start_resets_it() {
    let mut bench = Bench::new("fault = [{ axis = 1, at_s = 0.06, number = 0x4310 }]");
    assert_eq!((bench.run_to(60), bench.trouble(1)), (TickResult::Ran, None));
    assert!(bench.torque_nm(0).abs() > 1e-3);
    assert_eq!((bench.run_to(61), bench.trouble(1)), (TickResult::Ran, emergency(0x4310)));
    assert!(is_refused(bench.run_to(62)));
    // By the next SYNC.
    bench.run_to(63);
    assert!(bench.torque_nm(0).abs() < 1e-12 && bench.torque_nm(1).abs() < 1e-12);
    bench.run_to(200);
    assert_eq!(bench.trouble(1), emergency(0x4310), "it stays to be seen");
    bench.gets_there_after_a_reset();
}

#[test]
fn a_drive_that_leaves_the_bus_is_named_turns_itself_off_and_is_set_up_anew() {
    let mut bench = Bench::new("absent = [{ axis = 0, from_s = 0.0595, until_s = 0.1995 }]");
    assert_eq!((bench.run_to(62), bench.trouble(0)), (TickResult::Ran, None));
    assert_eq!((bench.run_to(63), bench.trouble(0)), (TickResult::Ran, Some(Cia402JointFault::Silent)));
    assert!(is_refused(bench.run_to(64)));
    // It holds its torque until no heartbeat has come for 20 ms; the last one was at most 5 ms before.
    bench.run_to(73);
    assert!(bench.torque_nm(0).abs() > 1e-6 && bench.torque_nm(1).abs() < 1e-12);
    bench.run_to(80);
    assert!(bench.torque_nm(0).abs() < 1e-12);
    bench.run_to(500);
    bench.gets_there_after_a_reset();
}

#[test]
fn a_controller_that_stops_is_noticed_by_the_drives() {
    let mut bench = Bench::new("missing_ticks = 254\nabsent = [{ from_s = 0.0595, until_s = 0.1095 }]");
    bench.run_to(73);
    assert!(bench.torque_nm(0).abs() > 1e-3);
    bench.run_to(80);
    assert!(bench.torque_nm(0).abs() < 1e-12);
    bench.run_to(500);
    bench.gets_there_after_a_reset();
}

#[test]
fn a_lost_frame_is_bridged_and_bit_errors_delay() {
    for cia402 in ["absent = [{ axis = 0, from_s = 0.0595, until_s = 0.0605 }]", "bit_error_rate = 2e-4"] {
        let mut bench = Bench::new(cia402);
        assert_eq!(bench.run_to(1000), TickResult::Ran, "{cia402}");
        assert!((bench.shows(types::POSITION, 0) - 0.05).abs() < 1e-4, "{cia402}");
    }
}

#[test]
fn a_run_that_a_drive_ends_says_which_one_and_what_to_do() {
    let file = read(&text("fault = [{ axis = 1, at_s = 0.06, number = 0x3220 }]"));
    let outcome = run(&file).unwrap().outcome;
    let said = outcome.faults.join("\n");
    assert!(!outcome.stable && said.contains("drive of axis 1: undervoltage (0x3220)"), "{said}");
    assert!(said.contains("check supply, fuse and wiring under load"), "{said}");
    let number = u32::from(JointFault::Cia402(emergency(0x3220).unwrap()));
    assert_eq!(JointFault::from_number(number).map(u32::from), Some(0x3220));
}

#[test]
fn what_is_wrong_with_drives_is_named() {
    for (was, is, said) in [
        ("nodes = [1, 2]", "nodes = [1]", "`nodes` has 1 entries"),
        ("nodes = [1, 2]", "nodes = [1, 1]", "duplicate node id 1:"),
        ("nodes = [1, 2]", "nodes = [1, 127]", "duplicate node id 127:"),
        ("nodes = [1, 2]", "nodes = [0, 2]", "node id 0 is out of range, must be 1 to 127"),
        ("gear_ratio = 10", "gear_ratio = 0", "gear_ratio is 0"),
        ("gear_ratio = 10", "timeout_s = 0.001", "timeout_s is 0.001"),
        ("gear_ratio = 10", "counts_per_turn = 0", "counts_per_turn is 0"),
        ("gear_ratio = 10", "bit_error_rate = 2.0", "bit_error_rate is 2"),
        ("gear_ratio = 10", "gears = 10", "gears"),
        ("\"BUS_VOLTAGE\"", "\"TEMPERATURE\"", "which its drives do not report"),
        ("[device.cia402]", "moteus = { ids = [1, 2] }\n[device.cia402]", "both moteus and cia402 drives"),
    ] {
        let text = text("").replacen(was, is, 1);
        let found = RigFile::read(&text, "my.toml", PathBuf::new(), &[]).unwrap_err().to_string();
        assert!(found.contains(said), "{is}: {found}");
    }
}
