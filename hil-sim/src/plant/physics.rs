//! The plants against closed forms and conservation laws.

use super::{
    Axis, AxisTruth, AxisWise, DeviceParameters, Environment, HandParameters, HandPhase, MotorParameters,
    Plant, SpringParameters, WallParameters,
};

const PERIOD_S: f64 = 1e-3;

fn device(mass_kg: f64, damping_ns_per_m: f64) -> DeviceParameters {
    DeviceParameters { mass_kg, damping_ns_per_m, ..DeviceParameters::default() }
}

fn axis(device: DeviceParameters, environments: Vec<Box<dyn Environment>>) -> Axis {
    Axis::new(&device, None, environments).unwrap()
}

/// An axis with nothing around it but a motor.
fn driven(device: DeviceParameters, motor: &MotorParameters) -> Axis {
    Axis::new(&device, Some(motor), Vec::new()).unwrap()
}

/// Holds `command_n` for `ticks`, calling `each` after every one of them.
fn hold(axis: &mut Axis, ticks: u32, command_n: f64, mut each: impl FnMut(f64, AxisTruth)) {
    for tick in 0..ticks {
        axis.advance(f64::from(tick) * PERIOD_S, PERIOD_S, command_n);
        each(f64::from(tick + 1) * PERIOD_S, axis.truth());
    }
}

#[track_caller]
fn close(actual: f64, expected: f64, tolerance: f64) {
    assert!((actual - expected).abs() <= tolerance, "{actual:e} instead of {expected:e}");
}

#[test]
fn a_free_mass_falls_as_galileo_says() {
    let mut axis = axis(device(0.25, 0.0), vec![]);
    hold(&mut axis, 1000, 2.0, |t, truth| {
        close(truth.position_m, 4.0 * t * t, 1e-12);
        close(truth.velocity_m_per_s, 8.0 * t, 1e-12);
    });
}

#[test]
fn a_damped_mass_reaches_its_terminal_speed_exponentially() {
    let mut axis = axis(device(0.5, 8.0), vec![]);
    hold(&mut axis, 1000, 2.0, |t, truth| {
        let decay = libm::exp(-16.0 * t);
        close(truth.velocity_m_per_s, 0.25 * (1.0 - decay), 1e-14);
        close(truth.position_m, 0.25 * (t - (1.0 - decay) / 16.0), 1e-13);
    });
}

/// Step response of mass, spring and damper, the spring once as a spring and once as a hand's.
#[test]
fn a_spring_swings_as_its_closed_form_says() {
    let spring =
        SpringParameters { rest_position_m: 0.02, stiffness_n_per_m: 400.0, ..SpringParameters::default() };
    let hold_still = HandPhase::Hold { start_s: 0.0, end_s: f64::INFINITY, target_m: 0.02 };
    let hand = HandParameters {
        mass_kg: 0.3,
        damping_ns_per_m: 1.5,
        stiffness_n_per_m: 400.0,
        phases: vec![hold_still],
    };
    let natural = (400.0_f64 / 0.5).sqrt();
    let rate = 2.0 / (2.0 * 0.5);
    let damped = (natural * natural - rate * rate).sqrt();
    for mut axis in [
        axis(device(0.5, 2.0), vec![Box::new(spring.build().unwrap())]),
        axis(device(0.2, 0.5), vec![Box::new(hand.build().unwrap())]),
    ] {
        hold(&mut axis, 2000, 3.0, |t, truth| {
            let end_m = 0.02 + 3.0 / 400.0;
            let (sine, cosine) = (libm::sin(damped * t), libm::cos(damped * t));
            let position_m = end_m * (1.0 - libm::exp(-rate * t) * (cosine + rate / damped * sine));
            close(truth.position_m, position_m, 1e-13);
        });
    }
}

/// The hand pushes itself and the device; a sensor between them feels the device's share only.
#[test]
fn what_a_hand_exerts_is_perceived_behind_its_own_mass() {
    let push = HandPhase::Push { start_s: 0.0, end_s: 1.0, force_n: 3.0 };
    let hand = HandParameters {
        mass_kg: 0.4,
        damping_ns_per_m: 0.0,
        phases: vec![push],
        ..HandParameters::default()
    };
    let mut axis = axis(device(0.2, 0.0), vec![Box::new(hand.build().unwrap())]);
    hold(&mut axis, 1000, 0.0, |t, truth| {
        close(truth.velocity_m_per_s, 5.0 * t, 1e-12);
        close(truth.hand_force_n, 1.0, 1e-12);
    });
    hold(&mut axis, 1, -3.0, |_, truth| close(truth.hand_force_n, 3.0, 1e-12));
}

/// A target on the move: the force it exerts grows by ramps, which are stepped exactly, so 20 sub-steps and 2000
/// sub-steps within the same straight lines agree.
#[test]
fn a_moving_hand_does_not_feel_the_sub_steps() {
    let to = HandPhase::Move { start_s: 0.0, end_s: 0.1, from_m: 0.0, to_m: 0.1 };
    let hand = HandParameters { phases: vec![to], ..HandParameters::default() };
    let mut axis = axis(device(0.1, 0.0), vec![Box::new(hand.build().unwrap())]);
    let (mass, damping, stiffness) = (0.6, 8.0, 300.0);
    let target = |t: f64| 0.1 * (t * t * t * (10.0 + t * (-15.0 + 6.0 * t)));
    let (mut x, mut v) = (0.0_f64, 0.0_f64);
    hold(&mut axis, 100, 0.0, |t, truth| {
        let (from_m, to_m) = (target((t - PERIOD_S) * 10.0), target(t * 10.0));
        let step_s = PERIOD_S / 2000.0;
        for k in 0..2000_u32 {
            let middle_m = from_m + (to_m - from_m) * ((f64::from(k) + 0.5) / 2000.0);
            let a = |x: f64, v: f64| (stiffness * (middle_m - x) - damping * v) / mass;
            let (x2, v2) = (x + 0.5 * step_s * v, v + 0.5 * step_s * a(x, v));
            (x, v) = (x + step_s * v2, v + step_s * a(x2, v2));
        }
        close(truth.position_m, x, 1e-11);
        close(truth.velocity_m_per_s, v, 1e-10);
    });
}

/// Throws `mass_kg` at 0.1 m/s against a wall; what the wall did, and the speed after it.
fn bounce(mass_kg: f64, wall: WallParameters) -> (f64, f64) {
    let mut axis = axis(device(mass_kg, 0.0), vec![Box::new(wall.build().unwrap())]);
    hold(&mut axis, 100, mass_kg, |_, _| {});
    close(axis.truth().velocity_m_per_s, 0.1, 1e-14);
    let mut largest_n: f64 = 0.0;
    hold(&mut axis, 2000, 0.0, |_, truth| {
        assert!(truth.wall_force_n <= 0.0, "a wall does not pull");
        assert_eq!(truth.is_in_contact, truth.wall_force_n < 0.0);
        largest_n = largest_n.max(-truth.wall_force_n);
    });
    assert!(!axis.truth().is_in_contact && axis.truth().position_m < 0.05, "it came back");
    (largest_n, axis.truth().velocity_m_per_s)
}

/// An undamped wall gives back all energy, whether it is soft or rigid; in between it stores it.
#[test]
fn an_undamped_wall_gives_back_what_it_takes() {
    for (stiffness_n_per_m, tolerance) in [(1e3, 1e-7), (1e4, 1e-7), (1e6, 1e-6), (f64::INFINITY, 1e-5)] {
        let (largest_n, speed) =
            bounce(0.5, WallParameters { stiffness_n_per_m, ..WallParameters::default() });
        close(speed, -0.1, 0.1 * tolerance);
        if stiffness_n_per_m <= 1e4 {
            close(largest_n, 0.1 * (0.5 * stiffness_n_per_m).sqrt(), 0.01 * largest_n);
        }
    }
}

/// A damped wall keeps `∫ B v²`: the mass leaves where its acceleration is zero, at the closed form's speed there.
#[test]
fn a_damped_wall_keeps_what_it_dissipates() {
    for (stiffness_n_per_m, damping_ns_per_m) in [(1e4, 10.0), (1e4, 80.0), (1e6, 200.0)] {
        let wall = WallParameters { stiffness_n_per_m, damping_ns_per_m, ..WallParameters::default() };
        let (_, speed) = bounce(0.5, wall);
        let (natural, rate) = ((stiffness_n_per_m / 0.5).sqrt(), damping_ns_per_m);
        let damped = (natural * natural - rate * rate).sqrt();
        let angle = libm::atan2(2.0 * rate * damped, rate * rate - damped * damped);
        let decay = libm::exp(-rate * angle / damped);
        let exact = 0.1 * decay * (libm::cos(angle) - rate / damped * libm::sin(angle));
        // The damper jumps in at the surface, which is found within 49 ns.
        close(speed, exact, damping_ns_per_m * 0.1 / 0.5 * 49e-9);
    }
}

#[test]
fn a_push_on_a_rigid_wall_settles() {
    let wall =
        WallParameters { stiffness_n_per_m: f64::INFINITY, position_m: 0.001, ..WallParameters::default() };
    let mut axis = axis(device(0.5, 8.0), vec![Box::new(wall.build().unwrap())]);
    hold(&mut axis, 6000, 2.0, |_, _| {});
    let truth = axis.truth();
    close(truth.wall_force_n, -2.0, 1e-6);
    close(truth.position_m, 0.001 + 2e-9, 1e-14);
    assert!(truth.is_in_contact);
}

#[test]
fn friction_stops_a_mass_after_v2_m_over_2_fc_for_good() {
    let mut axis = axis(DeviceParameters { coulomb_friction_n: 0.3, ..device(0.2, 0.0) }, vec![]);
    hold(&mut axis, 100, 0.5, |t, truth| close(truth.velocity_m_per_s, t, 1e-13));
    let start_m = axis.truth().position_m;
    hold(&mut axis, 200, 0.0, |t, truth| close(truth.velocity_m_per_s, (0.1 - 1.5 * t).max(0.0), 1e-7));
    let stopped = axis.truth();
    close(stopped.position_m - start_m, 0.1 * 0.1 * 0.2 / (2.0 * 0.3), 1e-12);
    for command_n in [0.0, 0.3, -0.3, 0.29, 0.0] {
        hold(&mut axis, 100, command_n, |_, truth| {
            assert_eq!(truth.position_m.to_bits(), stopped.position_m.to_bits(), "sticks at {command_n} N");
            assert_eq!(truth.velocity_m_per_s.to_bits(), 0.0_f64.to_bits());
        });
    }
    hold(&mut axis, 10, -0.31, |t, truth| close(truth.velocity_m_per_s, -0.05 * t, 1e-12));
}

/// On a spring, each half swing is `2 Fc/K` shorter, until the spring is too weak to break loose.
#[test]
fn friction_shortens_each_swing_by_the_same_amount() {
    let spring = SpringParameters { stiffness_n_per_m: 100.0, ..SpringParameters::default() };
    let device = DeviceParameters { start_position_m: 0.0525, coulomb_friction_n: 0.5, ..device(0.1, 0.0) };
    let mut axis = axis(device, vec![Box::new(spring.build().unwrap())]);
    let half_swing_s = core::f64::consts::PI * (0.1_f64 / 100.0).sqrt();
    for swing in 1..=10_u32 {
        for _ in 0..100 {
            axis.advance(0.0, half_swing_s / 100.0, 0.0);
        }
        let turning_m = (0.0525 - 0.01 * f64::from(swing)).abs().max(0.0025);
        if swing <= 5 {
            close(axis.truth().position_m.abs(), turning_m, 1e-9);
        }
    }
    let rest_m = axis.truth().position_m;
    close(rest_m, -0.0025, 1e-9);
    hold(&mut axis, 10, 0.0, |_, truth| assert_eq!(truth.position_m.to_bits(), rest_m.to_bits()));
}

/// The same where a sub-step takes 6.9 rad: a swing and a tenth, back to the same direction.
#[test]
fn friction_is_not_lost_between_sub_steps() {
    let spring = SpringParameters { stiffness_n_per_m: 1e9, ..SpringParameters::default() };
    let device =
        DeviceParameters { start_position_m: 5.25e-9, coulomb_friction_n: 0.5, ..device(0.0525, 0.0) };
    let mut axis = axis(device, vec![Box::new(spring.build().unwrap())]);
    hold(&mut axis, 1, 0.0, |_, truth| {
        close(truth.position_m, -2.5e-10, 1e-12);
        assert_eq!(truth.velocity_m_per_s.to_bits(), 0.0_f64.to_bits());
    });
}

/// `i/i_ref = wc/(s + wc)` whatever the mass does, as long as the voltage suffices.
#[test]
fn a_motor_follows_as_a_first_order_lag() {
    let motor = MotorParameters { voltage_limit_v: f64::INFINITY, ..MotorParameters::default() };
    let wc = motor.current_bandwidth_rad_per_s;
    let mut axis = driven(device(0.1, 1.0), &motor);
    let force_per_current = motor.torque_constant_nm_per_a * motor.transmission_rad_per_m;
    for k in 1..=100_u32 {
        axis.advance(0.0, 1e-5, 2.0);
        let truth = axis.truth();
        let force_n = 2.0 * (1.0 - libm::exp(-wc * f64::from(k) * 1e-5));
        close(truth.actuator_force_n, force_n, 1e-13);
        close(truth.motor.unwrap().current_a, force_n / force_per_current, 1e-13);
    }
    let mut lag = driven(device(0.1, 1.0), &motor);
    lag.advance(0.0, 1.0 / wc, 2.0);
    close(lag.truth().actuator_force_n, 2.0 * (1.0 - libm::exp(-1.0)), 1e-13);
}

#[test]
fn a_stalled_motor_gives_kt_v_over_r() {
    let motor = MotorParameters { voltage_limit_v: 6.0, ..MotorParameters::default() };
    let mut axis = driven(device(1e12, 0.0), &motor);
    hold(&mut axis, 10, 1e3, |_, _| {});
    let torque_nm = axis.truth().actuator_force_n / motor.transmission_rad_per_m;
    close(torque_nm, 0.0234 * 6.0 / 2.32, 1e-12);
    close(axis.truth().motor.unwrap().voltage_v, 6.0, 1e-12);
}

/// `w = V/Ke - R/(Kt Ke) τ`, approached at the mechanical time constant `R J/Kt²`.
#[test]
fn a_free_motor_runs_up_to_its_no_load_speed() {
    let motor = MotorParameters { voltage_limit_v: 6.0, ..MotorParameters::default() };
    for coulomb_friction_n in [0.0, 0.5] {
        let mut axis = driven(DeviceParameters { coulomb_friction_n, ..device(0.1, 0.0) }, &motor);
        let no_load =
            6.0 / 0.0234 - 2.32 / (0.0234 * 0.0234) * coulomb_friction_n / motor.transmission_rad_per_m;
        let inertia_kg_m2 = 1.08e-6 + 0.1 / motor.transmission_rad_per_m.powi(2);
        let mechanical_s = 2.32 * inertia_kg_m2 / (0.0234 * 0.0234);
        axis.advance(0.0, 3.0 * mechanical_s, 1e3);
        let early = 1.0 - axis.truth().velocity_m_per_s * motor.transmission_rad_per_m / no_load;
        close(early / libm::exp(-3.0), 1.0, 0.01);
        axis.advance(0.0, 40.0 * mechanical_s, 1e3);
        close(axis.truth().velocity_m_per_s * motor.transmission_rad_per_m, no_load, 1e-9 * no_load);
    }
}

/// `∫ V i dt = ∫ R i² dt + L i²/2 + m v²/2 + friction`, through saturation and back.
#[test]
fn a_motor_makes_no_energy() {
    let motor = MotorParameters { voltage_limit_v: 3.0, ..MotorParameters::default() };
    let mut axis = driven(device(0.05, 0.2), &motor);
    let mass_kg = 0.05 + motor.rotor_inertia_kg_m2 * motor.transmission_rad_per_m.powi(2);
    let power_w = |truth: &AxisTruth| {
        let electric = truth.motor.unwrap();
        let lost_w = 2.32 * electric.current_a.powi(2) + 0.2 * truth.velocity_m_per_s.powi(2);
        electric.voltage_v * electric.current_a - lost_w
    };
    let (mut given_j, mut saturated) = (0.0, 0);
    for tick in 0..40_000_u32 {
        let command_n = if tick < 20_000 { 1.4 } else { -1.4 };
        axis.advance(0.0, 5e-7, command_n);
        given_j += 1e-6 * power_w(&axis.truth());
        axis.advance(0.0, 5e-7, command_n);
        let truth = axis.truth();
        saturated += u32::from(truth.motor.unwrap().voltage_v.abs() > 2.9999);
        let stored_j = 0.5 * mass_kg * truth.velocity_m_per_s.powi(2)
            + 0.5 * 2.38e-4 * truth.motor.unwrap().current_a.powi(2);
        close(given_j, stored_j, 1e-6);
    }
    assert!((1000..39_000).contains(&saturated), "{saturated} of 40000 saturated");
}

fn busy_scene() -> AxisWise {
    let hand = HandParameters {
        phases: vec![
            HandPhase::Move { start_s: 0.0, end_s: 0.3, from_m: 0.0, to_m: 0.06 },
            HandPhase::Sine {
                start_s: 0.3,
                end_s: 0.8,
                center_m: 0.04,
                amplitude_m: 0.03,
                frequency_hz: 5.0,
            },
        ],
        ..HandParameters::default()
    };
    let device =
        DeviceParameters { coulomb_friction_n: 0.2, encoder_step_m: 3e-5, ..DeviceParameters::default() };
    let axis = |()| {
        let wall = WallParameters::default().build().unwrap();
        let environments: Vec<Box<dyn Environment>> = vec![Box::new(hand.build().unwrap()), Box::new(wall)];
        Axis::new(&device, Some(&MotorParameters::default()), environments).unwrap()
    };
    AxisWise::new([(); 2].map(axis).into())
}

#[test]
fn the_same_calls_give_the_same_bits() {
    let (mut one, mut two) = (busy_scene(), busy_scene());
    let (mut contacts, mut position_m) = (0, [0.0; 2]);
    for tick in 0..1000_u32 {
        let command_n = if tick % 100 < 50 { [0.7] } else { [-0.9] };
        for plant in [&mut one, &mut two] {
            plant.advance(f64::from(tick) * PERIOD_S, PERIOD_S, &command_n);
        }
        two.sense(&mut position_m);
        for axis in 0..2 {
            let (one, two) = (one.truth(axis).unwrap(), two.truth(axis).unwrap());
            assert_eq!(one.position_m.to_bits(), two.position_m.to_bits());
            assert_eq!(one.velocity_m_per_s.to_bits(), two.velocity_m_per_s.to_bits());
            assert_eq!(one.actuator_force_n.to_bits(), two.actuator_force_n.to_bits());
            contacts += u32::from(one.is_in_contact);
        }
    }
    assert!((100..1900).contains(&contacts), "{contacts} contacts: the scene has events");
}

#[test]
fn a_plant_takes_any_number_of_commands_and_readings() {
    let mut plant = busy_scene();
    assert_eq!(plant.dof(), 2);
    plant.advance(0.0, PERIOD_S, &[]);
    plant.advance(PERIOD_S, PERIOD_S, &[0.1, 0.2, 0.3]);
    let mut position_m = [7.0; 3];
    plant.sense(&mut position_m);
    assert!(position_m[0].abs() < 1.0 && position_m[1].abs() < 1.0 && position_m[2] > 6.0);
    plant.sense(&mut []);
    assert!(plant.truth(1).is_some() && plant.truth(2).is_none());
}

#[test]
fn a_faulty_command_stays_visible() {
    let wall = WallParameters { stiffness_n_per_m: f64::INFINITY, ..WallParameters::default() };
    for command_n in [f64::NAN, f64::INFINITY] {
        let mut axis = axis(device(0.1, 1.0), vec![Box::new(wall.build().unwrap())]);
        hold(&mut axis, 3, command_n, |_, truth| {
            assert!(!truth.position_m.is_finite() && !truth.actuator_force_n.is_finite(), "{truth:?}");
        });
    }
}

#[test]
fn an_impossible_axis_is_refused_by_place() {
    let refused =
        |device, motor: Option<&MotorParameters>| Axis::new(&device, motor, vec![]).unwrap_err().path;
    assert_eq!(refused(device(-0.2, 0.0), None), "device.mass_kg");
    let motor = MotorParameters { voltage_limit_v: f64::NAN, ..MotorParameters::default() };
    assert_eq!(refused(device(0.2, 0.0), Some(&motor)), "motor.voltage_limit_v");
}
