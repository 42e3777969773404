//! Encoder alignment: a misaligned encoder raises a fault, an aligned one never does.

use core::f64::consts::{PI, TAU};

use dimsart_core::DriveFault;
use drive::Configuration;
use hil_sim::plant::{BridgeMotor, ThreePhaseParameters};

use crate::bench::{Bench, PERIOD_S, configuration, motor};

/// The default motor of b-g431b-esc1, at 12 V.
fn small() -> (ThreePhaseParameters, Configuration) {
    let motor = ThreePhaseParameters {
        resistance_ohm: 0.6,
        direct_inductance_h: 2.5e-4,
        quadrature_inductance_h: 2.5e-4,
        flux_linkage_vs: 0.05 / 10.5,
        pole_pairs: 7,
        supply_v: 12.0,
        dead_time_share: 0.016,
        dead_time_current_a: 0.3,
        rotor_inertia_kg_m2: 2e-5,
        viscous_nms_per_rad: 1e-4,
        ..motor()
    };
    let mut told = configuration(&motor);
    (told.limits.current_a, told.limits.trip_current_a) = (5.0, 10.0);
    told.limits.min_bus_v = 8.0;
    (motor, told)
}

/// Factors of the configured `R`, `L` and `ψ`.
fn mistaken(mut told: Configuration, [resistance, inductance, flux]: [f32; 3]) -> Configuration {
    told.motor.resistance_ohm *= resistance;
    told.motor.direct_inductance_h *= inductance;
    told.motor.quadrature_inductance_h *= inductance;
    told.motor.flux_linkage_vs *= flux;
    told
}

const EXACT: [f32; 3] = [1.0; 3];
// A `ψ` configured too high reports overspeed for the supply too early.
const MISTAKES: [[f32; 3]; 5] = [EXACT, [0.7, 0.7, 0.7], [0.7, 1.3, 0.7], [1.3, 1.3, 0.7], [1.3, 0.7, 1.0]];

/// Reading of an encoder with an error of `slip_rad` on a bench.
fn step_with_slip(bench: &mut Bench, slip_rad: f64, torque_nm: f32) {
    let sample = bench.sample_shown(slip_rad);
    bench.step_with(&sample, Some(torque_nm));
}

/// Encoder error, rotor `rad`, as a function of time and travel of the rotor since its start.
type Slip = fn(f64, f64) -> f64;
const COUNT_RAD: f64 = TAU / 4096.0;
const SLIPS: [(&str, Slip); 5] = [
    ("one count lost per ms, 200 in total", |time_s, _| -(time_s * 1e3).floor().min(200.0) * COUNT_RAD),
    ("1 % of the counts missing", |_, way_rad| -0.01 * way_rad),
    ("3 % extra counts", |_, way_rad| 0.03 * way_rad),
    ("half an electrical turn within 20 ms", |time_s, _| -PI / 7.0 * (time_s / 0.02).min(1.0)),
    ("a quarter of an electrical turn within 20 ms", |time_s, _| PI / 14.0 * (time_s / 0.02).min(1.0)),
];

/// Requirement: detection within 20 ms of an error of 60° (electrical) and a back-EMF of a tenth of the supply, or a
/// quarter of the supply for ±30 % error in the motor's parameters.
#[test]
fn an_encoder_that_slips_at_any_speed_is_a_named_fault_within_20_ms_and_the_rotor_does_not_run_away() {
    let (motor, right) = small();
    let motor = ThreePhaseParameters { viscous_nms_per_rad: 1e-3, ..motor };
    for (errors, (name, slip)) in MISTAKES.into_iter().flat_map(|errors| SLIPS.map(|slip| (errors, slip))) {
        // From standstill and while turning, below the voltage limit.
        for (share, settled) in [(0.3, 0), (0.3, 1_500), (-0.3, 1_500), (0.6, 1_500)] {
            let mut bench = Bench::new(&motor, mistaken(right, errors));
            let torque_nm = share * 5.0 * bench.configuration.motor.torque_constant_nm_per_a();
            bench.run(Some(0.0), 100);
            bench.run(Some(torque_nm), settled);
            assert_eq!(bench.drive.fault(), None);
            let begin = bench.motor.state();
            let fastest = begin.speed_rad_per_s.abs();
            let case = format!("{name}, {errors:?}, {share}, {:.0} rad/s", begin.speed_rad_per_s);
            let min_v = if errors == EXACT { 0.1 } else { 0.25 } * motor.supply_v;
            let (mut wrong_s, mut found_s, mut forward) = (None, None, 0.0_f64);
            for period in 0..40_000_u16 {
                let time_s = f64::from(period) * PERIOD_S;
                let state = bench.motor.state();
                let slip_rad = slip(time_s, state.angle_rad - begin.angle_rad);
                let wrong_rad = (7.0 * slip_rad + PI).rem_euclid(TAU) - PI;
                let magnets_v = 7.0 * motor.flux_linkage_vs * state.speed_rad_per_s.abs();
                if wrong_rad.abs() > PI / 3.0 && magnets_v > min_v {
                    wrong_s.get_or_insert(time_s);
                }
                // Against the command.
                forward = forward.min(f64::from(share.signum()) * state.speed_rad_per_s);
                step_with_slip(&mut bench, slip_rad, torque_nm);
                if bench.drive.fault().is_some() {
                    found_s = Some(time_s);
                    break;
                }
            }
            // `EncoderLost` if the slip is as fast as the rotor.
            let fault = bench.drive.fault().unwrap();
            assert!(
                [DriveFault::EncoderSlipped, DriveFault::EncoderLost].contains(&fault),
                "{case}: {fault:?}"
            );
            let late_s = found_s.unwrap() - wrong_s.unwrap_or(f64::MAX);
            assert!(late_s < 0.02, "{case}: {late_s} s");
            assert!(forward > -30.0, "{case}: {forward} rad/s against the command, {fastest}");
        }
    }
}

#[test]
fn an_encoder_that_has_slipped_at_standstill_is_a_named_fault_before_the_rotor_is_fast() {
    let (motor, right) = small();
    for errors in MISTAKES {
        for degrees in [-123, -90, -60, 60, 90, 123_i16] {
            for share in [0.05, 0.32, 1.0] {
                let mut bench = Bench::new(&motor, mistaken(right, errors));
                let torque_nm = share * 5.0 * bench.configuration.motor.torque_constant_nm_per_a();
                let slip_rad = f64::from(degrees).to_radians() / 7.0;
                let found = (0..20_000_u16).find(|_| {
                    step_with_slip(&mut bench, slip_rad, torque_nm);
                    bench.drive.fault().is_some()
                });
                let speed = bench.motor.state().speed_rad_per_s;
                let case = format!("{errors:?}, {degrees}°, {share}: {speed:.0} rad/s, {found:?}");
                // At 90° the motor has no torque.
                if degrees.abs() == 90 && found.is_none() {
                    assert!(speed.abs() < 100.0, "{case}");
                    continue;
                }
                assert_eq!(bench.drive.fault(), Some(DriveFault::EncoderSlipped), "{case}");
                assert!(speed.abs() < 155.0, "{case}");
            }
        }
    }
}

#[test]
fn lost_counts_without_a_commanded_torque_do_not_turn_the_rotor() {
    let (motor, told) = small();
    let mut bench = Bench::new(&motor, told);
    for period in 0..20_000_u16 {
        let (_, slip) = SLIPS[0];
        step_with_slip(&mut bench, slip(f64::from(period) * PERIOD_S, 0.0), 0.0);
    }
    assert!(bench.motor.state().speed_rad_per_s.abs() < 1.0, "{:?}", bench.motor.state());
}

/// Returns a random number from `low` to `high`.
struct Random(u64);

impl Random {
    fn within(&mut self, low: f64, high: f64) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        low + f64::from((self.0 >> 32) as u32) / f64::from(u32::MAX) * (high - low)
    }

    fn one_of<T: Copy>(&mut self, choices: [T; 4]) -> T {
        let share = self.within(0.0, 4.0);
        let place = [1.0, 2.0, 3.0].iter().filter(|least| share >= **least).count();
        choices[place]
    }

    /// Returns an error of at most 30 %, large errors more often.
    fn error(&mut self) -> f32 {
        let any = self.within(0.7, 1.3) as f32;
        self.one_of([0.7, 1.3, any, 1.0])
    }
}

#[test]
fn a_healthy_motor_runs_without_a_fault_at_all_speeds_in_steps_reversals_saturation_and_heat() {
    const SEED: u64 = 0x9E37_79B9_7F4A_7C15;
    let mut random = Random(SEED);
    let mut fastest_share = 0.0_f64;
    for run in 0..100 {
        let (mut motor, mut told) = if random.within(0.0, 1.0) < 0.5 {
            small()
        } else {
            let motor =
                ThreePhaseParameters { rotor_inertia_kg_m2: 5e-4, viscous_nms_per_rad: 1e-3, ..motor() };
            let told = configuration(&motor);
            (motor, told)
        };
        let inductance = random.within(0.4, 1.0);
        motor.direct_inductance_h *= inductance;
        motor.quadrature_inductance_h *= inductance * random.within(1.0, 1.3);
        motor.resistance_ohm *= random.within(0.5, 1.5);
        motor.rotor_inertia_kg_m2 *= 10.0_f64.powf(random.within(-1.0, 1.0));
        let exact = configuration(&motor).motor;
        told.motor = exact;
        told = mistaken(told, [random.error(), random.error(), random.error().min(0.95)]);
        // 100 °C warmer.
        motor.resistance_ohm *= if random.within(0.0, 1.0) < 0.5 { 1.4 } else { 1.0 };
        motor.dead_time_share *= random.within(0.7, 1.5);
        let max_nm = f64::from(told.limits.current_a * told.motor.torque_constant_nm_per_a());
        let cogging_nm = random.within(-0.2, 0.2).max(0.0) * max_nm;
        // At the rate limit of the safety stage, or as a step.
        let rate_nm = max_nm * if random.within(0.0, 1.0) < 0.7 { PERIOD_S / 0.01 } else { 2.0 };
        let hold = random.one_of([20, 100, 1_000, 4_000]);
        // Alignment error up to 10° (electrical).
        let slip_rad = random.within(-0.17, 0.17) / f64::from(motor.pole_pairs);
        let mut bench = Bench::new(&motor, told);
        bench.motor = BridgeMotor::new(&motor).unwrap().with_cogging(cogging_nm, 42);
        let (mut wanted_nm, mut target_nm, mut load_nm) = (0.0_f64, 0.0, 0.0);
        let electrical = f64::from(motor.pole_pairs);
        let circle_v = 0.7 * motor.supply_v / 3.0_f64.sqrt();
        for period in 0..12_000_u32 {
            let state = bench.motor.state();
            let magnets_v = electrical * state.speed_rad_per_s * motor.flux_linkage_vs;
            fastest_share = fastest_share.max(magnets_v.abs() / motor.supply_v);
            if period % hold == 0 {
                let any_nm = random.within(-max_nm, max_nm);
                target_nm = random.one_of([0.0, max_nm, -max_nm, any_nm]);
                load_nm = random.within(-1.0, 1.0).clamp(-0.8, 0.8) * max_nm;
                if period % (3 * hold) != 0 {
                    load_nm = 0.0;
                }
            }
            // The supply voltage limits braking currents at high speed.
            let brake_a = f64::from(told.limits.current_a);
            let d_v = electrical * state.speed_rad_per_s * motor.quadrature_inductance_h * brake_a;
            let q_v = magnets_v.abs() - motor.resistance_ohm * brake_a;
            let can_brake = d_v.hypot(q_v) < circle_v;
            let target_nm = if target_nm * magnets_v < 0.0 && !can_brake { 0.0 } else { target_nm };
            wanted_nm += (target_nm - wanted_nm).clamp(-rate_nm, rate_nm);
            let is_slow = magnets_v.abs() < 0.2 * motor.supply_v;
            let faster = if is_slow { load_nm } else { 0.0 } / motor.rotor_inertia_kg_m2 * PERIOD_S;
            bench.motor.set_rotor(state.angle_rad, state.speed_rad_per_s + faster);
            step_with_slip(&mut bench, slip_rad, wanted_nm as f32);
            let errors = [
                told.motor.resistance_ohm / exact.resistance_ohm,
                told.motor.quadrature_inductance_h / exact.quadrature_inductance_h,
                told.motor.flux_linkage_vs / exact.flux_linkage_vs,
            ];
            assert_eq!(
                bench.drive.fault(),
                None,
                "run {run}, period {period}: {state:?}, {errors:?}, every {hold} periods, {wanted_nm} N m, {motor:?}"
            );
        }
    }
    assert!(fastest_share > 0.45, "no motor reached its voltage limit: {fastest_share}");
}
