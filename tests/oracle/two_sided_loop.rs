//! The simulator compared with another implementation: the same loops in python-control.
//!
//! The reference runs are from `two_sided_loop.py`. The simulator runs the same masses, dampers, springs,
//! delays and hand forces with the shipped scheme. Each signal must stay within 1e-4 of its peak on every
//! tick; both waves of a line are relative to the larger peak.
//!
//! The rest is due to the controllers' `f32`. Measured and desired positions are rounded by up to half an
//! `ulp` each, so the force of a controller of stiffness `K` deviates by up to `K ulp(x)`: 1.9e-5 N at 38 mm
//! and 5000 `N/m`, or 1e-5 of the forces here. Waves transmit the deviation. Free devices move farthest and
//! deviate most, by up to 3.4e-5; devices at a wall by 2e-6.
use dimsart_core::{DataType, types};
use hil_sim::plant::ExternalForce;
use hil_sim::response::{LoopCondition, linear_loops};
use serde::Deserialize;

use crate::evidence::{self, Compared, Evidence, column};
use crate::loops::{MASTER, Met, SLAVE, TICK_S, axis, bilateral, delays, push, rig, signal};

/// Maximum deviation relative to a signal's peak.
const TOLERANCE: f64 = 1e-4;
/// The printed order amplifies signals at half the sample rate by 2.255 in each round trip of 22 ticks:
/// rounding errors exceed the hand's push there. The first five round trips are compared.
const COMPARED_TICKS_PRINTED: usize = 110;

/// The reference runs listed in `cases.json`.
#[derive(Deserialize)]
struct Reference {
    tick_s: f64,
    cases: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    name: String,
    file: String,
    ticks: usize,
    order: String,
    forward_delay_ticks: u32,
    backward_delay_ticks: u32,
    master: Side,
    slave: Side,
    wall_stiffness_n_per_m: f64,
    impedance_n_s_per_m: f64,
}

#[derive(Deserialize)]
struct Side {
    mass_kg: f64,
    device_damping_n_s_per_m: f64,
    stiffness_n_per_m: f64,
    pd_damping_n_s_per_m: f64,
}

/// A column of the reference, its station and signal, and the columns whose peak is used.
type Column = (&'static str, usize, &'static DataType, &'static [&'static str]);

/// A wave that is small everywhere would otherwise be compared with its own rounding.
const LINE_WAVES: &[&str] = &["master_wave_out_sqrt_w", "slave_wave_out_sqrt_w"];
const COMPARED: [Column; 10] = [
    ("master_position_m", MASTER, types::POSITION, &["master_position_m"]),
    ("slave_position_m", SLAVE, types::POSITION, &["slave_position_m"]),
    ("master_desired_position_m", MASTER, types::DES_POSITION, &["master_desired_position_m"]),
    ("slave_desired_position_m", SLAVE, types::DES_POSITION, &["slave_desired_position_m"]),
    ("master_force_n", MASTER, types::DES_FORCE, &["master_force_n"]),
    ("slave_force_n", SLAVE, types::DES_FORCE, &["slave_force_n"]),
    ("master_wave_out_sqrt_w", MASTER, types::CH1_WAVES, LINE_WAVES),
    ("master_wave_in_sqrt_w", MASTER, types::CH2_WAVES, LINE_WAVES),
    ("slave_wave_out_sqrt_w", SLAVE, types::CH1_WAVES, LINE_WAVES),
    ("slave_wave_in_sqrt_w", SLAVE, types::CH2_WAVES, LINE_WAVES),
];

/// Runs the case; returns each of [`COMPARED`] over the ticks.
fn run(case: &Case, forces_n: Vec<f64>, ticks: usize) -> Vec<Vec<f64>> {
    let settings = format!(
        "{} wave.form={} wave.impedance_n_s_per_m={} master.stiffness_n_per_m={} slave.stiffness_n_per_m={} \
         master.damping_n_s_per_m={} slave.damping_n_s_per_m={}",
        delays(case.forward_delay_ticks, case.backward_delay_ticks),
        case.order,
        case.impedance_n_s_per_m,
        case.master.stiffness_n_per_m,
        case.slave.stiffness_n_per_m,
        case.master.pd_damping_n_s_per_m,
        case.slave.pd_damping_n_s_per_m,
    );
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the number of a tick")]
    let hand = push(move |t| forces_n[(t / TICK_S).round() as usize]);
    let stiffness_n_per_m = case.wall_stiffness_n_per_m;
    let device = |side: &Side, met, push: Option<ExternalForce>| {
        axis(side.mass_kg, side.device_damping_n_s_per_m, met, push)
    };
    let wall = Met::Spring(stiffness_n_per_m);
    let mut rig = rig(&settings, device(&case.master, Met::Nothing, hand), device(&case.slave, wall, None));
    let run = (0..ticks).map(|_| {
        rig.tick();
        let seen = COMPARED.map(|(_, side, data_type, _)| signal(&rig, side, data_type)).to_vec();
        rig.advance();
        seen
    });
    run.collect()
}

#[derive(Deserialize)]
struct Predictions {
    weakly_damped: Vec<WeaklyDamped>,
}

#[derive(Deserialize)]
struct WeaklyDamped {
    order: String,
    forward_delay_ticks: u32,
    backward_delay_ticks: u32,
    hand_damping_n_s_per_m: f64,
    slave: Side,
    wall_stiffness_n_per_m: f64,
    free_growth_per_tick: f64,
    contact_growth_per_tick: f64,
}

/// The growth of a loop after an impulse equals its largest eigenvalue: within 2e-5 if it grows, otherwise
/// within a third of the other eigenvalues' distance from 1, where decaying modes are not distinguished.
#[test]
fn loops_grow_by_the_largest_eigenvalue_of_python_control() {
    let Some(folder) = test_requirements::reference_runs("python-control") else { return };
    let predictions: Predictions = evidence::read(&folder.join("predictions.json"));
    let mut growing = 0;
    for row in &predictions.weakly_damped {
        let file = bilateral(&format!(
            "{} dof=1 wave.form={} hand.damping_n_s_per_m={} hand.stiffness_n_per_m=0 slave.device.mass_kg={} \
             slave.device.damping_n_s_per_m={} wall.stiffness_n_per_m={} wall.damping_n_s_per_m=0",
            delays(row.forward_delay_ticks, row.backward_delay_ticks),
            row.order,
            row.hand_damping_n_s_per_m,
            row.slave.mass_kg,
            row.slave.device_damping_n_s_per_m,
            row.wall_stiffness_n_per_m,
        ));
        let loops = linear_loops(&file).unwrap();
        for (held, expected) in [
            (LoopCondition::Free, row.free_growth_per_tick),
            (LoopCondition::Contact, row.contact_growth_per_tick),
        ] {
            let found = loops.iter().find(|one| one.held == held).unwrap();
            let growth = found.growth_per_tick.unwrap();
            let within = 2e-5 + 0.3 * (1.0 - expected).max(0.0);
            let ticks = [row.forward_delay_ticks, row.backward_delay_ticks];
            println!("{} {ticks:?} {held:?}: {growth:.6} for {expected:.6}", row.order);
            assert!((growth - expected).abs() < within, "{growth} for {expected}");
            assert_eq!(found.is_unstable(), expected > 1.0);
            growing += u32::from(found.is_unstable());
        }
    }
    assert!(growing >= 10, "{growing} of the loops grow");
}

#[test]
fn the_simulator_agrees_with_python_control() {
    let Some(folder) = test_requirements::reference_runs("python-control") else { return };
    let reference: Reference = evidence::read(&folder.join("cases.json"));
    assert_eq!(reference.tick_s.to_bits(), TICK_S.to_bits());
    let mut evidence = Evidence::new("two_sided_loop");
    for case in &reference.cases {
        let (names, rows) = evidence::table(&folder.join(&case.file));
        let named = |name: &str| column(&rows, names.iter().position(|known| known == name).unwrap());
        let ticks = if case.order == "printed" { COMPARED_TICKS_PRINTED } else { case.ticks };
        let found = run(case, named("hand_force_n"), ticks);
        for (place, (name, .., against)) in COMPARED.iter().enumerate() {
            let peaks = against.iter().flat_map(|name| named(name).into_iter().take(ticks));
            evidence.judge(&Compared {
                subject: "two-sided loop",
                name: format!("{}, {name}", case.name),
                oracle: "python-control",
                expected: &named(name)[..ticks],
                found: &column(&found, place),
                scale: Some(peaks.fold(0.0, |peak, value| peak.max(value.abs()))),
                tolerance: TOLERANCE,
                why: "controllers in f32 on devices that wander: rounding of the position times the stiffness",
                period_s: Some(TICK_S),
            });
        }
    }
    evidence.end();
}
