//! The flexible joint's two frequencies.

use super::*;

const STIFFNESS: f64 = 1e4;
const LOAD: f64 = 2.0;
const RATIO: f64 = 100.0;
const ROTOR_KG_M2: f64 = 5e-5;

fn flexible() -> JointParameters {
    JointParameters {
        gear: GearParameters { ratio: RATIO, inertia_kg_m2: ROTOR_KG_M2, ..GearParameters::default() },
        flexible: Some(FlexibleParameters { stiffness: STIFFNESS, damping: 0.0 }),
        ..JointParameters::of_inertia(LOAD)
    }
}

/// `q = F/K (1 - cos(sqrt(K/M) t))` under a step of the outside force, the rotor held by its own friction.
#[test]
fn with_the_rotor_locked_it_swings_at_its_antiresonance() {
    let motor = BrushedParameters { coulomb_nm: 1e3, ..BrushedParameters::default() };
    let mut joint =
        JointParameters { motor: JointMotorParameters::Brushed(motor), ..flexible() }.build().unwrap();
    let natural = (STIFFNESS / LOAD).sqrt();
    let (mut position, mut force) = (Worst::default(), Worst::default());
    for tick in 0..2000_u32 {
        let t = f64::from(tick) * PERIOD_S;
        joint.advance(t, PERIOD_S, 0.0, &|_| 10.0);
        let state = joint.state();
        let swing = 1.0 - libm::cos(natural * (t + PERIOD_S));
        position.see(state.position * STIFFNESS / 10.0, swing);
        force.see(state.force / 10.0, -swing);
        close(state.motor_velocity, 0.0, 0.0);
    }
    position.below("locked rotor, share of F/K", 1e-6);
    force.below("its spring, share of F", 1e-6);
}

/// `τ = c M/(M + B) (1 - cos(w t))`, `w² = K (1/M + 1/B)`, `B = N² J`, under a step of the motor's torque.
#[test]
fn free_it_swings_at_its_resonance() {
    let mut joint = flexible().build().unwrap();
    let reflected = RATIO * RATIO * ROTOR_KG_M2;
    let natural = (STIFFNESS * (1.0 / LOAD + 1.0 / reflected)).sqrt();
    let mut force = Worst::default();
    hold(&mut joint, 2000, 5.0, |t, state| {
        let share = LOAD / (LOAD + reflected);
        force.see(state.force / 5.0, share * (1.0 - libm::cos(natural * t)));
    });
    force.below("free resonance, share of the torque", 1e-5);
}
