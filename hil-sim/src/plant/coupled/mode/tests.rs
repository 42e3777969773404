//! What sticks and what slides is what Coulomb's law says of all axes at once.

use super::*;
use proptest::prelude::*;

const AXES: usize = 5;

fn actuators(coulomb: [f64; AXES]) -> Vec<Actuator> {
    let of = |coulomb| Actuator {
        viscous_path: String::new(),
        inertia: 0.0,
        viscous: 0.0,
        coulomb,
        effort_limit: f64::INFINITY,
        start_position: 0.0,
    };
    coulomb.map(of).to_vec()
}

/// `G Gᵀ` and a little on the diagonal: any positive definite matrix, also with strong coupling.
fn mass(roots: &[[f64; AXES]; AXES]) -> Matrix {
    let mut mass = Matrix::default();
    for (row, one) in roots.iter().enumerate() {
        for (column, other) in roots.iter().enumerate() {
            mass[(row, column)] = one.iter().zip(other).map(|(one, other)| one * other).sum();
        }
        mass[(row, row)] += 1e-3;
    }
    mass
}

proptest! {
    #[test]
    fn every_axis_obeys_coulomb(
        roots in prop::array::uniform5(prop::array::uniform5(-1.0..1.0)),
        net in prop::array::uniform5(-3.0..3.0),
        coulomb in prop::array::uniform5(prop_oneof![Just(0.0), 0.1..2.0]),
        velocity in prop::array::uniform5(prop_oneof![3 => Just(0.0), 1 => -1.0..1.0]),
    ) {
        let full = |values: [f64; AXES]| -> AxisValues {
            core::array::from_fn(|axis| values.get(axis).copied().unwrap_or_default())
        };
        let (actuators, mass, net, velocity) = (actuators(coulomb), mass(&roots), full(net), full(velocity));
        let slides = slides(&actuators, &velocity);
        let mut mode = Mode { slides, contacts: [Contact::Free; MAX_STOPS] };
        settle(&mut mode, &actuators, &velocity, &mass, &net);
        let forces = with_friction(&net, &actuators, &mode.slides);
        let acceleration = Factors::of(&mass, mode.is_held(AXES)).solve(&forces);
        let inertial = times(&mass, &acceleration);
        for axis in 0..AXES {
            let pull = forces[axis] - inertial[axis];
            let scale = 1e-9 * (1.0 + acceleration.iter().fold(0.0_f64, |most, one| most.max(one.abs())));
            match mode.slides[axis] {
                Slide::Stuck => {
                    prop_assert!(velocity[axis].abs() <= 0.0 && acceleration[axis].abs() <= 0.0);
                    prop_assert!(pull.abs() <= coulomb[axis] + scale);
                }
                Slide::Forward => prop_assert!(velocity[axis] > 0.0 || acceleration[axis] >= -scale),
                Slide::Backward => prop_assert!(velocity[axis] < 0.0 || acceleration[axis] <= scale),
                Slide::Frictionless => prop_assert!(coulomb[axis] <= 0.0),
            }
        }
    }
}
