//! Every control law of the library against its closed form.
#![expect(clippy::unwrap_used, reason = "in helpers of tests as in tests")]
#![expect(clippy::cast_possible_truncation, clippy::float_cmp, reason = "rounded and compared on purpose")]

use crate::common::{self, Alone, H, Types, assert_close};
use dimsart_core::{Command, Direction, KindId, ModuleRef, types};
use dimsart_modules::ALL;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

/// Position, then desired position.
const SERVO: Types = &[types::POSITION, types::DES_POSITION];

/// `H` rounded to `f32`, as the modules use it.
fn h() -> f64 {
    f64::from(H)
}

fn servo(rows: &str) -> Alone {
    Alone::new(1, SERVO, "DES_FORCE", rows)
}

fn filter(module: &str, rows: &str) -> Alone {
    Alone::new(1, &[types::SIGNAL], "SIGNAL_OUT", &format!("{rows}\nMOD_ENG MOD_ON {module}"))
}

/// From -1 to 1.
fn noise(random: &mut Pcg32) -> f32 {
    (random.next_u32() >> 8) as f32 / 8_388_608.0 - 1.0
}

#[test]
fn p_is_a_spring_on_every_axis() {
    let rows = "PCTRL_MOD K_PARAM 3000\nPCTRL_MOD K_PARAM[2] 50\nMOD_ENG MOD_ON PCTRL_MOD";
    let mut p = Alone::new(3, SERVO, "DES_FORCE", rows);
    let mut random = Pcg32::seed_from_u64(1);
    for _ in 0..1000 {
        let measured: Vec<f32> = (0..6).map(|_| noise(&mut random)).collect();
        let forces = p.axes(&measured);
        for (axis, stiffness) in [3000.0, 3000.0, 50.0].into_iter().enumerate() {
            let error = f64::from(measured[axis + 3]) - f64::from(measured[axis]);
            assert_close(forces[axis], stiffness * error, 1e-6);
        }
    }
}

#[test]
fn pd_adds_the_slope_and_does_not_kick_when_plugged_in() {
    let mut pd = servo("PDCTRL_MOD K_PARAM 100\nPDCTRL_MOD D_PARAM 2\nMOD_ENG MOD_ON PDCTRL_MOD");
    assert_close(pd.step(&[0.5, 0.6]), 10.0, 1e-6);
    assert_close(pd.step(&[0.5, 0.6]), 10.0, 1e-6);
    assert_close(pd.step(&[0.5, 0.7]), 20.0 + 2.0 * 0.1 / h(), 1e-5);
    assert_close(pd.step(&[0.5, 0.7]), 20.0, 1e-6);
    // A ramp of 0.1 m/s from the start: K e + D v.
    let mut pd = servo("PDCTRL_MOD K_PARAM 100\nPDCTRL_MOD D_PARAM 2\nMOD_ENG MOD_ON PDCTRL_MOD");
    pd.step(&[0.0, 0.0]);
    for tick in 1..=1000 {
        let error = 0.1 * h() * f64::from(tick);
        assert_close(pd.step(&[0.0, error as f32]), 100.0 * error + 2.0 * 0.1, 2e-5);
    }
}

#[test]
fn pd_publishes_the_law_it_follows_in_the_next_tick() {
    let mut pd = servo(
        "PDCTRL_MOD K_PARAM 300\nPDCTRL_MOD D_PARAM 4\nPDCTRL_MOD LAW_OUTPUT ON\nMOD_ENG MOD_ON PDCTRL_MOD",
    );
    let mut random = Pcg32::seed_from_u64(2);
    pd.step(&[0.1, 0.2]);
    for _ in 0..1000 {
        let slope = f64::from(pd.bench.signal("CONTROL_STIFFNESS")[0]);
        let memory = f64::from(pd.bench.signal("CONTROL_MEMORY")[0]);
        let (x, desired) = (noise(&mut random), noise(&mut random));
        let predicted = slope * (f64::from(desired) - f64::from(x)) - memory;
        let scale = slope * 2.0;
        assert!((f64::from(pd.step(&[x, desired])) - predicted).abs() < 1e-6 * scale);
    }
}

#[test]
fn pid_integrates_a_constant_error_at_its_gain() {
    let mut pid = servo("PIDCTRL_MOD K_PARAM 20\nPIDCTRL_MOD I_PARAM 50\nMOD_ENG MOD_ON PIDCTRL_MOD");
    for tick in 1..=5000 {
        let expected = 20.0 * 0.2 + 50.0 * 0.2 * h() * f64::from(tick);
        assert_close(pid.step(&[0.0, 0.2]), expected, 1e-4);
    }
}

#[test]
fn pid_leaves_its_limit_within_the_tracking_time_however_long_it_was_there() {
    for seconds in [2, 20] {
        let mut pid = servo(
            "PIDCTRL_MOD I_PARAM 100\nPIDCTRL_MOD LIMIT 10\nPIDCTRL_MOD TRACKING_TIME 0.1\n\
             MOD_ENG MOD_ON PIDCTRL_MOD",
        );
        for tick in 0..seconds * 1000 {
            let force = pid.step(&[0.0, 1.0]);
            assert!(force <= 10.0);
            assert!(tick < 200 || force == 10.0);
        }
        // Beyond the limit the integral is y, y' = K_I e - y/T_t: settled at 10 N for e = 1; for e = -1 it
        // reaches zero after T_t ln 2.
        let recovery = (0..).position(|_| pid.step(&[0.0, -1.0]) < 10.0).unwrap();
        assert_close(recovery as f64 * h(), 0.1 * 2.0_f64.ln(), 2.0 * h());
    }
}

#[test]
fn pid_derivative_follows_a_step_as_its_filter_does() {
    let mut pid = servo("PIDCTRL_MOD D_PARAM 2\nPIDCTRL_MOD FILTER_TIME 0.009\nMOD_ENG MOD_ON PIDCTRL_MOD");
    assert_close(pid.step(&[0.0, 0.3]), 0.0, 0.0);
    // A step of e is an impulse e/h of slope, through y += (u - y) h/(h + T).
    let smoothing = h() / (h() + f64::from(0.009_f32));
    for tick in 0..100 {
        let expected = 2.0 * 0.1 / h() * smoothing * (1.0 - smoothing).powi(tick);
        assert_close(pid.step(&[0.0, 0.4]), expected, 2e-5);
    }
}

#[test]
fn integrator_is_exact_on_ramps_and_held_inside_its_limit() {
    let mut integrator = filter("INTEGRATOR_MOD", "INTEGRATOR_MOD LIMIT 4.5");
    for tick in 0..3000 {
        let time = f64::from(tick) * h();
        let expected = time * time / 2.0;
        assert_close(integrator.step(&[time as f32]), expected, 1e-6);
    }
    for _ in 0..3000 {
        assert!(integrator.step(&[5.0]) <= 4.5);
    }
    // Leaves the limit at once: no windup.
    integrator.step(&[-5.0]);
    assert_close(integrator.step(&[-5.0]), 4.5 - 5.0 * h(), 1e-6);
}

#[test]
fn integrator_agrees_with_a_double_precision_sum_over_a_million_ticks() {
    let mut integrator = filter("INTEGRATOR_MOD", "");
    let mut random = Pcg32::seed_from_u64(3);
    let (mut expected, mut previous) = (0.0, 0.0);
    for tick in 0..1_000_000 {
        let x = 0.3 + noise(&mut random);
        expected += 0.5 * h() * (f64::from(x) + previous);
        previous = f64::from(x);
        let found = integrator.step(&[x]);
        if tick % 1000 == 0 {
            assert_close(found, expected, 1e-6);
        }
    }
    assert!(expected > 250.0);
}

#[test]
fn differentiator_gives_the_slope_through_its_low_pass() {
    let mut differentiator = filter("DIFFERENTIATOR_MOD", "");
    assert_close(differentiator.step(&[7.0]), 0.0, 0.0);
    for tick in 1..1000 {
        assert_close(differentiator.step(&[7.0 + tick as f32 / 1024.0]), 1.0 / 1024.0 / h(), 1e-6);
    }
    let mut differentiator = filter("DIFFERENTIATOR_MOD", "DIFFERENTIATOR_MOD FILTER_TIME 0.02");
    differentiator.step(&[0.0]);
    let pole = f64::from(0.02_f32) / (h() + f64::from(0.02_f32));
    for tick in 1..200 {
        let expected = 1.0 / 1024.0 / h() * (1.0 - pole.powi(tick));
        assert_close(differentiator.step(&[tick as f32 / 1024.0]), expected, 1e-6);
    }
}

#[test]
fn velocity_to_position_starts_where_the_device_is_and_does_not_drift() {
    let inputs = &[types::POSITION, types::DES_VELOCITY];
    let mut module = Alone::new(1, inputs, "DES_POSITION", "MOD_ENG MOD_ON VEL2POS_MOD");
    let mut found = 0.0;
    for tick in 1..=1_000_000 {
        found = module.step(&[if tick == 1 { 1.5 } else { 99.0 }, 1e-3]);
        if tick == 1 {
            assert_close(found, 1.5, 1e-6);
        }
    }
    assert_close(found, 1.5 + 1e6 * h() * f64::from(1e-3_f32), 1e-6);
}

#[test]
fn wall_pushes_out_and_never_pulls_on_either_side() {
    for (side, out) in [("ABOVE", -1.0_f32), ("BELOW", 1.0)] {
        let mut wall = Alone::new(
            1,
            &[types::POSITION],
            "DES_FORCE",
            &format!(
                "VWALL_MOD SIDE {side}\nVWALL_MOD WALL_POSITION 0.25\nVWALL_MOD K_PARAM 1000\n\
                 VWALL_MOD B_PARAM 5\nMOD_ENG MOD_ON VWALL_MOD"
            ),
        );
        let mut previous = None;
        // Into the wall, hold, slowly out, in again, out so fast that spring and damper would pull.
        for depth in [-0.1, -0.01, 0.0, 0.01, 0.02, 0.02, 0.019, 0.03, 0.001, 0.0005, -0.1, -0.2] {
            let speed = (depth - previous.unwrap_or(depth)) / h();
            previous = Some(depth);
            let push = if depth > 0.0 { (1000.0 * depth + 5.0 * speed).max(0.0) } else { 0.0 };
            let found = wall.step(&[0.25 - out * depth as f32]);
            // 5 N s/m on a position with a resolution of half an ulp of 0.25 m.
            assert!(
                (f64::from(found) - f64::from(out) * push).abs() < 4e-4,
                "{side} {depth}: {found} {push}"
            );
        }
    }
}

#[test]
fn wall_without_a_motion_before_has_no_damping() {
    let mut wall = Alone::new(
        1,
        &[types::POSITION],
        "DES_FORCE",
        "VWALL_MOD K_PARAM 1000\nVWALL_MOD B_PARAM 5\nMOD_ENG MOD_ON VWALL_MOD",
    );
    assert_close(wall.step(&[0.5]), -500.0, 1e-6);
}

#[test]
fn normalizer_scales_shifts_and_limits() {
    let mut normalizer = filter(
        "NORMALIZER_MOD",
        "NORMALIZER_MOD SCALE 1000\nNORMALIZER_MOD OFFSET 0.5\nNORMALIZER_MOD LIMIT 300",
    );
    for (x, expected) in [(0.5, 0.0), (0.6, 100.0), (0.0, -300.0), (9.0, 300.0), (0.375, -125.0)] {
        assert_close(normalizer.step(&[x]), expected, 1e-6);
    }
}

#[test]
fn sum_weighs_both_signals() {
    let mut sum = Alone::new(
        2,
        &[types::FORCE, types::LINE_FORCE],
        "SIGNAL_OUT",
        "SUM_MOD PORT_A FORCE\nSUM_MOD PORT_B LINE_FORCE\nSUM_MOD A_GAIN 2\nSUM_MOD B_GAIN[1] -3\n\
         MOD_ENG MOD_ON SUM_MOD",
    );
    assert_eq!(sum.axes(&[1.0, 10.0, 5.0, 7.0]), [7.0, -1.0]);
}

/// A bench whose device provides all inputs of a module kind.
pub(crate) fn kind_alone(kind: KindId) -> Alone {
    let module = ModuleRef { kind, number: 1 };
    let name = ALL.module_name(module).name;
    let (measured, bindings) = common::surroundings(module);
    let mut bench: common::Bench = common::Bench::of(3, measured.leak(), &[]);
    for (port, signal) in bindings {
        bench.dimsart.command(Command::bind(module, port, signal)).unwrap();
    }
    let ports = bench.dimsart.engine_mut().ports(module).unwrap();
    let mut written = ports.iter().filter(|port| port.direction == Direction::Write);
    let output = written.next().map_or("SIGNAL_OUT", |port| port.data_type.unwrap().0.name);
    bench.run(&format!("MOD_ENG MOD_ON {name}"));
    Alone { bench, output }
}

#[test]
fn a_reset_module_starts_anew_and_keeps_its_parameters() {
    let gains = [
        "PDCTRL_MOD K_PARAM 3\nPDCTRL_MOD D_PARAM 1",
        "PIDCTRL_MOD K_PARAM 3\nPIDCTRL_MOD I_PARAM 9\nPIDCTRL_MOD D_PARAM 1\nPIDCTRL_MOD FILTER_TIME 0.1",
        "VWALL_MOD K_PARAM 100\nVWALL_MOD B_PARAM 1",
        "DIFFERENTIATOR_MOD FILTER_TIME 0.1",
        "INTEGRATOR_MOD LIMIT 0.01",
        "SIGGEN_MOD FORM TRIANGLE\nSIGGEN_MOD AMPLITUDE 3\nSIGGEN_MOD FREQUENCY 30",
        "WTRANSF_MOD CONF_MODE SLAVE",
        "VEL2POS_MOD",
        "RECORDER_MOD EVERY 3",
    ];
    for (rows, reset) in gains.into_iter().zip([Some("RESET"), None].into_iter().cycle()) {
        let name = rows.split_whitespace().next().unwrap();
        let mut module = kind_alone(ALL.module(name).unwrap().kind);
        if rows != name {
            module.bench.rows(rows);
        }
        let words = module.bench.dimsart.frame().output_words();
        let mut run = || -> Vec<Vec<u32>> {
            let mut random = Pcg32::seed_from_u64(4);
            let mut tick = || {
                module.axes(&(0..words).map(|_| noise(&mut random)).collect::<Vec<_>>());
                module.bench.bits(module.output).to_vec()
            };
            let outputs = (0..50).map(|_| tick()).collect();
            module
                .bench
                .rows(&format!("MOD_ENG {}", reset.map_or(format!("MOD_RESET {name}"), str::to_owned)));
            outputs
        };
        let fresh = run();
        assert_eq!(run(), fresh, "{name}");
        assert!(fresh.iter().any(|words| *words != fresh[0]), "{name} did something");
    }
}

#[test]
fn a_reset_delay_is_empty() {
    let rows = "TIMEDELAY_MOD TD_PARAM 5\nMOD_ENG MOD_ON TIMEDELAY_MOD";
    for reset in ["MOD_ENG MOD_RESET TIMEDELAY_MOD", "MOD_ENG RESET"] {
        let mut delay = Alone::new(1, &[types::CH1_WAVES], "CH1_TD_WAVES", rows);
        for tick in 0..8_u8 {
            delay.step(&[f32::from(tick)]);
        }
        delay.bench.rows(reset);
        for tick in 0..20 {
            assert_eq!(delay.step(&[-1.0]), if tick < 5 { 0.0 } else { -1.0 }, "{reset}: {tick}");
        }
    }
}
