//! Free motion of the coupled devices.

use dimsart_core::types;
use hil_sim::rig::Rig;

use crate::loops::{MASTER, Met, SLAVE, TICK_S, axis, delays, push, rig, signal};

const FORMS: [&str; 2] = ["split", "implicit"];
/// Force of the hand, `N`.
const FORCE_N: f64 = 1.0;
const IMPEDANCE_NS_PER_M: f64 = 10.0;
const MASTER_STIFFNESS_N_PER_M: f64 = 3000.0;
const SLAVE_STIFFNESS_N_PER_M: f64 = 5000.0;

/// A constant force on a master of 0.1 kg that moves a slave of 0.5 kg, from rest.
fn pushed(form: &str, ticks: (u32, u32), damping_n_s_per_m: (f64, f64)) -> Rig {
    let settings = format!("wave.form={form} {}", delays(ticks.0, ticks.1));
    let master = axis(0.1, damping_n_s_per_m.0, Met::Nothing, push(|_| FORCE_N));
    rig(&settings, master, axis(0.5, damping_n_s_per_m.1, Met::Nothing, None))
}

/// Compliance of line and controllers, `T/b + 1/K_m + 1/K_s` with the mean delay `T`, `m/N`.
fn compliance_m_per_n(round_trip_ticks: u32) -> f64 {
    f64::from(round_trip_ticks) * TICK_S / (2.0 * IMPEDANCE_NS_PER_M)
        + 1.0 / MASTER_STIFFNESS_N_PER_M
        + 1.0 / SLAVE_STIFFNESS_N_PER_M
}

/// At constant speed `V` the line stretches by its force and by the difference of the delays:
///
/// `x_md - x_sd = F T_rt/(2 b) + V (T_1 - T_2)/2`, `F = B_s V`, `V = F_hand/(B_m + B_s) = 1/12 m/s`
///
/// between desired positions; between the devices, both controllers also stretch by `F/K`.
#[test]
fn uneven_delays_shift_the_devices_at_speed() {
    for form in FORMS {
        for (ticks, expected_mm) in [((40, 4), 2.233333), ((5, 30), -0.458333)] {
            let mut rig = pushed(form, ticks, (8.0, 4.0));
            let (mut desired_m, mut measured_m, mut watched) = (0.0, 0.0, 0.0);
            while rig.ticks() < 2500 {
                rig.tick();
                if rig.ticks() >= 2000 {
                    let offset_m = |of| signal(&rig, MASTER, of) - signal(&rig, SLAVE, of);
                    desired_m += offset_m(types::DES_POSITION);
                    measured_m += offset_m(types::POSITION);
                    watched += 1.0;
                }
                rig.advance();
            }
            let force_n = 4.0 * FORCE_N / 12.0;
            let controllers_mm =
                1e3 * force_n * (1.0 / MASTER_STIFFNESS_N_PER_M + 1.0 / SLAVE_STIFFNESS_N_PER_M);
            let pairs = [(desired_m, expected_mm), (measured_m, expected_mm + controllers_mm)];
            for (sum_m, expected_mm) in pairs {
                let offset_mm = 1e3 * sum_m / watched;
                println!("{form:8} {ticks:?}: {offset_mm:.6} mm of {expected_mm:.6} mm");
                assert!(
                    (offset_mm / expected_mm - 1.0).abs() < 1e-4,
                    "{offset_mm} mm instead of {expected_mm} mm"
                );
            }
        }
    }
}

/// The force accelerates both devices and the line, reduced by damper and springs:
///
/// `M = M_m + M_s + b T - B_s² (T/b + 1/K_m + 1/K_s)`, `T` the mean of both delays.
///
/// It is visible as the position's lag behind its asymptote: `x -> V (t - M/(B_m + B_s))`.
#[test]
fn the_line_adds_its_apparent_mass() {
    for form in FORMS {
        for ticks in [(1, 1), (11, 11), (10, 1), (40, 4), (100, 100)] {
            let mut rig = pushed(form, ticks, (8.0, 8.0));
            while rig.ticks() < 4000 {
                rig.step();
            }
            let position_m = rig.stations()[MASTER].plant.position(0);
            let damping_n_s_per_m = 8.0 + 8.0;
            let mass_kg = damping_n_s_per_m * (rig.time_s() - position_m * damping_n_s_per_m / FORCE_N);
            let round_trip_ticks = ticks.0 + ticks.1;
            let line_kg = IMPEDANCE_NS_PER_M * 0.5 * TICK_S * f64::from(round_trip_ticks);
            let expected_kg = 0.1 + 0.5 + line_kg - 8.0 * 8.0 * compliance_m_per_n(round_trip_ticks);
            let error = mass_kg / expected_kg - 1.0;
            println!("{form:8} {ticks:?}: {mass_kg:.6} kg, {error:+.1e}");
            assert!(error.abs() < 1e-4, "{mass_kg} kg instead of {expected_kg} kg");
        }
    }
}

/// A force step returns as an echo after each round trip, reduced by
///
/// `(b - B_m)(b - B_s) / ((b + B_m)(b + B_s))`,
///
/// while masses and controllers settle within a few percent of a round trip: before the first echo the hand
/// moves the master and the line, `F/(B_m + b)`, finally both devices, `F/(B_m + B_s)`.
#[test]
fn echoes_die_by_the_product_of_both_reflections() {
    let b = IMPEDANCE_NS_PER_M;
    for form in FORMS {
        for (master, slave) in [(2.0, 3.0), (8.0, 40.0), (10.0, 3.0)] {
            let mut rig = pushed(form, (500, 500), (master, slave));
            let ratio = (b - master) * (b - slave) / ((b + master) * (b + slave));
            let end_m_per_s = FORCE_N / (master + slave);
            let mut expected_m_per_s = FORCE_N / (master + b);
            for _ in 0..6 {
                (0..1000).for_each(|_| rig.step());
                let mut seen = [0.0; 2];
                rig.stations()[MASTER].plant.read_quantities(0, &mut seen);
                let [_, speed_m_per_s] = seen;
                let error = speed_m_per_s / expected_m_per_s - 1.0;
                println!("{form:8} {master} and {slave} N s/m: {speed_m_per_s:.6} m/s, {error:+.1e}");
                assert!(error.abs() < 1e-4, "{speed_m_per_s} m/s instead of {expected_m_per_s} m/s");
                expected_m_per_s = end_m_per_s + ratio * (expected_m_per_s - end_m_per_s);
            }
        }
    }
}
