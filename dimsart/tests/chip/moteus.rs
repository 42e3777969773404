//! The image for moteus drives of mjbots, and three drives on its bus.
//!
//! ```text
//! command line ──▶ board ◀── CAN FD at 1 and 5 Mbit/s ──▶ adapter ──▶ three drives ──▶ joints of an inertia
//! ```

use chips::{Bench, Board, CanAdapter, CanBus, FrameResult, OnBench};
use cycles::machine::MachineError;
use dimsart::connect::Device;
use hil_sim::plant::{Joint, JointParameters, MoteusDrive};
use hil_sim::schemes::SchemeText;

use crate::common::{CommandLine, Shared, image};

const BOARD: usize = 0;
const ADAPTER: usize = 1;
/// From `boards/src/catalogue/nucleo_g474re.rs`.
const IDS: [u8; 3] = [1, 2, 3];
const MAX_TORQUE_NM: f64 = 1.0;
const INERTIA_KG_M2: f64 = 0.01;
/// Polling interval of the bus: shorter than a frame.
const STEP_S: f64 = 50e-6;
const COMMANDED_NM: [f64; 3] = [0.2, 0.1, -0.05];

/// The board and its bus.
struct World {
    bus: CanBus,
    adapter: CanAdapter,
    axes: Vec<(MoteusDrive, Joint)>,
    /// Connected drives.
    is_plugged: [bool; 3],
    time_s: f64,
}

impl World {
    fn start() -> Option<Shared<Self>> {
        let board =
            Bench::new(Board::find("nucleo-g474re").unwrap(), image("nucleo-g474re-moteus")?).unwrap();
        let adapter = CanAdapter::bench(board.board).unwrap();
        let axis = |id| {
            let joint = JointParameters::of_inertia(INERTIA_KG_M2).build().unwrap();
            (MoteusDrive::new(id, MAX_TORQUE_NM), joint)
        };
        let mut world = Self {
            bus: CanBus::new(vec![board, adapter]),
            adapter: CanAdapter::default(),
            axes: IDS.map(axis).into(),
            is_plugged: [true; 3],
            time_s: 0.0,
        };
        // Runs until the board's controller is configured, then configures the adapter's controller equally.
        world.bus.run_for(20e-3).unwrap();
        let timing = CanAdapter::timing(world.bench()).unwrap();
        CanAdapter::join(world.bus.bench(ADAPTER).unwrap(), timing).unwrap();
        world.run_for(100e-3).unwrap();
        Some(Shared::of(world))
    }

    fn step(&mut self) -> Result<(), MachineError> {
        self.bus.run_for(STEP_S)?;
        let adapter = self.bus.bench(ADAPTER).unwrap();
        while let Some((identifier, bytes)) = CanAdapter::take(adapter).unwrap() {
            for ((drive, _), _) in
                self.axes.iter_mut().zip(self.is_plugged).filter(|(_, is_plugged)| *is_plugged)
            {
                if let Some((reply, bytes)) = drive.receive(identifier, &bytes) {
                    self.adapter.send(reply, bytes);
                }
            }
        }
        self.adapter.flush(adapter).unwrap();
        for (drive, joint) in &mut self.axes {
            joint.advance(self.time_s, STEP_S, drive.torque_nm(), &|_| 0.0);
            drive.set_state(joint.state().position, joint.state().velocity);
            drive.advance(STEP_S);
        }
        self.time_s += STEP_S;
        Ok(())
    }

    fn torques_nm(&self) -> Vec<f64> {
        self.axes.iter().map(|(drive, _)| drive.torque_nm()).collect()
    }
}

impl OnBench for World {
    fn bench(&mut self) -> &mut Bench {
        self.bus.bench(BOARD).unwrap()
    }

    fn run_for(&mut self, duration_s: f64) -> Result<(), MachineError> {
        let end_s = self.time_s + duration_s - 0.5 * STEP_S;
        while self.time_s < end_s {
            self.step()?;
        }
        Ok(())
    }
}

/// A scheme that commands a constant force, with motion enabled.
fn drive(shared: &Shared<World>) -> Device<CommandLine<World>> {
    let mut device = shared.identify();
    let scheme = SchemeText::read("../schemes/first_start.scheme").unwrap();
    device.send_scheme(&scheme, "master").unwrap();
    for (axis, torque_nm) in COMMANDED_NM.iter().enumerate() {
        device.set("SIGGEN_MOD", &format!("AMPLITUDE[{axis}]"), &torque_nm.to_string()).unwrap();
    }
    device.take_lease().unwrap();
    device
}

fn run(shared: &Shared<World>, device: &mut Device<CommandLine<World>>, duration_s: f64) {
    let end_s = shared.bench().time_s + duration_s;
    while shared.bench().time_s < end_s {
        shared.run_for(50e-3);
        device.renew_lease().unwrap();
    }
}

#[test]
fn three_drives_follow_what_the_scheme_commands() {
    let Some(shared) = World::start() else { return };
    let mut device = drive(&shared);
    run(&shared, &mut device, 0.1);
    shared.bench().bus.take_frames();
    let before: Vec<_> = shared.bench().axes.iter().map(|(_, joint)| joint.state()).collect();
    let begin_s = shared.bench().time_s;
    run(&shared, &mut device, 0.3);
    let world = shared.bench();
    let duration_s = world.time_s - begin_s;
    for ((before, (drive, joint)), commanded_nm) in before.iter().zip(&world.axes).zip(COMMANDED_NM) {
        assert!((drive.torque_nm() - commanded_nm).abs() < 1e-6, "{} N m", drive.torque_nm());
        let turned_rad =
            before.velocity * duration_s + 0.5 * commanded_nm / INERTIA_KG_M2 * duration_s * duration_s;
        let error_rad = joint.state().position - before.position - turned_rad;
        assert!(error_rad.abs() < 1e-6 * turned_rad.abs(), "{error_rad} of {turned_rad} rad");
    }
    let positions: Vec<f64> = world.axes.iter().map(|(_, joint)| joint.state().position).collect();
    let velocities: Vec<f64> = world.axes.iter().map(|(_, joint)| joint.state().velocity).collect();
    drop(world);
    // The board's values are at most a tick, an exchange and an answer old.
    let said = device.signals(&["POSITION".to_owned()]).unwrap();
    for ((said, position_rad), velocity) in said[0].values.iter().zip(positions).zip(velocities) {
        let late_rad = 5e-3 * velocity.abs();
        let said: f64 = said.to_string().parse().unwrap();
        assert!((said - position_rad).abs() < late_rad, "{said} instead of {position_rad} rad");
    }
    let mut world = shared.bench();
    let passed = world.bus.take_frames();
    assert!(
        passed.iter().all(|frame| frame.result == FrameResult::Acknowledged && frame.message.switches_rate)
    );
    for node in [BOARD, ADAPTER] {
        let frames = passed.iter().filter(|frame| frame.sender == node).count() as f64;
        let expected = 3.0 * (world.time_s - begin_s) / 1e-3;
        assert!((frames - expected).abs() <= 6.0, "{frames} frames of node {node} instead of {expected}");
    }
    drop(world);
    shared.assert_sound();
}

#[test]
fn a_lease_that_ends_takes_the_torque_away() {
    let Some(shared) = World::start() else { return };
    let mut device = drive(&shared);
    run(&shared, &mut device, 0.1);
    assert!(shared.bench().torques_nm().iter().all(|torque_nm| torque_nm.abs() > 0.04));
    // 200 ms, and 10 ms from the maximum torque to 0.
    shared.run_for(0.25);
    assert_eq!(shared.bench().torques_nm(), [0.0; 3]);
    shared.assert_sound();
}

#[test]
fn a_drive_that_is_unplugged_stops_all_of_them_and_says_which_it_was() {
    let Some(shared) = World::start() else { return };
    let mut device = drive(&shared);
    run(&shared, &mut device, 0.1);
    shared.bench().is_plugged[1] = false;
    // Three replies may be missing; a disconnected drive releases by itself after 20 ms.
    shared.run_for(25e-3);
    assert_eq!(shared.bench().torques_nm(), [0.0; 3]);
    let faults = device.faults().unwrap().to_string();
    println!("{faults}");
    assert!(faults.contains("axis 1: drive gone (reason 68)"), "{faults}");

    shared.bench().is_plugged[1] = true;
    shared.run_for(50e-3);
    device.reset(None).unwrap();
    device.take_lease().unwrap();
    run(&shared, &mut device, 0.1);
    for (torque_nm, commanded_nm) in shared.bench().torques_nm().iter().zip(COMMANDED_NM) {
        assert!((torque_nm - commanded_nm).abs() < 1e-6, "{torque_nm} N m");
    }
    shared.assert_sound();
}
