//! Motion, force and inertia of rigid bodies, all seen at the origin of the base, so that those of several bodies
//! simply add (R. Featherstone, "Rigid Body Dynamics Algorithms", Springer 2008, chapter 2).

use super::vector::{Vector, cross, dot, plus, scaled};

/// How a body moves: it turns, and this moves the point of it that is at the origin. Also how that changes.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Twist {
    pub(super) angular: Vector,
    pub(super) linear: Vector,
}

/// What acts on a body: a moment about the origin, and a force. Also a momentum.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Wrench {
    pub(super) moment: Vector,
    pub(super) force: Vector,
}

/// Mass, and its first and second moments about the origin.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Inertia {
    pub(super) mass_kg: f64,
    /// Mass times centre.
    pub(super) first_kg_m: Vector,
    /// Rows of the moment of inertia.
    pub(super) second_kg_m2: [Vector; 3],
}

impl Twist {
    pub(super) fn plus(self, other: Self) -> Self {
        Self { angular: plus(self.angular, other.angular), linear: plus(self.linear, other.linear) }
    }

    pub(super) fn scaled(self, factor: f64) -> Self {
        Self { angular: scaled(self.angular, factor), linear: scaled(self.linear, factor) }
    }

    /// How a twist that is fixed to a body changes while the body moves like `self`.
    pub(super) fn carries(self, fixed: Self) -> Self {
        Self {
            angular: cross(self.angular, fixed.angular),
            linear: plus(cross(self.angular, fixed.linear), cross(self.linear, fixed.angular)),
        }
    }

    /// How a momentum that is fixed to a body changes while the body moves like `self`.
    pub(super) fn carries_momentum(self, fixed: Wrench) -> Wrench {
        Wrench {
            moment: plus(cross(self.angular, fixed.moment), cross(self.linear, fixed.force)),
            force: cross(self.angular, fixed.force),
        }
    }

    /// The power of `wrench`.
    pub(super) fn power(self, wrench: &Wrench) -> f64 {
        dot(self.angular, wrench.moment) + dot(self.linear, wrench.force)
    }

    /// The velocity of the point that is at `place`.
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
    /// Of a body with this moment of inertia about its `centre`, which is seen from the origin.
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

    /// The momentum of a body that moves like `twist`; for an acceleration, the force that it takes from rest.
    pub(super) fn times(&self, Twist { angular, linear }: Twist) -> Wrench {
        let [x, y, z] = self.second_kg_m2;
        let turning = [dot(x, angular), dot(y, angular), dot(z, angular)];
        Wrench {
            moment: plus(turning, cross(self.first_kg_m, linear)),
            force: plus(scaled(linear, self.mass_kg), cross(angular, self.first_kg_m)),
        }
    }
}
