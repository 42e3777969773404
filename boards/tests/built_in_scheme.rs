//! Every board's built-in scheme with the board's motor: no chatter and no oscillation.
#![expect(clippy::unwrap_used, reason = "in helpers of tests as in tests")]

use std::f32::consts::TAU;

use boards::BOARDS;
use boards::catalogue::BoardInfo;
use boards::motor::Motor;
use dimsart_core::{
    AxisKind, DeviceDescriptor, Dimsart, ProvidedMemory, Scalar as _, TickResult, Word, scheme, types,
};
use dimsart_modules::ALL;

const SIDES: [&str; 2] = ["master", "slave"];
const TICK_S: f32 = 1e-3;
/// Maximum torque command per encoder count, relative to the maximum torque.
const MAX_PER_COUNT: f32 = 0.01;

fn boards_with_motors() -> impl Iterator<Item = (&'static BoardInfo, Motor)> {
    BOARDS.iter().filter_map(|board| Some((board, board.tooling.motor?)))
}

fn largest_torque_nm(motor: Motor) -> f32 {
    motor.torque_constant_nm_per_a * motor.max_current_a
}

/// Two boards, one per side, over a link with a delay of one tick.
struct Pair([Dimsart; 2]);

impl Pair {
    fn new(board: &BoardInfo) -> Self {
        Self(SIDES.map(|side| {
            let axes = [AxisKind::Rotary];
            let device =
                DeviceDescriptor::new(board.name, &axes, TICK_S, &[types::POSITION], &[types::DES_FORCE]);
            let mut dimsart = Dimsart::new(ProvidedMemory::leak_default(), device.unwrap(), ALL).unwrap();
            let mut faults = 0;
            scheme::load(board.tooling.scheme.text, side, &SIDES, &mut dimsart, |_| faults += 1);
            assert_eq!((faults, dimsart.engine().is_running()), (0, true), "{} {side}", board.name);
            dimsart
        }))
    }

    /// Returns the torques at these angles, `N·m` and `rad`.
    fn tick(&mut self, angles: [f32; 2]) -> [f32; 2] {
        let packets = self.0.each_mut().map(|dimsart| dimsart.take_outgoing(0));
        for (dimsart, packet) in self.0.iter_mut().zip(packets.into_iter().rev()) {
            let Some(packet) = packet else { continue };
            dimsart.receive_parsed(0, &Ok(packet)).unwrap();
        }
        let mut torques = [0.0; 2];
        for ((dimsart, torque), angle) in self.0.iter_mut().zip(&mut torques).zip(angles) {
            let mut commanded = [Word(0)];
            assert_eq!(dimsart.tick(&[angle.into_word()], &mut commanded), TickResult::Ran);
            *torque = f32::from_word(commanded[0]);
        }
        torques
    }
}

#[test]
fn one_count_of_the_encoder_asks_for_a_hundredth_of_the_motor_s_torque_at_most() {
    for (board, motor) in boards_with_motors() {
        let count = TAU / f32::from(motor.counts_per_turn);
        let most = MAX_PER_COUNT * largest_torque_nm(motor);
        for side in 0..SIDES.len() {
            // Stays there, or moves back and forth.
            for period in [u32::MAX, 2, 20] {
                let mut pair = Pair::new(board);
                let mut largest = 0f32;
                for tick in 0..2_000 {
                    let is_away = tick >= 100 && tick % period < period / 2;
                    let mut angles = [0.0; 2];
                    angles[side] = if is_away { count } else { 0.0 };
                    let torques = pair.tick(angles);
                    largest = torques.into_iter().fold(largest, |largest, torque| largest.max(torque.abs()));
                }
                let name = format!("{} {} {period}: {largest} of {most} N·m", board.name, SIDES[side]);
                assert!(largest <= most && largest > most / 10.0, "{name}");
            }
        }
    }
}

/// A motor with its shaft, driven by the board with a torque, or a voltage against the back-EMF.
#[derive(Debug, Clone, Copy)]
struct Shaft {
    motor: Motor,
    /// Friction of the joint of a torque-controlled motor, `N m s/rad`.
    damping: Option<f32>,
    inertia_kg_m2: f32,
    angle: f32,
    speed: f32,
}

impl Shaft {
    /// Returns the reading of the encoder.
    fn measured(&self) -> f32 {
        let counts = f32::from(self.motor.counts_per_turn);
        (self.angle / TAU * counts).floor() * (TAU / counts)
    }

    /// Runs a tick with a commanded and an external torque.
    fn turn(&mut self, commanded: f32, from_outside: f32) {
        const STEPS: u16 = 1_000;
        let Motor { torque_constant_nm_per_a, resistance_ohm, supply_v, .. } = self.motor;
        let voltage = self.motor.voltage_share(commanded) * supply_v;
        let max_nm = largest_torque_nm(self.motor);
        let step_s = TICK_S / f32::from(STEPS);
        for _ in 0..STEPS {
            let current = (voltage - torque_constant_nm_per_a * self.speed) / resistance_ohm;
            let made_nm = match self.damping {
                Some(damping) => (commanded - damping * self.speed).clamp(-max_nm, max_nm),
                None => torque_constant_nm_per_a * current,
            };
            let torque = made_nm + from_outside;
            self.speed += step_s * torque / self.inertia_kg_m2;
            self.angle += step_s * self.speed;
        }
    }
}

/// A hand turns the master with 10 % of the maximum torque for a second and releases it.
#[test]
fn a_pair_of_motors_follows_a_hand_and_comes_to_rest() {
    for (board, motor) in boards_with_motors() {
        for inertia_kg_m2 in [3e-6, 1e-5, 3e-5] {
            let mut pair = Pair::new(board);
            let damping = board.tooling.drive.map(|_| 0.05 * 0.05 / 0.6);
            let mut shafts = [Shaft { motor, damping, inertia_kg_m2, angle: 0.0, speed: 0.0 }; 2];
            let hand = 0.1 * largest_torque_nm(motor);
            for tick in 0..3_000 {
                let torques = pair.tick(shafts.map(|shaft| shaft.measured()));
                let from_outside = [if tick < 1_000 { hand } else { 0.0 }, 0.0];
                for ((shaft, torque), outside) in shafts.iter_mut().zip(torques).zip(from_outside) {
                    shaft.turn(torque, outside);
                }
                let [master, slave] = shafts;
                let apart = (master.angle - slave.angle).abs();
                let name = || format!("{}, {inertia_kg_m2} kg·m², {tick}: {master:?} {slave:?}", board.name);
                assert!(tick != 999 || (slave.angle > 1.0 && apart < 0.25), "{}", name());
                let speed = master.speed.abs().max(slave.speed.abs());
                assert!(tick != 2_999 || (apart < 0.01 && speed < 0.15), "{}", name());
            }
        }
    }
}
