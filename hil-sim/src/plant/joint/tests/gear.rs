//! Ratio, losses and lost motion.

use super::*;

fn geared(gear: GearParameters) -> JointParameters {
    JointParameters { gear, ..JointParameters::of_inertia(0.5) }
}

/// An output of ratio `N` feels `N² J`.
#[test]
fn the_output_feels_the_rotor_by_the_square_of_the_ratio() {
    let mut joint = geared(GearParameters { ratio: 100.0, inertia_kg_m2: 5e-5, ..GearParameters::default() })
        .build()
        .unwrap();
    hold(&mut joint, 1000, 2.0, |_, _| {});
    let state = joint.state();
    close(state.velocity, 2.0, 1e-11);
    close(state.motor_velocity, 200.0, 1e-9);
    close(state.force, 1.0, 1e-12);
}

fn lossy() -> GearParameters {
    GearParameters { ratio: 10.0, efficiency: 0.8, backdrive_efficiency: 0.6, ..GearParameters::default() }
}

/// With and without a flexible element.
fn lossy_joints() -> [JointParameters; 2] {
    let mut flexible = geared(GearParameters { inertia_kg_m2: 1e-6, ..lossy() });
    flexible.flexible = Some(FlexibleParameters { stiffness: 1e4, damping: 10.0 });
    flexible.load.damping = 1.0;
    [geared(lossy()), flexible]
}

/// Driving, `η` of the motor's work arrives; driven back, the motor gets `η'` of the load's.
#[test]
fn a_gear_loses_its_share_of_the_power_in_either_direction() {
    // Motor drives: 10 N m wanted, 8 arrive.
    let mut joint = geared(lossy()).build().unwrap();
    hold(&mut joint, 1000, 10.0, |_, state| close(state.force, 8.0, 1e-12));
    close(joint.state().velocity, 16.0, 1e-10);
    let energy = joint.energy();
    let motor_j = 10.0 * joint.state().position;
    close(energy.supplied_j / motor_j, 1.0, 1e-9);
    close(energy.stored_j / motor_j, 0.8, 1e-9);
    close(energy.dissipated_j / motor_j, 0.2, 1e-9);

    // The load drives against 6 N m: the gear holds with 10, the motor gets 6.
    let mut joint = geared(lossy()).build().unwrap();
    for tick in 0..1000_u32 {
        joint.advance(f64::from(tick) * PERIOD_S, PERIOD_S, -6.0, &|_| 11.0);
        close(joint.state().force, -10.0, 1e-12);
    }
    close(joint.state().velocity, 2.0, 1e-10);
    let energy = joint.energy();
    let passed_j = 10.0 * joint.state().position;
    close(energy.dissipated_j / passed_j, 0.4, 1e-9);
}

/// At rest its losses hold any load between `η τ` and `τ/η'`: 8 to 16.7 N m for 10.
#[test]
fn a_lossy_gear_holds_what_lies_between_its_two_efficiencies() {
    for (load, direction) in [(-7.9, 1.0), (-8.1, 0.0), (-10.0, 0.0), (-16.6, 0.0), (-16.8, -1.0)] {
        let mut joint = geared(lossy()).build().unwrap();
        for tick in 0..200_u32 {
            joint.advance(f64::from(tick) * PERIOD_S, PERIOD_S, 10.0, &|_| load);
        }
        let velocity = joint.state().velocity;
        assert!(
            if direction == 0.0 { velocity == 0.0 } else { velocity * direction > 1e-3 },
            "{load} N m: {velocity} rad/s"
        );
    }
    // Behind a spring the load settles on it, then the rotor rests.
    for parameters in lossy_joints() {
        let mut joint = parameters.build().unwrap();
        for tick in 0..3000_u32 {
            let t = f64::from(tick) * PERIOD_S;
            joint.advance(t, PERIOD_S, 10.0 * (1.0_f64).min(2.0 * t), &|t| -12.0 * (1.0_f64).min(2.0 * t));
        }
        close(joint.state().motor_velocity, 0.0, 1e-9);
        close(joint.state().velocity, 0.0, 1e-6);
    }
}

/// Nothing acts inside the gap; a reversal loses the whole of it and twice the wind-up `τ/K`.
#[test]
fn backlash_transmits_nothing_inside_its_gap_and_is_lost_on_reversal() {
    let backlash = 0.02;
    let motor = BrushedParameters { viscous_nms_per_rad: 1e-4, ..BrushedParameters::default() };
    let mut parameters = JointParameters {
        gear: GearParameters { ratio: 50.0, backlash, ..GearParameters::default() },
        flexible: Some(FlexibleParameters { stiffness: 2000.0, damping: 0.05 }),
        motor: JointMotorParameters::Brushed(motor),
        ..JointParameters::of_inertia(0.5)
    };
    // As good as locked.
    parameters.load.inertia = 1e9;
    let mut joint = parameters.build().unwrap();
    let mut in_gap = 0_u32;
    let mut settle = |command: f64| {
        hold(&mut joint, 2000, command, |_, state| {
            let twist = state.motor_position / 50.0 - state.position;
            if twist.abs() < 0.5 * backlash {
                in_gap += 1;
                close(state.force, 0.0, 0.0);
            } else {
                assert!(state.force * twist >= 0.0, "teeth pull: {state:?}");
            }
        });
        close(joint.state().force, command, 1e-6);
        joint.state().motor_position / 50.0 - joint.state().position
    };
    let (there, back) = (settle(1.0), settle(-1.0));
    assert!(in_gap > 10, "{in_gap}");
    println!("lost motion: off by {:.1e} rad", (there - back - backlash - 2.0 / 2000.0).abs());
    close(there - back, backlash + 2.0 / 2000.0, 1e-9);
}
