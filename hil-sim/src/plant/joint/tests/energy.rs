//! No joint makes energy, whatever it is put together from.

use super::*;
use proptest::prelude::*;

fn motor() -> impl Strategy<Value = JointMotorParameters> {
    let dry = prop_oneof![Just(0.0), 1e-4..5e-3];
    let brushed = (dry, prop_oneof![Just(f64::INFINITY), 0.5..5.0], 2.0..40.0).prop_map(
        |(coulomb_nm, current_limit_a, voltage_limit_v)| {
            JointMotorParameters::Brushed(BrushedParameters {
                coulomb_nm,
                current_limit_a,
                voltage_limit_v,
                viscous_nms_per_rad: 1e-6,
                thermal: Some(ThermalParameters::default()),
                ..BrushedParameters::default()
            })
        },
    );
    let three_phase = (2e-4..6e-4, 4.0..60.0, 0.0..0.05, 0.0..5e-3).prop_map(
        |(quadrature_inductance_h, supply_v, dead_time_share, coulomb_nm)| {
            JointMotorParameters::ThreePhase(ThreePhaseParameters {
                quadrature_inductance_h,
                supply_v,
                dead_time_share,
                coulomb_nm,
                ..ThreePhaseParameters::default()
            })
        },
    );
    prop_oneof![Just(JointMotorParameters::default()), brushed, three_phase]
}

fn friction() -> impl Strategy<Value = FrictionParameters> {
    let dry = (0.0..0.5, 1.0..2.0).prop_map(|(coulomb, excess)| FrictionParameters {
        coulomb,
        breakaway: coulomb * excess,
        ..FrictionParameters::default()
    });
    // LuGre itself is passive only where σ2 > σ1 (Fs - Fc)/Fc (Barahona and Canudas de Wit, "Passivity of the LuGre
    // model revisited", 2000).
    let bristles = (0.05..0.5, 1.0..1.5, 0.1..3.0).prop_map(|(coulomb, excess, damping)| {
        let viscous = 0.01 + 1.1 * damping * (excess - 1.0);
        FrictionParameters {
            coulomb,
            breakaway: coulomb * excess,
            stribeck_velocity: 0.05,
            viscous,
            presliding_stiffness: 2000.0,
            presliding_damping: damping,
        }
    });
    prop_oneof![Just(FrictionParameters::default()), dry, bristles]
}

fn joints() -> impl Strategy<Value = JointParameters> {
    let gear = (1.0..60.0, 0.4..1.0, 0.3..1.0, any::<bool>()).prop_map(
        |(ratio, efficiency, backdrive_efficiency, is_lossy)| {
            let gear = GearParameters { ratio, inertia_kg_m2: 1e-5, ..GearParameters::default() };
            if is_lossy { GearParameters { efficiency, backdrive_efficiency, ..gear } } else { gear }
        },
    );
    let flexible = prop::option::of((100.0..3000.0, 0.0..2.0, prop_oneof![Just(0.0), 0.001..0.05]));
    let stops = prop::option::of((0.02..0.5, 0.0..20.0));
    (0.02..1.0, motor(), gear, flexible, friction(), stops, -3.0..3.0).prop_map(
        |(inertia, motor, gear, flexible, friction, stops, gravity_torque_nm)| {
            let mut parameters =
                JointParameters { motor, gear, friction, ..JointParameters::of_inertia(inertia) };
            parameters.load.gravity_torque_nm = gravity_torque_nm;
            parameters.load.damping = 0.01;
            if let Some((stiffness, damping, backlash)) = flexible {
                parameters.flexible = Some(FlexibleParameters { stiffness, damping });
                parameters.gear.backlash = backlash;
            }
            parameters.stops = stops.map(|(reach, damping): (f64, f64)| StopsParameters {
                min: -reach,
                max: reach,
                stiffness: 3000.0,
                damping,
            });
            parameters
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(48) })]

    /// Supplied = dissipated + gain of what is stored; and what is dissipated only grows.
    #[test]
    fn energy_is_kept_and_never_made(
        parameters in joints(),
        command in -4.0..4.0_f64,
        push in -2.0..2.0_f64,
        rad_per_s in 2.0..80.0_f64,
    ) {
        let mut joint = parameters.build().unwrap();
        let start_j = joint.energy().stored_j;
        let (mut passed_j, mut previous) = (1e-3, joint.energy());
        for tick in 0..300_u32 {
            let t = f64::from(tick) * PERIOD_S;
            let wanted = command * libm::sin(rad_per_s * t);
            joint.advance(t, PERIOD_S, wanted, &|t| push * libm::cos(1.7 * rad_per_s * t));
            let energy = joint.energy();
            passed_j += (energy.supplied_j - previous.supplied_j).abs();
            let lost_j = energy.dissipated_j - previous.dissipated_j;
            prop_assert!(lost_j >= -1e-9 * passed_j, "gained {} J at {t} s", -lost_j);
            let balance_j = energy.supplied_j - energy.dissipated_j - (energy.stored_j - start_j);
            prop_assert!(balance_j.abs() < 1e-4 * passed_j, "{balance_j} J of {passed_j} J at {t} s");
            previous = energy;
        }
    }
}

#[test]
fn the_same_calls_give_the_same_bits() {
    let run = || {
        let mut parameters = JointParameters::of_inertia(0.1);
        parameters.motor = JointMotorParameters::ThreePhase(ThreePhaseParameters::default());
        parameters.friction.coulomb = 0.1;
        let mut joint = parameters.build().unwrap();
        hold(&mut joint, 50, 0.4, |_, _| {});
        hold(&mut joint, 50, -0.4, |_, _| {});
        joint.state().position.to_bits()
    };
    assert_eq!(run(), run());
}
