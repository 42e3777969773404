//! Lines terminated by their impedance or by a wall.

use std::collections::VecDeque;
use std::f64::consts::PI;

use dimsart_core::types;

use crate::loops::TICK_S;
use crate::port::Port;

const IMPEDANCE: f64 = 10.0;
const MASS_KG: f64 = 0.4;
const BANDWIDTH_HZ: f64 = 3.0;

/// A robot at a matched port, in free motion except for an external force.
struct Robot {
    port: Port,
    period_s: f64,
    position_m: f64,
    velocity_m_per_s: f64,
}

impl Robot {
    fn new(period_s: f64) -> Self {
        let port = Port::new(
            period_s,
            &[types::CH2_WAVES, types::POSITION, types::VELOCITY],
            &format!(
                "WMATCH_MOD B_PARAM {IMPEDANCE}\nWMATCH_MOD MASS {MASS_KG}\nWMATCH_MOD BANDWIDTH {BANDWIDTH_HZ}\n\
                 MOD_ENG MOD_ON WMATCH_MOD"
            ),
        );
        Self { port, period_s, position_m: 0.0, velocity_m_per_s: 0.0 }
    }

    /// Runs a tick; returns the reflected wave.
    fn tick(&mut self, wave: f64, push_n: f64) -> f64 {
        self.port.tick(&[wave, self.position_m, self.velocity_m_per_s]);
        let h = self.period_s;
        let acceleration = (self.port.signal("DES_FORCE") + push_n) / MASS_KG;
        self.position_m += h * self.velocity_m_per_s + 0.5 * h * h * acceleration;
        self.velocity_m_per_s += h * acceleration;
        self.port.signal("CH1_WAVES")
    }
}

/// Returns the maximum reflection of a unit wave, and the robot's maximum deviation from `λ/(s + λ)` of the
/// desired position, relative to its motion.
fn answer(period_s: f64) -> (f64, f64) {
    let mut robot = Robot::new(period_s);
    let left = libm::exp(-2.0 * PI * BANDWIDTH_HZ * period_s);
    let (mut lagging_m, mut back, mut off_m, mut way_m) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64);
    let mut before_m = 0.0;
    for tick in 0_u32.. {
        let time_s = f64::from(tick) * period_s;
        if time_s > 1.0 {
            break;
        }
        off_m = off_m.max((robot.position_m - lagging_m).abs());
        back = back.max(robot.tick(libm::sin(2.0 * PI * 2.0 * time_s).powi(2), 0.0).abs());
        let desired_m = robot.port.signal("DES_POSITION");
        // The desired position changes linearly between ticks.
        let slope = (desired_m - before_m) * (1.0 / (2.0 * PI * BANDWIDTH_HZ * period_s));
        lagging_m = desired_m - slope + (lagging_m - before_m + slope) * left;
        before_m = desired_m;
        way_m = way_m.max(desired_m.abs());
    }
    (back, off_m / way_m)
}

/// Niemeyer and Slotine (2004). The rest is due to the force held during a tick and proportional to the
/// sample period.
#[test]
fn a_matched_robot_sends_no_wave_back_and_lags_as_its_bandwidth_says() {
    let (coarse, coarse_off) = answer(1e-4);
    let (fine, fine_off) = answer(2e-5);
    println!(
        "comes back: {coarse:.2e} at 0.1 ms, {fine:.2e} at 0.02 ms; off by {coarse_off:.2e}, {fine_off:.2e}"
    );
    assert!(coarse < 1e-3 && coarse_off < 1e-3);
    assert!((coarse / fine / 5.0 - 1.0).abs() < 0.1 && (coarse_off / fine_off / 5.0 - 1.0).abs() < 0.2);
}

/// With both robots matched, a hand moves both ends of the line: `V = F/(2b)` for any delay.
#[test]
fn a_hand_drags_two_matched_robots_at_half_of_what_one_end_takes() {
    let push_n = 1.0;
    for (forward, backward) in [(1, 1), (10, 10), (60, 5)] {
        let (mut master, mut slave) = (Robot::new(TICK_S), Robot::new(TICK_S));
        let mut down = VecDeque::from(vec![0.0; forward]);
        let mut up = VecDeque::from(vec![0.0; backward]);
        for _ in 0..4000 {
            let arrived = up.pop_front().unwrap_or_default();
            down.push_back(master.tick(arrived, push_n));
            let arrived = down.pop_front().unwrap_or_default();
            up.push_back(slave.tick(arrived, 0.0));
        }
        let expected = push_n / (2.0 * IMPEDANCE);
        println!(
            "{forward} and {backward} ticks: {} and {}",
            master.velocity_m_per_s, slave.velocity_m_per_s
        );
        for found in [master.velocity_m_per_s, slave.velocity_m_per_s] {
            assert!((found / expected - 1.0).abs() < 1e-4, "{found} instead of {expected} m/s");
        }
    }
}

/// Returns the force on an oscillating near end with the far end held, `N`, per tick.
fn held_line(frequency_hz: f64, forward_ticks: usize, backward_ticks: usize, ticks: usize) -> Vec<f64> {
    let port = "MOD_ENG MOD_ON WIMPEDANCE_MOD";
    let measured = &[types::VELOCITY, types::CH2_WAVES];
    let (mut near, mut far) = (Port::new(TICK_S, measured, port), Port::new(TICK_S, measured, port));
    let mut down = VecDeque::from(vec![0.0; forward_ticks]);
    let mut up = VecDeque::from(vec![0.0; backward_ticks]);
    let force = |tick: usize| {
        let velocity = libm::sin(2.0 * PI * frequency_hz * tick as f64 * TICK_S);
        near.tick(&[velocity, up.pop_front().unwrap_or_default()]);
        down.push_back(near.signal("CH1_WAVES"));
        far.tick(&[0.0, down.pop_front().unwrap_or_default()]);
        up.push_back(far.signal("CH1_WAVES"));
        -near.signal("DES_FORCE")
    };
    (0..ticks).map(force).collect()
}

/// `Z = b coth(s T)`: the first zero is at half the inverse of the round-trip time, where the force vanishes
/// after each round trip; the first pole is at twice that, where each round trip adds `2 b`.
#[test]
fn a_held_line_gives_way_at_half_of_one_over_its_round_trip() {
    for (forward, backward) in [(10, 10), (3, 17)] {
        let round_trip = forward + backward;
        let zero_hz = 1.0 / (2.0 * round_trip as f64 * TICK_S);
        let force = held_line(zero_hz, forward, backward, 12 * round_trip);
        for tick in round_trip..force.len() {
            assert!((force[tick] - force[tick - round_trip]).abs() < 1e-4);
        }
        let largest = |force: &[f64]| force.iter().fold(0.0_f64, |most, force| most.max(force.abs()));
        let at_zero = largest(&force[10 * round_trip..]);
        let force = held_line(2.0 * zero_hz, forward, backward, 12 * round_trip);
        let grown = largest(&force[11 * round_trip..]) - largest(&force[10 * round_trip..11 * round_trip]);
        println!(
            "{forward} and {backward} ticks: {at_zero:.4} N at {zero_hz} Hz, {grown:.4} N more per trip at twice"
        );
        assert!((at_zero / IMPEDANCE - 1.0).abs() < 1e-5);
        assert!((grown / (2.0 * IMPEDANCE) - 1.0).abs() < 1e-4);
    }
}
