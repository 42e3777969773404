//! Anti-windup: integrals follow the force that the device got (range, rate, safe value).
#![expect(clippy::unwrap_used, clippy::panic, reason = "in helpers of tests as in tests")]

use dimsart_core::{
    AxisKind, DataType, DeviceDescriptor, Dimsart, InputLimits, ProvidedMemory, TickResult, types,
};
use dimsart_modules::ALL;

use crate::common::{Bench, H, assert_close};

const MEASURED: &[&DataType] = &[types::POSITION, types::VELOCITY, types::DES_POSITION, types::DES_VELOCITY];

/// Controllers with an integral, on a position or velocity error.
const CONTROLLERS: [&str; 6] = [
    "PIDCTRL_MOD",
    "PID2_MOD",
    "PID2_MOD ANTI_WINDUP CLAMPING",
    "PI_MOD",
    "CASCADE_MOD",
    "STATE_FEEDBACK_MOD",
];

/// A controller with `K = 10` and `K_I = 1000`, and further rows.
fn controller(module: &str, limits: InputLimits, more: &str) -> Bench {
    let (name, row) = module.split_once(' ').unwrap_or((module, ""));
    let mut bench = Bench::of(1, MEASURED, &[types::DES_FORCE]);
    let device =
        DeviceDescriptor::new("joint", &[AxisKind::Linear], H, MEASURED, &[types::DES_FORCE]).unwrap();
    let limits: &'static [InputLimits] = Vec::leak(vec![limits]);
    let limits: &'static [&'static [InputLimits]] = Vec::leak(vec![limits]);
    bench.dimsart =
        Dimsart::new(ProvidedMemory::leak_default(), device.with_limits(limits).unwrap(), ALL).unwrap();
    let gains = match name {
        "STATE_FEEDBACK_MOD" => "K1_PARAM 10\nREFERENCE_GAIN 10\nI_PARAM 1000",
        "CASCADE_MOD" => "POSITION_GAIN 1\nK_PARAM 10\nI_PARAM 1000",
        _ => "K_PARAM 10\nI_PARAM 1000",
    };
    let rows = gains.lines().chain([row]).chain(more.lines()).filter(|row| !row.is_empty());
    let rows: String = rows.map(|row| format!("{name} {row}\n")).collect();
    bench.run(&format!("{rows}MOD_ENG MOD_ON {name}"));
    bench
}

/// A frame with a position and a velocity error.
fn error(size: f32) -> [f32; 4] {
    [0.0, 0.0, size, size]
}

/// The commands that the device gets.
fn given(bench: &mut Bench, size: f32) -> f32 {
    let [force] = bench.tick(&error(size))[..] else { panic!("one axis") };
    force
}

/// A limit of the device has the same effect as a limit of the controller.
#[test]
fn the_range_of_a_device_is_as_good_as_a_limit_of_the_controller() {
    let range = InputLimits { min: -20.0, max: 20.0, ..InputLimits::NONE };
    for module in CONTROLLERS {
        let mut declared = controller(module, range, "");
        let mut own = controller(module, InputLimits::NONE, "LIMIT 20");
        for tick in 0..8000 {
            // Three seconds in saturation, then the opposite direction.
            let size = if tick < 3000 { 1.0 } else { -0.1 };
            let [found, expected] = [&mut declared, &mut own].map(|bench| given(bench, size));
            // CLAMPING sees the device's limit a tick later: a difference of K_I h e.
            let near = if module.contains("CLAMPING") { 1.1 } else { 1e-3 };
            assert!((found - expected).abs() < near, "{module} {tick}: {found} for {expected}");
        }
    }
}

/// While the force rises at its rate limit, the difference of command and value tends to `(K_I e - rate)
/// T_t`: 90 N here, 2700 N after 3 s without tracking.
#[test]
fn an_integral_follows_a_force_that_is_limited_in_rate() {
    let limits = InputLimits { min: -1e4, max: 1e4, rate_per_s: 100.0, ..InputLimits::NONE };
    for module in ["PIDCTRL_MOD", "PID2_MOD", "PI_MOD", "CASCADE_MOD", "STATE_FEEDBACK_MOD"] {
        let mut bench = controller(module, limits, "TRACKING_TIME 0.1");
        let given = (0..3000).map(|_| given(&mut bench, 1.0)).last().unwrap();
        assert_close(given, 300.0, 1e-3);
        // The integral runs one tick ahead of the tracking: K_I h e.
        assert_close(bench.signal("DES_FORCE")[0] - given, 90.0, 0.02);
    }
}

/// Motion is not allowed for 3 s: the integral ends at `K_I e T_t` instead of `K_I e · 3 s`, and decreases
/// without an error.
#[test]
fn an_integral_follows_the_safe_value_while_motion_is_not_allowed() {
    for module in ["PIDCTRL_MOD", "PID2_MOD", "PI_MOD", "CASCADE_MOD", "STATE_FEEDBACK_MOD"] {
        let mut bench =
            controller(module, InputLimits { max: 1e3, min: -1e3, ..InputLimits::NONE }, "TRACKING_TIME 0.1");
        bench.dimsart.set_motion_allowed(false);
        for _ in 0..3000 {
            let (tick, _) = bench.try_tick(&crate::common::words(&error(1.0)));
            assert_eq!(tick, TickResult::Disarmed);
        }
        assert_close(bench.signal("DES_FORCE")[0], 100.0, 0.02);
        bench.dimsart.set_motion_allowed(true);
        assert!(given(&mut bench, 0.0).abs() < 102.0);
    }
}

/// Without an integral gain, tracking would leave a permanent offset: after saturation a proportional
/// controller commands `K e`.
#[test]
fn a_controller_without_an_integral_gain_keeps_no_offset() {
    let range = InputLimits { min: -20.0, max: 20.0, ..InputLimits::NONE };
    for module in ["PIDCTRL_MOD", "PID2_MOD", "PI_MOD", "CASCADE_MOD", "STATE_FEEDBACK_MOD"] {
        for (limits, more) in [(range, "I_PARAM 0"), (InputLimits::NONE, "I_PARAM 0\nLIMIT 20")] {
            let mut bench = controller(module, limits, more);
            for _ in 0..1000 {
                assert_close(given(&mut bench, 10.0), 20.0, 0.0);
            }
            assert_close((0..3).map(|_| given(&mut bench, 0.5)).last().unwrap(), 5.0, 1e-6);
        }
    }
}

/// A change of the scheme while the device is not limited causes no step, even if the controller's port is
/// bound to a new signal without a value.
#[test]
fn a_controller_that_is_bound_anew_goes_on_without_a_step() {
    let range = InputLimits { min: -200.0, max: 200.0, ..InputLimits::NONE };
    let mut bench = controller("PIDCTRL_MOD", range, "TRACKING_TIME 0.001");
    let before = (0..100).map(|_| given(&mut bench, 1.0)).last().unwrap();
    bench.rows(
        "MOD_ENG BEGIN\nMOD_ENG MOD_OFF PIDCTRL_MOD\nPIDCTRL_MOD PORT_DES_FORCE DES_FORCE.2\nMOD_ENG MOD_ON PIDCTRL_MOD\n\
         LIMIT_MOD PORT_SIGNAL_IN DES_FORCE.2\nLIMIT_MOD PORT_SIGNAL_OUT DES_FORCE\nMOD_ENG MOD_ON LIMIT_MOD\nMOD_ENG COMMIT",
    );
    assert_close(given(&mut bench, 1.0), before + 1.0, 1e-5);
}
