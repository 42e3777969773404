//! The load alone, and what a file may say.

use super::*;

#[test]
fn a_file_that_names_only_the_load_is_an_ideal_source_on_an_inertia() {
    let parameters: JointParameters = toml::from_str("load.inertia = 0.5").unwrap();
    assert_eq!(parameters, JointParameters::of_inertia(0.5));
    let mut joint = parameters.build().unwrap();
    let (mut position, mut velocity) = (Worst::default(), Worst::default());
    hold(&mut joint, 1000, 2.0, |t, state| {
        position.see(state.position, 2.0 * t * t);
        velocity.see(state.velocity, 4.0 * t);
        close(state.force, 2.0, 0.0);
    });
    position.below("parabola, rad", 1e-11);
    velocity.below("parabola, rad/s", 1e-11);
}

#[test]
fn a_damped_load_reaches_its_terminal_speed_exponentially() {
    let mut parameters = JointParameters::of_inertia(0.5);
    parameters.load.damping = 8.0;
    let mut joint = parameters.build().unwrap();
    let mut velocity = Worst::default();
    hold(&mut joint, 1000, 2.0, |t, state| velocity.see(state.velocity, 0.25 * (1.0 - libm::exp(-16.0 * t))));
    velocity.below("terminal speed, rad/s", 1e-12);
}

/// Small swings at `sqrt(m g l/J)`; a weight along a slide pulls with what it weighs.
#[test]
fn gravity_swings_a_turning_load_and_pulls_a_sliding_one() {
    let mut parameters = JointParameters::of_inertia(0.5);
    parameters.load.gravity_torque_nm = 18.0;
    parameters.load.gravity_angle_rad = 0.3;
    parameters.load.start_position = 0.3001;
    let mut joint = parameters.build().unwrap();
    let mut angle = Worst::default();
    hold(&mut joint, 1000, 0.0, |t, state| angle.see(state.position, 0.3 + 1e-4 * libm::cos(6.0 * t)));
    angle.below("pendulum, rad", 1e-12);

    let mut parameters = JointParameters::of_inertia(2.0);
    parameters.load.gravity_force_n = 19.62;
    let mut joint = parameters.build().unwrap();
    hold(&mut joint, 1000, 0.0, |_, _| {});
    close(joint.state().position, -0.5 * 9.81, 1e-11);
}

/// It shows in the motion of what friction does not hold, and nothing panics or runs on.
#[test]
fn a_command_that_is_no_number_is_applied_as_it_is() {
    for motor in [
        JointMotorParameters::default(),
        JointMotorParameters::Brushed(BrushedParameters::default()),
        JointMotorParameters::ThreePhase(ThreePhaseParameters::default()),
    ] {
        for (friction, flexible) in [(0.0, false), (0.1, false), (0.1, true)] {
            let mut parameters = JointParameters { motor: motor.clone(), ..JointParameters::of_inertia(0.1) };
            parameters.gear.inertia_kg_m2 = 1e-4;
            parameters.gear.efficiency = if friction > 0.0 { 0.8 } else { 1.0 };
            parameters.friction.coulomb = friction;
            parameters.flexible = flexible.then(FlexibleParameters::default);
            parameters.stops = Some(StopsParameters { min: -1.0, max: 1.0, ..StopsParameters::default() });
            let mut joint = parameters.build().unwrap();
            hold(&mut joint, 3, 1.0, |_, _| {});
            hold(&mut joint, 3, f64::NAN, |_, _| {});
            assert!(joint.state().velocity.is_nan(), "{:?}", joint.state());
            let mut joint = parameters.build().unwrap();
            hold(&mut joint, 3, f64::INFINITY, |_, _| {});
        }
    }
}

/// Step response of mass, spring and damper, by whole periods.
#[test]
fn a_spring_swings_as_its_closed_form_says() {
    let mut parameters = JointParameters::of_inertia(0.5);
    (parameters.load.damping, parameters.load.stiffness, parameters.load.rest_position) = (2.0, 400.0, 0.02);
    let (natural, rate) = ((400.0_f64 / 0.5).sqrt(), 2.0 / (2.0 * 0.5));
    let damped = (natural * natural - rate * rate).sqrt();
    hold(&mut parameters.build().unwrap(), 2000, 3.0, |t, state| {
        let end = 0.02 + 3.0 / 400.0;
        let (sine, cosine) = (libm::sin(damped * t), libm::cos(damped * t));
        let position = end * (1.0 - libm::exp(-rate * t) * (cosine + rate / damped * sine));
        close(state.position, position, 1e-13);
    });
}

/// A spring that is let go exerts nothing from then on.
#[test]
fn a_load_that_is_let_go_moves_on_by_itself() {
    let mut parameters = JointParameters::of_inertia(0.5);
    (parameters.load.stiffness, parameters.load.rest_position) = (400.0, 0.02);
    let mut joint = parameters.build().unwrap();
    hold(&mut joint, 20, 0.0, |_, _| {});
    let velocity = joint.state().velocity;
    assert!(velocity > 0.1, "{velocity}");
    joint.set_load_spring(0.0, 0.0);
    hold(&mut joint, 100, 0.0, |_, state| assert_eq!(state.velocity.to_bits(), velocity.to_bits()));
    let energy = joint.energy();
    close(energy.stored_j, 0.5 * 0.5 * velocity * velocity, 1e-12);
    close(energy.supplied_j - energy.dissipated_j, energy.stored_j - 0.5 * 400.0 * 0.02 * 0.02, 1e-12);
}
