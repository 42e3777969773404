//! Each part of a joint beside its closed form.

use super::*;

fn joint(text: &str) -> Joint {
    let parameters: JointParameters = toml::from_str(text).unwrap();
    parameters.build().unwrap()
}

fn refusal(text: &str) -> String {
    let parameters: JointParameters = toml::from_str(text).unwrap();
    parameters.check().unwrap_err().to_string()
}

/// Ticks of a millisecond with an even command and load.
fn run(joint: &mut Joint, ticks: u32, command: f64, load: f64) -> JointState {
    for tick in 0..ticks {
        joint.advance(f64::from(tick) * 1e-3, 1e-3, command, &|_| load);
    }
    joint.state()
}

fn is_near(found: f64, expected: f64, share: f64) -> bool {
    (found - expected).abs() <= share * expected.abs()
}

const MOTOR: &str = "[motor]\ntorque_constant_nm_per_a = 0.05\nrotor_inertia_kg_m2 = 1e-5\n\
    winding = { resistance_ohm = 1.0, inductance_h = 1e-3";

fn with_motor(load: &str, motor: &str, winding: &str) -> String {
    let [head, tail] = MOTOR.split("winding").collect::<Vec<_>>().try_into().unwrap();
    format!("{load}\n{head}{motor}\nwinding{tail}{winding} }}")
}

#[test]
fn a_free_load_goes_along_a_parabola() {
    let mut joint = joint("load = { inertia = 0.02 }");
    let state = run(&mut joint, 500, 0.3, -0.1);
    assert!(is_near(state.velocity, 0.2 / 0.02 * 0.5, 1e-12), "{state:?}");
    assert!(is_near(state.position, 0.5 * 0.2 / 0.02 * 0.25, 1e-12), "{state:?}");
}

#[test]
fn a_damped_load_comes_to_its_end_speed_as_the_exponential_does() {
    let mut joint = joint("load = { inertia = 0.02, damping = 0.1 }");
    let state = run(&mut joint, 300, 1.0, 0.0);
    assert!(is_near(state.velocity, 10.0 * (1.0 - libm::exp(-1.5)), 1e-9), "{state:?}");
}

#[test]
fn a_pendulum_swings_with_its_frequency() {
    let mut joint = joint("load = { inertia = 0.5, gravity = 5.0, start_position = 0.01 }");
    let rad_per_s = (5.0_f64 / 0.5).sqrt();
    let state = run(&mut joint, 1500, 0.0, 0.0);
    // By a hundredth of a radian, a sine is its argument to 2e-5.
    assert!((state.position - 0.01 * libm::cos(rad_per_s * 1.5)).abs() < 1e-6, "{state:?}");
}

/// Spin-up on the voltage limit: time constant `R J / k²`, end `U / k` (its inductance is small beside that).
#[test]
fn a_motor_on_its_voltage_limit_comes_to_its_no_load_speed() {
    let mut joint = joint(&with_motor("load = { inertia = 4e-5 }", "voltage_limit_v = 10.0", ""));
    let tau_s = 1.0 * 5e-5 / (0.05 * 0.05);
    let state = run(&mut joint, 40, 100.0, 0.0);
    // Of both real poles, exactly.
    let (resistance, inductance, inertia, k) = (1.0, 1e-3, 5e-5, 0.05);
    let (sum, product) = (resistance / inductance, k * k / (inductance * inertia));
    let root = f64::sqrt(sum * sum / 4.0 - product);
    let (slow, fast) = (sum / 2.0 - root, sum / 2.0 + root);
    let end = 10.0 / k;
    let expected =
        end * (1.0 - (fast * libm::exp(-slow * 0.04) - slow * libm::exp(-fast * 0.04)) / (fast - slow));
    assert!(is_near(state.velocity, expected, 1e-6), "{} {expected}, {tau_s}", state.velocity);
    let state = run(&mut joint, 1000, 100.0, 0.0);
    assert!(is_near(state.velocity, end, 1e-6) && is_near(state.voltage_v, 10.0, 1e-12), "{state:?}");
}

#[test]
fn a_current_follows_as_a_first_order_lag_and_stops_at_its_limit() {
    let mut held = joint(&with_motor("load = { inertia = 1e6 }", "current_bandwidth_rad_per_s = 1000.0", ""));
    let state = run(&mut held, 2, 0.05, 0.0);
    assert!(is_near(state.current_a, 1.0 - libm::exp(-2.0), 1e-6), "{state:?}");
    let mut limited = joint(&with_motor("load = { inertia = 1e6 }", "current_limit_a = 3.0", ""));
    let state = run(&mut limited, 100, 50.0, 0.0);
    assert!(is_near(state.current_a, 3.0, 1e-9) && is_near(state.force, 0.15, 1e-3), "{state:?}");
}

/// `T - T_a = R_th P (1 - exp(-t / (R_th C)))`, with a resistance that hardly changes.
#[test]
fn a_winding_gets_warm_by_its_losses() {
    let text = with_motor(
        "load = { inertia = 1e6 }",
        "",
        ", thermal_resistance_k_per_w = 2.0, heat_capacity_j_per_k = 1.0, ambient_c = 25.0",
    );
    let mut joint = joint(&text);
    // 0.5 A through 1 Ω: a quarter of a watt, half a degree, copper 0.2 % more.
    let state = run(&mut joint, 3000, 0.025, 0.0);
    let rise = 0.5 * (1.0 - libm::exp(-1.5));
    assert!(is_near(state.winding_c - 25.0, rise, 3e-3), "{state:?} {rise}");
}

/// Antiresonance: the rotor held, `sqrt(K/M)`; resonance: both free, `sqrt(K (1/B + 1/M))`.
#[test]
fn a_flexible_joint_rings_with_its_resonance() {
    let text = with_motor("load = { inertia = 0.1 }", "", "")
        + "\n[transmission]\nstiffness = 100.0\n[gear]\nratio = 50.0";
    let mut free = joint(&text);
    let rotor = 50.0 * 50.0 * 1e-5;
    let rad_per_s = (100.0 * (1.0 / rotor + 1.0 / 0.1_f64)).sqrt();
    run(&mut free, 5, 0.0, 2.0);
    let mut crossings = Vec::new();
    let mut last = free.state().force;
    for tick in 0..4000 {
        let force = run(&mut free, 1, 0.0, 0.0).force;
        if last < 0.0 && force >= 0.0 {
            crossings.push(f64::from(tick) + last / (last - force));
        }
        last = force;
    }
    let ticks = (crossings[crossings.len() - 1] - crossings[0]) / (crossings.len() - 1) as f64;
    // What the motor's back EMF takes away is 1e-4 of it.
    assert!(is_near(std::f64::consts::TAU / (ticks * 1e-3), rad_per_s, 1e-3), "{ticks} {rad_per_s}");
}

#[test]
fn a_spring_holds_what_pushes_it_and_gives_way_by_its_stiffness() {
    let text = with_motor("load = { inertia = 0.01, damping = 5.0 }", "", "")
        + "\n[transmission]\nstiffness = 100.0\ndamping = 0.5\n[gear]\nratio = 1e5";
    // A rotor that is heavy behind its gear: it stays.
    let mut joint = joint(&text);
    let state = run(&mut joint, 2000, 0.0, 3.0);
    assert!(is_near(state.position, 0.03, 0.02) && is_near(state.force, -3.0, 1e-2), "{state:?}");
}

#[test]
fn inside_its_gap_nothing_is_transmitted_and_a_reversal_loses_the_gap() {
    let text = with_motor("load = { inertia = 0.01, damping = 1.0 }", "", "")
        + "\n[transmission]\nstiffness = 1000.0\ndamping = 1.0\nbacklash = 0.02\n[gear]\nratio = 1.0";
    let transmission = TransmissionParameters { stiffness: 1000.0, damping: 1.0, backlash: 0.02 };
    for ahead in [-0.009, 0.0, 0.009] {
        assert!(transmission.force(ahead, 5.0).abs() <= 0.0);
    }
    let mut joint = joint(&text);
    let there = run(&mut joint, 3000, 0.02, 0.0);
    let back = run(&mut joint, 6000, -0.02, 0.0);
    let [ahead, behind] = [there, back].map(|state| state.motor_position - state.position);
    assert!(is_near(ahead - behind, 0.02 + 2.0 * 0.02 / 1000.0, 0.05), "{ahead} {behind}");
}

/// From a speed `v` it stops after `v² J / (2 Fc)`, and stays.
#[test]
fn dry_friction_stops_a_load_where_its_work_is_its_energy() {
    let mut sliding = joint("load = { inertia = 0.5 }\nfriction = { coulomb = 2.0 }");
    let state = run(&mut sliding, 400, 12.0, 0.0);
    let (from, speed) = (state.position, state.velocity);
    assert!(is_near(speed, 20.0 * 0.4, 1e-9), "{state:?}");
    let state = run(&mut sliding, 4000, 0.0, 0.0);
    assert!(state.velocity.abs() <= 0.0);
    assert!(is_near(state.position - from, speed * speed * 0.5 / 4.0, 1e-4), "{state:?}");
    // Held, up to what it holds.
    let held = run(&mut sliding, 1000, 1.99, 0.0);
    assert!((held.position - state.position).abs() < 1e-9, "{held:?} {state:?}");
    assert!(run(&mut sliding, 100, 2.01, 0.0).velocity > 0.0);
}

#[test]
fn breakaway_takes_more_than_going_on() {
    let friction = "friction = { coulomb = 1.0, breakaway = 1.5, stribeck_velocity = 0.01 }";
    let mut joint = joint(&format!("load = {{ inertia = 0.1 }}\n{friction}"));
    assert!(run(&mut joint, 500, 1.4, 0.0).velocity.abs() <= 0.0);
    run(&mut joint, 50, 1.6, 0.0);
    assert!(run(&mut joint, 500, 1.4, 0.0).velocity > 1.0);
}

/// The published example: presliding stiffness σ0, break-away at Fs, and the Stribeck curve when it goes on.
#[test]
fn lugre_bends_before_it_slides_and_slides_along_its_curve() {
    let text = "load = { inertia = 1.0 }\n[friction]\nviscous = 0.4\ncoulomb = 1.0\nbreakaway = 1.5\n\
        stribeck_velocity = 1e-3\nlugre = { stiffness = 1e5, damping = 316.2 }";
    let mut stuck = joint(text);
    // A small part of what it holds: later, some bristles slip.
    let state = run(&mut stuck, 2000, 0.03, 0.0);
    assert!(is_near(state.position, 0.03 / 1e5, 0.05), "{state:?}");
    let back = run(&mut stuck, 3000, 0.0, 0.0);
    assert!(back.position.abs() < 0.05 * state.position, "it comes back: {back:?}");
    // 1 N more than Coulomb's, over 0.4 N s/m.
    let end = run(&mut joint(text), 20_000, 2.0, 0.0);
    assert!(is_near(end.velocity, 2.5, 0.01), "{end:?}");
    // Slowly: at a speed, what it holds is less.
    let mut loaded = joint(text);
    let mut slides_at_n = None;
    for tick in 0..4000_u32 {
        let force_n = f64::from(tick) * 5e-4;
        let velocity = run(&mut loaded, 1, force_n, 0.0).velocity;
        slides_at_n = slides_at_n.or((velocity > 0.01).then_some(force_n));
    }
    assert!(slides_at_n.is_some_and(|force_n| is_near(force_n, 1.5, 0.05)), "{slides_at_n:?}");
}

#[test]
fn a_gear_loses_its_share_whichever_way_the_power_goes() {
    let text = |efficiency: f64| {
        format!(
            "load = {{ inertia = 0.1, damping = 2.0 }}\ngear = {{ ratio = 10.0, efficiency = {efficiency} }}"
        )
    };
    let driven = run(&mut joint(&text(0.8)), 5000, 4.0, 0.0);
    assert!(is_near(driven.velocity, 0.8 * 4.0 / 2.0, 1e-6), "{driven:?}");
    // The load drives against a braking motor, which gets less than what comes in.
    let braked = run(&mut joint(&text(0.8)), 5000, -4.0, 9.0);
    assert!(is_near(braked.velocity, (9.0 - 4.0 / 0.8) / 2.0, 1e-6), "{braked:?}");
}

#[test]
fn a_stop_gives_back_no_more_than_it_got() {
    for (damping, gives_back) in [(0.0, 1.0), (5.0, 0.9)] {
        let stops = format!("stops = {{ min = -1.0, max = 0.1, stiffness = 2000.0, damping = {damping} }}");
        let mut joint = joint(&format!("load = {{ inertia = 0.2 }}\n{stops}"));
        let before = run(&mut joint, 100, 2.0, 0.0).velocity;
        let after = run(&mut joint, 300, 0.0, 0.0).velocity;
        assert!(after < 0.0 && -after <= gives_back * before * (1.0 + 1e-6), "{before} {after}");
        assert!(damping > 0.0 || is_near(-after, before, 1e-4), "{before} {after}");
    }
}

const THREE_PHASE: &str = "load = { inertia = 1e6 }\n[three_phase]\npole_pairs = 7.0\nflux_vs = 0.005\n\
    current_bandwidth_rad_per_s = 5000.0\nbus_voltage_v = 24.0\nwinding = { resistance_ohm = 0.2, inductance_h = 1e-4 }";

#[test]
fn a_three_phase_motor_makes_its_torque_and_lags_by_its_bandwidth() {
    let mut held = joint(THREE_PHASE);
    let torque_nm = 1.5 * 7.0 * 0.005 * 2.0;
    held.advance(0.0, 2e-4, torque_nm, &|_| 0.0);
    assert!(is_near(held.state().current_a, 2.0 * (1.0 - libm::exp(-1.0)), 1e-5), "{:?}", held.state());
    let state = run(&mut held, 20, torque_nm, 0.0);
    assert!(is_near(state.current_a, 2.0, 1e-9) && is_near(state.force, torque_nm, 1e-3), "{state:?}");
}

/// At no load, the back EMF `p ω ψ` fills the circle of `U/√3`.
#[test]
fn a_three_phase_motor_turns_no_faster_than_its_voltage_circle() {
    let text = THREE_PHASE.replace("inertia = 1e6", "inertia = 1e-4");
    let state = run(&mut joint(&text), 3000, 5.0, 0.0);
    let most = 24.0 / 3.0_f64.sqrt() / (7.0 * 0.005);
    assert!(is_near(state.velocity, most, 0.01), "{state:?} {most}");
    assert!(state.voltage_v <= 24.0 / 3.0_f64.sqrt() * (1.0 + 1e-12));
}

#[test]
fn dead_time_takes_its_share_of_the_voltage() {
    // Without a loop that makes up for it, at rest: the lost voltage as a current.
    let text = THREE_PHASE.replace("bus_voltage_v = 24.0", "bus_voltage_v = 24.0\ndead_time = 0.02");
    let torque_nm = 1.5 * 7.0 * 0.005 * 10.0;
    let current_a = run(&mut joint(&text), 200, torque_nm, 0.0).current_a;
    // L ω_c (i* - i) makes up for 4/π 0.02 24 V.
    let expected = 10.0 - 4.0 / std::f64::consts::PI * 0.02 * 24.0 / (1e-4 * 5000.0);
    assert!(is_near(current_a, expected, 0.01), "{current_a} {expected}");
}

/// What goes in is what moves, what is bent, and what got warm: on a spring, with everything that loses something.
#[test]
fn no_energy_comes_from_nowhere() {
    let text = with_motor("load = { inertia = 0.1, damping = 0.2 }", "", "")
        + "\n[transmission]\nstiffness = 500.0\ndamping = 0.1\nbacklash = 0.01\n\
           [gear]\nratio = 20.0\nefficiency = 0.7\n[friction]\ncoulomb = 0.3\n\
           [stops]\nmin = -0.5\nmax = 0.5\nstiffness = 1000.0\ndamping = 1.0";
    let mut joint = joint(&text);
    let mut given_j = 0.0;
    for tick in 0..5000 {
        let time_s = f64::from(tick) * 1e-3;
        let load = 2.0 * libm::sin(7.0 * time_s);
        let before = joint.state();
        joint.advance(time_s, 1e-3, 3.0 * libm::sin(31.0 * time_s), &|_| load);
        let after = joint.state();
        given_j += load * (after.position - before.position);
        // Electrical power is torque times speed, and what the winding loses comes on top.
        given_j += 0.5e-3
            * 0.05
            * (before.current_a * before.motor_velocity + after.current_a * after.motor_velocity);
        let moves_j = 0.5 * 0.1 * after.velocity * after.velocity
            + 0.5 * 1e-5 * after.motor_velocity * after.motor_velocity;
        assert!(moves_j <= given_j + 2e-3, "{tick}: {moves_j} J of {given_j} J");
    }
    assert!(given_j > 0.1, "{given_j}");
}

#[test]
fn what_cannot_be_is_refused_by_its_name() {
    for (text, expected) in [
        ("load = { inertia = 0.0 }", "load.inertia"),
        ("gear = { efficiency = 1.2 }", "gear.efficiency"),
        ("transmission = { stiffness = 10.0 }", "a spring needs a mass at both ends"),
        ("friction = { breakaway = 1.0 }", "friction.stribeck_velocity"),
        ("stops = { min = 1.0, max = 0.0, stiffness = 1.0 }", "stops.max"),
        (
            "load = { inertia = 1e-9 }\nstops = { min = 0.0, max = 1.0, stiffness = 1e6 }",
            "too many sub-steps",
        ),
    ] {
        let error = refusal(text);
        assert!(error.contains(expected), "{text}: {error}");
    }
}
