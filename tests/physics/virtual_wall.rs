//! A sampled wall: stability limit, passivity limit, and the effect of a passivity controller.
#![expect(clippy::indexing_slicing, reason = "in helpers of tests as in tests")]

use std::f64::consts::PI;

use dimsart_core::types;

use crate::loops::TICK_S;
use crate::port::Port;

fn wall(stiffness: f64, damping: f64, position_m: f64) -> Port {
    Port::new(
        TICK_S,
        &[types::POSITION],
        &format!(
            "VWALL_MOD K_PARAM {stiffness}\nVWALL_MOD B_PARAM {damping}\nVWALL_MOD WALL_POSITION {position_m}\n\
             MOD_ENG MOD_ON VWALL_MOD"
        ),
    )
}

/// A mass with a damper under a held force, integrated exactly: `v' = (F - b v)/m`.
struct Mass {
    mass_kg: f64,
    damping_n_s_per_m: f64,
    position_m: f64,
    velocity_m_per_s: f64,
}

impl Mass {
    fn advance(&mut self, force_n: f64) {
        let final_m_per_s = force_n / self.damping_n_s_per_m;
        let time_constant_s = self.mass_kg / self.damping_n_s_per_m;
        let left = libm::exp(-TICK_S / time_constant_s);
        let excess = self.velocity_m_per_s - final_m_per_s;
        self.position_m += final_m_per_s * TICK_S + excess * time_constant_s * (1.0 - left);
        self.velocity_m_per_s = final_m_per_s + excess * left;
    }
}

/// Returns the early and late maximum speed of a device in permanent contact with a wall after a small push.
fn swing(stiffness: f64, damping: f64, device: [f64; 2]) -> (f64, f64) {
    const SURFACE_M: f64 = -0.02;
    const TICKS: usize = 60_000;
    let [mass_kg, damping_n_s_per_m] = device;
    let mut port = wall(stiffness, damping, SURFACE_M);
    let mut mass = Mass { mass_kg, damping_n_s_per_m, position_m: 0.0, velocity_m_per_s: 1e-3 };
    let mut speeds = Vec::new();
    for _ in 0..TICKS {
        port.tick(&[mass.position_m]);
        mass.advance(port.signal("DES_FORCE") + stiffness * -SURFACE_M);
        assert!(mass.position_m > SURFACE_M && mass.position_m < -SURFACE_M, "it grew too far to compare");
        speeds.push(mass.velocity_m_per_s.abs());
    }
    let largest = |speeds: &[f64]| speeds.iter().copied().fold(0.0, f64::max);
    (largest(&speeds[TICKS / 10..TICKS / 5]), largest(&speeds[9 * TICKS / 10..]))
}

/// The poles of mass and sampled wall are a pair with the product `e + K g`, `e = exp(-b h/m)`, which is 1 at
/// `K = b² (1 - e)/(m (1 - e - b h/m e))`; `2 b/h` for a heavy mass.
#[test]
fn a_sampled_wall_swings_from_the_stiffness_on_that_its_poles_say() {
    for [mass_kg, damping] in [[0.1, 1.0], [0.05, 2.0]] {
        let ratio = damping * TICK_S / mass_kg;
        let e = libm::exp(-ratio);
        let critical = damping * damping * (1.0 - e) / (mass_kg * (1.0 - e - ratio * e));
        // Within 2 %: Gil, Avello, Rubio and Florez (2004), (b + B)/(h/2 + delay).
        assert!((critical / (2.0 * damping / TICK_S) - 1.0).abs() < 0.02, "{critical}");
        let (early, late) = swing(0.99 * critical, 0.0, [mass_kg, damping]);
        println!(
            "{mass_kg} kg, {damping} N s/m, K = 0.99 of {critical:.1} N/m: {early:.2e} to {late:.2e} m/s"
        );
        assert!(late < 0.9 * early);
        let (early, late) = swing(1.002 * critical, 0.0, [mass_kg, damping]);
        println!("                                1.002: {early:.2e} to {late:.2e} m/s");
        assert!(late > 1.1 * early);
    }
}

/// Returns the energy that a wall generates in a tick for a device that alternates between two positions,
/// `J`.
fn leak_j(stiffness: f64, damping: f64, amplitude_m: f64) -> f64 {
    const TICKS: usize = 200;
    let mut port = wall(stiffness, damping, -1.0);
    let mut given_j = 0.0;
    let at = |tick: usize| if tick.is_multiple_of(2) { amplitude_m } else { -amplitude_m };
    port.tick(&[at(1)]);
    for tick in 0..TICKS {
        port.tick(&[at(tick)]);
        given_j += (port.signal("DES_FORCE") + stiffness) * (at(tick + 1) - at(tick));
    }
    given_j / TICKS as f64
}

/// Colgate and Schenkel (1997): passive for all hands if `b > K h/2 + |B|`. The worst hand is the one above:
/// with the force of the last sample the wall generates `2 K A² + 4 B A²/h` per tick, and the damper
/// dissipates `b (2A)²/h`.
#[test]
fn a_sampled_wall_gives_what_colgates_damping_takes() {
    let amplitude_m = 1e-3;
    for (stiffness, damping) in [(500.0, 0.0), (2000.0, 0.0), (2000.0, 0.7)] {
        let taken_per_damping_j = 4.0 * amplitude_m * amplitude_m / TICK_S;
        let needed = leak_j(stiffness, damping, amplitude_m) / taken_per_damping_j;
        let colgate = stiffness * TICK_S / 2.0 + damping;
        println!("K = {stiffness} N/m, B = {damping} N s/m: needs {needed:.5} N s/m, {colgate:.5} by theory");
        assert!((needed / colgate - 1.0).abs() < 1e-4);
    }
}

/// Abbott and Okamura (2005): dry friction `f` compensates an encoder's resolution `d` if `K <= 2 f/d`. The
/// worst hand crosses a count within a tick without force and is pushed back with `K d`: it gains `K d` per
/// crossing, of which friction dissipates `2 f`.
#[test]
fn the_step_of_an_encoder_needs_the_friction_of_theory() {
    let (friction_n, step_m, crossing_m) = (0.04, 30e-6, 10e-6);
    let stiffness = 2.0 * friction_n / step_m;
    for (factor, is_passive) in [(0.999, true), (1.001, false)] {
        let mut port = wall(factor * stiffness, 0.0, 0.0);
        let mut energy_j = 0.0;
        for tick in 0..1000 {
            // Just below the count, just above it, and back.
            let is_inside = tick % 2 == 1;
            port.tick(&[if is_inside { step_m } else { 0.0 }]);
            let step_m = if is_inside { -crossing_m } else { crossing_m };
            energy_j += port.signal("DES_FORCE") * step_m - friction_n * crossing_m;
        }
        assert_eq!(energy_j < 0.0, is_passive, "{energy_j} J at {factor}");
    }
}

/// Results of pushing a 40 g device against a wall with a hand's spring.
struct Push {
    peak_mm: f64,
    tail_mm: f64,
    energy_mj: f64,
}

/// 40 g and 0.8 N s/m, a hand of 400 N/m with a target of 33 mm, a wall at 30 mm, an encoder of 1024 counts
/// on a 10 mm drum, at most 2 N; observer and controller in every tick.
fn push(stiffness: f64, wall_every_ticks: usize, cap_n_s_per_m: f64) -> Push {
    let mut port = Port::new(
        TICK_S,
        &[types::POSITION],
        &format!(
            "VWALL_MOD K_PARAM {stiffness}\nVWALL_MOD WALL_POSITION 0.03\nVWALL_MOD PORT_DES_FORCE DES_FORCE.2\n\
             VWALL_MOD EVERY_TICKS {wall_every_ticks}\nMOD_ENG MOD_ON VWALL_MOD\n\
             PASSIVITY_MOD DAMPER {cap_n_s_per_m}\nPASSIVITY_MOD LIMIT 2\nMOD_ENG MOD_ON PASSIVITY_MOD"
        ),
    );
    let count_m = 2.0 * PI * 0.010 / 1024.0;
    let (mut position_m, mut velocity_m_per_s) = (0.029, 0.0);
    let mut positions_m = Vec::new();
    for _ in 0..1500 {
        port.tick(&[f64::floor(position_m / count_m) * count_m]);
        let force_n = port.signal("DES_FORCE");
        for _ in 0..40 {
            let hand_n = 400.0 * (0.033 - position_m);
            velocity_m_per_s += TICK_S / 40.0 * (force_n + hand_n - 0.8 * velocity_m_per_s) / 0.04;
            position_m += TICK_S / 40.0 * velocity_m_per_s;
        }
        positions_m.push(position_m);
    }
    let largest = |positions: &[f64]| positions.iter().copied().fold(f64::MIN, f64::max);
    let smallest = |positions: &[f64]| positions.iter().copied().fold(f64::MAX, f64::min);
    let tail = &positions_m[1000..];
    Push {
        peak_mm: 1e3 * largest(&positions_m),
        tail_mm: 1e3 * (largest(tail) - smallest(tail)),
        energy_mj: 1e3 * port.signal("PORT_ENERGY"),
    }
}

/// A published table of five runs: maximum position, oscillation of the last half second, energy absorbed by
/// the wall.
///
/// | | K | wall computed every | cap |
/// |---|---|---|---|
/// | A, B | 400, 2500 N/m | 1 ms | off |
/// | C | 2500 N/m | 1 ms | 0.8 N s/m |
/// | D, E | 400 N/m | 5 ms | off, 0.8 N s/m |
#[test]
fn a_published_table_of_passivity_control_comes_out_to_its_digits() {
    let table = [
        (400.0, 1, 0.0, ["33.53", "0.001", "-0.32"]),
        (2500.0, 1, 0.0, ["31.79", "1.658", "-17.6"]),
        (2500.0, 1, 0.8, ["31.79", "0.080", "-1.81"]),
        (400.0, 5, 0.0, ["34.07", "5.277", "-69.7"]),
        (400.0, 5, 0.8, ["33.90", "0.001", "-1.44"]),
    ];
    for (stiffness, every_ticks, cap, expected) in table {
        let Push { peak_mm, tail_mm, energy_mj } = push(stiffness, every_ticks, cap);
        let digits = if energy_mj < -10.0 { 1 } else { 2 };
        let found = [format!("{peak_mm:.2}"), format!("{tail_mm:.3}"), format!("{energy_mj:.digits$}")];
        println!("{stiffness:6} N/m, {every_ticks} ms, cap {cap}: {found:?}");
        assert_eq!(found, expected);
    }
}
