//! `JLIMIT_MOD` at a motor with its winding, its voltage, its gear and friction, pushed at random by force and load.
#![expect(clippy::cast_possible_truncation, reason = "as it is measured")]

use dimsart_core::{Bench, types};
use dimsart_modules::ALL;
use hil_sim::plant::{BrushedParameters, GearParameters, JointMotorParameters, JointParameters};
use proptest::prelude::*;

const HIGH: f64 = 0.7;
const LOW: f64 = -0.5;

/// 4 rad/s² of 0.503 kg m², and 1.5 N m of load: of the 6 N m there is something left.
const ROWS: &str = "all JLIMIT_MOD PORT_FORCE_IN FEED_FORCE\nall JLIMIT_MOD POSITION_LOW -0.5\nall JLIMIT_MOD POSITION_HIGH 0.7
    all JLIMIT_MOD VELOCITY_LIMIT 2\nall JLIMIT_MOD FORCE_LIMIT 6\nall JLIMIT_MOD DECELERATION 4\nall JLIMIT_MOD INERTIA 0.503
    all MOD_ENG MOD_ON JLIMIT_MOD\nall MOD_ENG MATCHING_CHECK";

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn a_joint_with_a_motor_never_goes_beyond_its_limits(
        pushes in prop::collection::vec((-20.0_f32..20.0, -1.5_f64..1.5, 50_u32..600), 30),
    ) {
        let mut parameters = JointParameters::of_inertia(0.5);
        parameters.motor = JointMotorParameters::Brushed(BrushedParameters::default());
        parameters.gear = GearParameters { ratio: 50.0, ..GearParameters::default() };
        parameters.friction.viscous = 0.1;
        let mut joint = parameters.build().unwrap();
        let mut bench = Bench::new(ALL, &[types::POSITION, types::VELOCITY, types::FEED_FORCE], ROWS).unwrap();
        let (period_s, mut time_s, mut travelled) = (1e-3, 0.0, 0.0);
        for (push, load, ticks) in pushes {
            for _ in 0..ticks {
                let state = joint.state();
                let measured = [state.position as f32, state.velocity as f32, push];
                let force = bench.tick(&measured, "DES_FORCE").unwrap();
                joint.advance(time_s, period_s, f64::from(force), &|_| load);
                time_s += period_s;
                travelled += (joint.state().position - state.position).abs();
                let position = joint.state().position;
                // What a load needs to be held, and the lag of the current.
                prop_assert!(position > LOW - 1e-4 && position < HIGH + 1e-4, "{} at {} s", position, time_s);
                prop_assert!(joint.state().velocity.abs() < 2.02, "{} at {} s", joint.state().velocity, time_s);
            }
        }
        prop_assert!(travelled > 0.1, "it moved by {}", travelled);
    }
}
