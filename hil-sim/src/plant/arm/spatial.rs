//! Motion, force and inertia of rigid bodies, all relative to the origin of the base, so that those of several bodies
//! add (R. Featherstone, "Rigid Body Dynamics Algorithms", Springer 2008, chapter 2).

use super::vector::{Vector, cross, dot, plus, scaled};

/// Twist of a body: angular velocity, and velocity of its point at the origin. Also the rate of change of a twist.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Twist {
    pub(super) angular: Vector,
    pub(super) linear: Vector,
}

/// Wrench on a body: moment about the origin, and force. Also a momentum.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Wrench {
    pub(super) moment: Vector,
    pub(super) force: Vector,
}

/// Mass, and its first and second moments about the origin.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Inertia {
    pub(super) mass_kg: f64,
    /// Mass times centre of mass.
    pub(super) first_kg_m: Vector,
    /// Moment of inertia by rows.
    pub(super) second_kg_m2: [Vector; 3],
}

impl Twist {
    pub(super) fn plus(self, other: Self) -> Self {
        Self { angular: plus(self.angular, other.angular), linear: plus(self.linear, other.linear) }
    }

    pub(super) fn scaled(self, factor: f64) -> Self {
        Self { angular: scaled(self.angular, factor), linear: scaled(self.linear, factor) }
    }

    /// Rate of change of a body-fixed twist while the body moves with `self`.
    pub(super) fn carries(self, fixed: Self) -> Self {
        Self {
            angular: cross(self.angular, fixed.angular),
            linear: plus(cross(self.angular, fixed.linear), cross(self.linear, fixed.angular)),
        }
    }

    /// Rate of change of a body-fixed momentum while the body moves with `self`.
    pub(super) fn carries_momentum(self, fixed: Wrench) -> Wrench {
        Wrench {
            moment: plus(cross(self.angular, fixed.moment), cross(self.linear, fixed.force)),
            force: cross(self.angular, fixed.force),
        }
    }

    /// Returns the power of `wrench`.
    pub(super) fn power(self, wrench: &Wrench) -> f64 {
        dot(self.angular, wrench.moment) + dot(self.linear, wrench.force)
    }

    /// Returns the velocity of the point at `place`.
    pub(super) fn velocity_at(self, place: Vector) -> Vector {
        plus(self.linear, cross(self.angular, place))
    }
}

impl Wrench {
    pub(super) fn plus(self, other: Self) -> Self {
        Self { moment: plus(self.moment, other.moment), force: plus(self.force, other.force) }
    }
}

impl Inertia {
    /// Creates the inertia of a body with this moment of inertia about its `centre`, relative to the origin.
    pub(super) fn of(mass_kg: f64, centre: Vector, about_centre: [Vector; 3]) -> Self {
        let square = dot(centre, centre);
        let [x, y, z] = centre;
        let shift = |row: Vector, unit: Vector, along: f64| {
            let away = plus(scaled(unit, square), scaled(centre, -along));
            plus(row, scaled(away, mass_kg))
        };
        let [first, second, third] = about_centre;
        Self {
            mass_kg,
            first_kg_m: scaled(centre, mass_kg),
            second_kg_m2: [
                shift(first, [1.0, 0.0, 0.0], x),
                shift(second, [0.0, 1.0, 0.0], y),
                shift(third, [0.0, 0.0, 1.0], z),
            ],
        }
    }

    pub(super) fn plus(self, other: Self) -> Self {
        let ([a, b, c], [d, e, f]) = (self.second_kg_m2, other.second_kg_m2);
        Self {
            mass_kg: self.mass_kg + other.mass_kg,
            first_kg_m: plus(self.first_kg_m, other.first_kg_m),
            second_kg_m2: [plus(a, d), plus(b, e), plus(c, f)],
        }
    }

    /// Returns the momentum of a body with `twist`; for an acceleration, the required wrench from rest.
    pub(super) fn times(&self, Twist { angular, linear }: Twist) -> Wrench {
        let [x, y, z] = self.second_kg_m2;
        let turning = [dot(x, angular), dot(y, angular), dot(z, angular)];
        Wrench {
            moment: plus(turning, cross(self.first_kg_m, linear)),
            force: plus(scaled(linear, self.mass_kg), cross(angular, self.first_kg_m)),
        }
    }
}
