//! Exact steps against closed forms, and against Runge-Kutta steps of a fraction of their length.

use super::*;

/// A brushed motor behind a gear on a damped load, within its voltage.
fn driven() -> JointParameters {
    let mut parameters = JointParameters::of_inertia(0.05);
    parameters.load.damping = 0.4;
    parameters.gear = GearParameters { ratio: 20.0, inertia_kg_m2: 2e-6, ..GearParameters::default() };
    let motor = BrushedParameters { voltage_limit_v: f64::INFINITY, ..BrushedParameters::default() };
    parameters.motor = JointMotorParameters::Brushed(motor);
    parameters
}

/// `i = I (1 - e^(-w t))`, `M v' + b v = N k i`: `v = V (1 - (w e^(-s t) - s e^(-w t))/(w - s))`, `s = b/M`, `V = N k I/b`.
/// What the winding turns to heat is `∫ R i²`, what the damper does is `∫ b v²`.
#[test]
fn a_motor_within_its_voltage_follows_its_closed_form_and_so_do_its_energies() {
    let BrushedParameters {
        resistance_ohm, torque_constant_nm_per_a, current_bandwidth_rad_per_s: w, ..
    } = BrushedParameters::default();
    let (inertia, damping) = (0.05 + 400.0 * (2e-6 + 1.08e-6), 0.4);
    let (s, current_a) = (damping / inertia, 3.0);
    let speed = 20.0 * torque_constant_nm_per_a * current_a / damping;
    // v = speed (1 + p e^(-s t) + q e^(-w t)), i = current_a (1 - e^(-w t)).
    let (p, q) = (-w / (w - s), s / (w - s));
    let decayed = |rate: f64, t: f64| libm::exp(-rate * t);
    let integral = |rate: f64, t: f64| (1.0 - decayed(rate, t)) / rate;
    let (mut worst, mut heat) = (Worst::default(), Worst::default());
    let mut joint = driven().build().unwrap();
    hold(&mut joint, 300, 20.0 * torque_constant_nm_per_a * current_a, |t, state| {
        worst.see(state.velocity, speed * (1.0 + p * decayed(s, t) + q * decayed(w, t)));
        worst.see(state.position, speed * (t + p * integral(s, t) + q * integral(w, t)));
        worst.see(state.current_a, current_a * (1.0 - decayed(w, t)));
    });
    worst.below("driven joint", 1e-12);
    let t = 0.3;
    let copper_j = resistance_ohm * current_a * current_a * (t - 2.0 * integral(w, t) + integral(2.0 * w, t));
    let squares = t + p * p * integral(2.0 * s, t) + q * q * integral(2.0 * w, t);
    let products = p * integral(s, t) + q * integral(w, t) + p * q * integral(s + w, t);
    heat.see(joint.energy().dissipated_j, copper_j + damping * speed * speed * (squares + 2.0 * products));
    heat.below("heat of winding and damper, J", 1e-11);
}

/// A joint that takes Runge-Kutta steps only, eight times as many as it would.
fn reference(parameters: &JointParameters) -> Joint {
    let mut joint = parameters.build().unwrap();
    joint.sub_steps_per_s = 8.0 * joint.sub_steps_per_s.max(20.0 / PERIOD_S);
    (joint.exact, joint.mechanics.winding) = (None, None);
    joint
}

/// A joint, the amplitude of its command, `N m`, and by how much position and velocity may differ: where both locate an event
/// within their own 30 ns, by what comes of that.
fn cases() -> [(&'static str, JointParameters, f64, [f64; 2]); 8] {
    let thermal = Some(ThermalParameters { capacity_j_per_k: 0.5, ..ThermalParameters::default() });
    let warming = BrushedParameters { viscous_nms_per_rad: 1e-6, thermal, ..BrushedParameters::default() };
    let mut on_spring = driven();
    on_spring.motor = JointMotorParameters::Brushed(warming.clone());
    (on_spring.load.stiffness, on_spring.load.rest_position) = (8.0, 0.1);
    let mut at_stop = on_spring.clone();
    at_stop.stops = Some(StopsParameters { min: -0.05, max: 0.04, stiffness: 4e3, damping: 1.0 });
    let mut rubbing = driven();
    rubbing.friction = FrictionParameters {
        coulomb: 0.2,
        breakaway: 0.35,
        stribeck_velocity: 0.1,
        ..FrictionParameters::default()
    };
    let mut creeping = rubbing.clone();
    creeping.load.gravity_force_n = -0.4;
    let mut lossy = rubbing.clone();
    (lossy.gear.efficiency, lossy.gear.backdrive_efficiency) = (0.8, 0.7);
    let mut hanging = driven();
    hanging.load.gravity_torque_nm = 1.2;
    let mut three_phase = hanging.clone();
    three_phase.motor = JointMotorParameters::ThreePhase(ThreePhaseParameters::default());
    let mut weak = on_spring.clone();
    weak.motor = JointMotorParameters::Brushed(BrushedParameters { voltage_limit_v: 6.0, ..warming });
    [
        ("on a spring", on_spring, 1.5, [1e-11, 1e-10]),
        ("at a stop", at_stop, 1.5, [1e-6, 1e-4]),
        ("rubbing", rubbing, 1.0, [1e-7, 1e-6]),
        ("creeping", creeping, 0.03, [1e-9, 1e-9]),
        ("lossy", lossy, 1.0, [1e-7, 1e-6]),
        ("hanging", hanging, 1.5, [1e-11, 2e-10]),
        ("three phases", three_phase, 1.5, [1e-11, 2e-10]),
        ("short of voltage", weak, 1.5, [1e-9, 1e-8]),
    ]
}

#[test]
fn exact_steps_lead_to_where_short_runge_kutta_steps_do() {
    for (name, parameters, amplitude, [position_max, velocity_max]) in cases() {
        println!("{name}");
        let (mut exact, mut reference) = (parameters.build().unwrap(), reference(&parameters));
        let [mut position, mut velocity, mut current, mut temperature] = [0.0; 4].map(Worst);
        for tick in 0..600_u32 {
            let t = f64::from(tick) * PERIOD_S;
            let command = amplitude * libm::sin(30.0 * t);
            let push = |t: f64| 0.2 * libm::cos(50.0 * t);
            exact.advance(t, PERIOD_S, command, &push);
            reference.advance(t, PERIOD_S, command, &push);
            let (one, other) = (exact.state(), reference.state());
            position.see(one.position, other.position);
            velocity.see(one.velocity, other.velocity);
            current.see(one.current_a, other.current_a);
            temperature.see(one.winding_c, other.winding_c);
        }
        position.below("position, rad", position_max);
        velocity.below("velocity, rad/s", velocity_max);
        current.below("current, A", 1e-8);
        temperature.below("winding, K", 2e-7);
        let (one, other) = (exact.energy(), reference.energy());
        close(one.supplied_j, other.supplied_j, position_max.max(1e-8) * other.supplied_j);
        close(one.dissipated_j, other.dissipated_j, position_max.max(1e-8) * other.supplied_j);
    }
}
