//! A live rig: forces within the motors' limits, and references that never jump.
#![expect(
    clippy::unwrap_used,
    clippy::panic,
    clippy::indexing_slicing,
    clippy::float_cmp,
    reason = "in helpers of tests as in tests"
)]

use std::path::PathBuf;

use dimsart_core::{Command, TickResult, types};
use dimsart_link::protocol::{LeaseAction, MAX_FRAME_BYTES, Request, encode_request, request_id};
use hil_sim::pipe::Pipe;
use hil_sim::response::{Held, LiveRig, ReferenceOverride};
use hil_sim::rig_file::ControllerAxes;
use hil_sim::rig_file::{MoveSection, RigFile, SHIPPED};
use std::io::Write;

/// Ticks from one renewal of the lease to the next one.
const RENEWAL_TICKS: u64 = 50;
/// Rounding of an `f32`.
const SHARE: f64 = 1.000_001;

/// A live rig whose controllers are armed and disarmed, and what is checked of it in every tick.
struct Bench {
    file: RigFile,
    live: LiveRig,
    lines: Vec<(String, Pipe)>,
    are_armed: bool,
    ticks: u64,
    axes: Vec<Axis>,
}

/// An axis of a station.
struct Axis {
    station: usize,
    axis: usize,
    max_force: f64,
    reference: Option<Reference>,
}

struct Reference {
    place: usize,
    /// Place of the measured position, where the device has one.
    position: Option<usize>,
    max_change: f64,
    step: f64,
    last: Option<f64>,
    steps: usize,
}

impl Bench {
    fn new(name: &str, sets: &[&str]) -> Self {
        let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
        let file = RigFile::read(RigFile::shipped(name).unwrap(), name, PathBuf::new(), &sets).unwrap();
        let (live, lines) = LiveRig::new(&file).unwrap();
        let mut axes = Vec::new();
        for (station, part) in ControllerAxes::all(&file).iter().enumerate() {
            for (axis, of_device) in part.axes.iter().copied().enumerate() {
                let place = |name: &str| {
                    let row = part.device.measures.iter().position(|measured| measured == name);
                    row.map(|row| row * part.axes.len() + axis)
                };
                let moves = file.experiment.moves.iter().filter(|moved| {
                    moved.moves(&part.device.name, types::DES_POSITION.name) && moved.axis == of_device
                });
                let (rate, step) = moves.map(rate_and_step).fold((1.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
                let reference = place(types::DES_POSITION.name).map(|place_of_reference| Reference {
                    place: place_of_reference,
                    position: place(types::POSITION.name),
                    max_change: rate * file.sample_period_s,
                    step,
                    last: None,
                    steps: 0,
                });
                let max_force = part.device.max_force(of_device);
                axes.push(Axis { station, axis, max_force, reference });
            }
        }
        Self { file, live, lines, are_armed: false, ticks: 0, axes }
    }

    fn lease(&mut self, action: LeaseAction) {
        let mut frame = [0; MAX_FRAME_BYTES];
        let bytes = encode_request(&Request::Lease(action), request_id(1, 1), &mut frame).unwrap();
        self.lines.iter_mut().for_each(|(_, line)| line.write_all(bytes).unwrap());
    }

    fn arm(&mut self) {
        self.lease(LeaseAction::Take);
        self.are_armed = true;
    }

    fn disarm(&mut self) {
        self.lease(LeaseAction::Release);
        self.are_armed = false;
    }

    /// Gives the largest force over the limit of its axis.
    fn run(&mut self, time_s: f64) -> f64 {
        let mut largest = 0.0_f64;
        let end_s = self.live.rig_mut().time_s() + time_s - 0.5 * self.file.sample_period_s;
        while self.live.rig_mut().time_s() < end_s {
            if self.are_armed && self.ticks.is_multiple_of(RENEWAL_TICKS) {
                self.lease(LeaseAction::Renew);
            }
            self.ticks += 1;
            self.live.step(0, |news| panic!("{news}"));
            let at = format!("tick {}", self.ticks);
            for axis in &mut self.axes {
                let station = &self.live.rig_mut().stations()[axis.station];
                let force = f64::from(station.command().get(axis.axis).copied().unwrap_or_default());
                let share = force.abs() / axis.max_force;
                assert!(share <= SHARE, "{}, axis {}, {at}: {force}", station.name, axis.axis);
                largest = largest.max(share);
                let Some(reference) = &mut axis.reference else { continue };
                let now = f64::from(station.entry_value(reference.place).unwrap());
                let is_commanded = station.last_tick == TickResult::Ran;
                match reference.last {
                    _ if !is_commanded => {}
                    // Armed in this tick.
                    None => {
                        let position = reference.position.and_then(|place| station.entry_value(place));
                        let is_at_it = position.is_none_or(|position| f64::from(position) == now);
                        assert!(is_at_it, "{}, {at}: {now} at {position:?}", station.name);
                    }
                    Some(last) => {
                        let change = (now - last).abs();
                        if change > SHARE * reference.max_change + 1e-6 {
                            reference.steps += 1;
                            assert!(change <= reference.step + reference.max_change, "{at}: {last} to {now}");
                        }
                    }
                }
                reference.last = is_commanded.then_some(now);
            }
        }
        largest
    }

    fn steps(&self) -> usize {
        self.axes
            .iter()
            .filter_map(|axis| axis.reference.as_ref())
            .map(|found| found.steps)
            .max()
            .unwrap_or(0)
    }

    fn are_commanded(&mut self) -> bool {
        let mut stations = self.live.rig_mut().stations().iter();
        stations.all(|station| station.last_tick == TickResult::Ran)
    }
}

/// Largest speed of a move, and the size of its step.
fn rate_and_step(moved: &MoveSection) -> (f64, f64) {
    let tau = std::f64::consts::TAU;
    if let Some(step) = &moved.step {
        return (0.0, step.amplitude.abs());
    }
    let ramp = moved.ramp.iter().map(|ramp| ramp.amplitude.abs() / (ramp.until_s - ramp.at_s));
    let jerk = moved.minimum_jerk.iter().map(|of| 1.875 * of.amplitude.abs() / (of.until_s - of.at_s));
    let sine = moved.sine.iter().map(|sine| tau * sine.frequency_hz * sine.amplitude);
    let chirp = moved.chirp.iter().map(|chirp| tau * chirp.from_hz.max(chirp.to_hz) * chirp.amplitude);
    let rates: Vec<f64> = ramp.chain(jerk).chain(sine).chain(chirp).collect();
    assert_eq!(rates.len(), 1, "give this form of a move its largest speed: {moved:?}");
    (rates[0], 0.0)
}

/// Time of three repetitions, with their returns.
fn three_times_s(file: &RigFile) -> f64 {
    3.0 * (file.duration_s + 2.0) + 4.0
}

/// `serve arm` commanded 10 000 N·m whenever the experiment repeated, and 3703 N·m when it was armed after it had fallen.
#[test]
fn every_shipped_rig_stays_within_its_motors_and_its_references_do_not_jump() {
    for (name, _) in SHIPPED {
        // Thirty seconds of a chirp are no other than five.
        let sets: &[&str] =
            if name.starts_with("identify") || name == "bilateral" { &["duration_s=5.0"] } else { &[] };
        let mut bench = Bench::new(name, sets);
        // A rig without references repeats what hands do.
        let has_references = bench.axes.iter().any(|axis| axis.reference.is_some());
        bench.arm();
        let armed =
            bench.run(if has_references { three_times_s(&bench.file) } else { bench.file.duration_s });
        assert!(bench.are_commanded(), "{name} is not armed");
        let steps = bench.steps();
        bench.disarm();
        let fallen = bench.run(2.0);
        bench.arm();
        let rearmed = bench.run(3.0);
        assert!(bench.are_commanded(), "{name} is not armed again");
        println!(
            "{name}: {armed:.3} of the limit, {fallen:.3} disarmed, {rearmed:.3} armed again; {steps} steps"
        );
        let has_step =
            bench.axes.iter().filter_map(|axis| axis.reference.as_ref()).any(|found| found.step > 0.0);
        assert_eq!(steps >= 3, has_step, "{name}: {steps} steps");

        let mut bench = Bench::new(name, sets);
        bench.run(2.0);
        bench.arm();
        let fallen = bench.run(3.0);
        println!("{name}: {fallen:.3} of the limit, armed after 2 s");
    }
}

/// The loads of the experiment pushed a joint against its stop before it was armed.
#[test]
fn the_experiment_waits_until_every_controller_is_armed() {
    let mut bench = Bench::new("joint", &[]);
    bench.run(5.0);
    let position = bench.live.rig_mut().stations()[0].position()[0];
    assert!(position.abs() < 1e-3, "{position} rad");
}

#[test]
fn a_reset_joins_buses_that_the_controllers_have_given_up() {
    let mut bench = Bench::new("arm_bus", &["bus.bus.can_fd.bit_error_rate=1", "bus.bus.can_fd.rejoins=1"]);
    let bus_offs = |bench: &mut Bench| bench.live.rig_mut().media()[0].traffic.bus_offs;
    bench.run(1.0);
    let given_up = bus_offs(&mut bench);
    bench.run(1.0);
    assert_eq!(bus_offs(&mut bench), given_up);
    let mut frame = [0; MAX_FRAME_BYTES];
    let reset = encode_request(&Request::Command(Command::Reset), request_id(1, 1), &mut frame).unwrap();
    bench.lines.iter_mut().for_each(|(_, line)| line.write_all(reset).unwrap());
    bench.run(1.0);
    assert_eq!(bus_offs(&mut bench), 2 * given_up);
    assert!(given_up > 0);
}

#[test]
fn what_can_be_held_is_known_by_name() {
    let file = RigFile::read(RigFile::shipped("joint").unwrap(), "joint", PathBuf::new(), &[]).unwrap();
    let (live, _lines) = LiveRig::new(&file).unwrap();
    assert_eq!(live.references(0), ["DES_POSITION[0]"]);
}

/// The bench checks in every tick that the reference does not jump.
#[test]
fn a_preset_and_an_excitation_start_and_end_without_a_jump() {
    let mut bench = Bench::new("joint", &["experiment.move.0.step.amplitude=0"]);
    let hand = bench.live.reference_overrides();
    let hold = |held| {
        hand.send(ReferenceOverride { station: 0, signal: "DES_POSITION".to_owned(), axis: 0, held })
            .unwrap();
    };
    bench.arm();
    bench.run(1.5);
    // An excitation that interrupts an approach starts where the reference is.
    hold(Held::GoTo(1.2));
    bench.run(0.5);
    hold(Held::Excited("chirp 0.05 0.5 0.5 0.5".parse().unwrap()));
    bench.run(1.0);
    hold(Held::GoTo(1.2));
    bench.run(2.5);
    let position = |bench: &mut Bench| bench.live.rig_mut().stations()[0].position()[0];
    assert!((position(&mut bench) - 1.2).abs() < 0.02, "{}", position(&mut bench));
    // At most 2 pi * 0.5 Hz * 0.3 rad = 0.94 rad/s, and the load of the experiment acts meanwhile.
    hold(Held::Excited("chirp 0.3 0.1 0.5 4".parse().unwrap()));
    let (mut least, mut greatest) = (f32::INFINITY, f32::NEG_INFINITY);
    for _ in 0..40 {
        bench.run(0.1);
        (least, greatest) = (least.min(position(&mut bench)), greatest.max(position(&mut bench)));
    }
    assert!(least < 1.0 && greatest > 1.4, "{least} {greatest}");
    bench.run(3.0);
    assert!(position(&mut bench).abs() < 0.05, "{}", position(&mut bench));
}

#[test]
fn a_user_moves_the_hand_of_a_disarmed_master() {
    let mut bench = Bench::new("telerobot", &[]);
    assert_eq!(bench.live.references(0), ["hand[0]"]);
    let hand = bench.live.reference_overrides();
    let hold = |held| {
        hand.send(ReferenceOverride { station: 0, signal: "hand".to_owned(), axis: 0, held }).unwrap();
    };
    hold(Held::At(0.08));
    bench.run(4.0);
    let position = |bench: &mut Bench| bench.live.rig_mut().stations()[0].position()[0];
    assert!((position(&mut bench) - 0.08).abs() < 0.002, "{}", position(&mut bench));
    hold(Held::Released);
    bench.run(4.0);
    assert!(position(&mut bench).abs() < 0.002, "{}", position(&mut bench));
}

/// A STOP during an excitation, and the next client finds the joint moving by itself: it must not.
#[test]
fn after_disarming_no_reference_is_held_or_excited() {
    for held in [Held::At(1.0), Held::GoTo(1.0), Held::Excited("chirp 0.5 0.2 0.2 30".parse().unwrap())] {
        let mut bench = Bench::new("joint", &["experiment.move.0.step.amplitude=0"]);
        let hand = bench.live.reference_overrides();
        bench.arm();
        bench.run(1.5);
        let signal = "DES_POSITION".to_owned();
        bench.disarm();
        bench.run(0.3);
        hand.send(ReferenceOverride { station: 0, signal, axis: 0, held }).unwrap();
        bench.run(0.3);
        // The approach from where the load has moved the joint takes 6 s.
        bench.arm();
        bench.run(8.0);
        let position = bench.live.rig_mut().stations()[0].position()[0];
        assert!(position.abs() < 0.1, "{held:?}: {position}");
    }
}
