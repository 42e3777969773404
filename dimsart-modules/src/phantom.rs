//! PHANToM Premium 1.5: `PHANTOM_TIP_MOD`, and dynamics for gravity compensation, computed torque and collision
//! detection.
//!
//! Axis 0 rotates the device about the vertical, axis 1 is the angle of the inner link above the horizontal, axis 2 the
//! angle of the outer link from the vertical. Both link angles are relative to the base, because a parallel bar drives
//! the outer link. x is forward, y left, z up, from the intersection of the axes:
//!
//! ```text
//! r = l1 cos q2 + l2 sin q3        tip = (r cos q1, r sin q1, l1 sin q2 - l2 cos q3)
//! M11 = T0 + T1 cos 2 q2 + T2 cos 2 q3 + A cos q2 sin q3        M23 = M32 = -A/2 sin(q2 - q3)
//! M22 = T3        M33 = T4        g2 = W1 cos q2        g3 = W2 sin q3
//! ```
//!
//! M. C. Cavusoglu, D. Feygin, F. Tendick, "A critical study of the mechanical and electrical properties of the PHANToM
//! haptic interface", Presence 11(6), 2002. The defaults are its lengths and masses, lumped. The motors are not
//! included: see `MOTOR_INERTIA`.

use crate::dynamics::{ArmDynamics, Axes};
use crate::tip::{ForwardKinematics, Joint, TipPose, Vector3};
use dimsart_core::limits::MAX_DOF;
use dimsart_core::{Unit, math, words};

words! {
    /// Lengths of the links.
    pub parameters Lengths {
        /// Length of the inner link.
        pub(super) inner: f32 = real("INNER_LENGTH", Unit::Metre, 1e-3..=100.0, 0.215),
        /// Length of the outer link, to the tip.
        pub(super) outer: f32 = real("OUTER_LENGTH", Unit::Metre, 1e-3..=100.0, 0.170),
    }
    /// Lumped parameters of the equations of motion.
    pub parameters Masses {
        /// Inertia about the vertical: constant part.
        turning: f32 = real("T0", Unit::Inertia, -10.0..=10.0, 2.832_787_8e-3),
        /// Inertia about the vertical: part with cos 2 q2.
        turning_with_inner: f32 = real("T1", Unit::Inertia, -10.0..=10.0, 1.131_892_8e-3),
        /// Inertia about the vertical: part with cos 2 q3.
        turning_with_outer: f32 = real("T2", Unit::Inertia, -10.0..=10.0, -3.912_006_6e-4),
        /// Inertia of axis 1, the inner link.
        inner: f32 = real("T3", Unit::Inertia, -10.0..=10.0, 2.426_395_6e-3),
        /// Inertia of axis 2, the outer link.
        outer: f32 = real("T4", Unit::Inertia, -10.0..=10.0, 9.318_856e-4),
        /// Coupling inertia of the two links.
        coupling: f32 = real("A", Unit::Inertia, -10.0..=10.0, 9.122_987_5e-4),
        /// Gravity torque of the inner link when horizontal.
        inner_weight: f32 = real("W1", Unit::Force, -100.0..=100.0, -1.629_804e-2),
        /// Gravity torque of the outer link when horizontal.
        outer_weight: f32 = real("W2", Unit::Force, -100.0..=100.0, -7.375_521e-2),
    }
}

/// Kinematics of a PHANToM.
#[derive(Debug, Clone, Copy)]
pub struct PhantomChain;

impl ForwardKinematics for PhantomChain {
    const TIP: &'static str = "PHANTOM_TIP_MOD";
    type Settings = Lengths;
    type Joint = ();

    fn place(Lengths { inner, outer }: Lengths, joints: &[Joint<()>]) -> TipPose {
        let angle = |axis| math::sin_cos(joints.get(axis).map_or(0.0, |joint: &Joint<()>| joint.position));
        let [(sine, cosine), (inner_sine, inner_cosine), (outer_sine, outer_cosine)] = [0, 1, 2].map(angle);
        let (inner_x, inner_z) = (inner * inner_cosine, inner * inner_sine);
        let (outer_x, outer_z) = (outer * outer_sine, -outer * outer_cosine);
        let reach = inner_x + outer_x;
        let in_plane = |along, up| Vector3 { x: along * cosine, y: along * sine, z: up };
        let tip = in_plane(reach, inner_z + outer_z);
        let mut placement = TipPose { tip, ..TipPose::default() };
        let columns = [
            Vector3 { x: -tip.y, y: tip.x, z: 0.0 },
            in_plane(-inner_z, inner_x),
            in_plane(-outer_z, outer_x),
        ];
        placement.columns.iter_mut().zip(columns).for_each(|(column, found)| *column = found);
        placement
    }
}

/// Dynamics of a PHANToM in its present pose.
#[derive(Debug, Clone, Copy)]
pub struct Phantom {
    masses: Masses,
    sin_inner: f32,
    cos_inner: f32,
    sin_outer: f32,
    cos_outer: f32,
}

impl ArmDynamics for Phantom {
    const GRAVITY: &'static str = "PHANTOM_GRAVITY_MOD";
    const COMPUTED_TORQUE: &'static str = "PHANTOM_TORQUE_MOD";
    const COLLISION: &'static str = "PHANTOM_COLLISION_MOD";
    type Settings = Masses;
    type Link = ();

    fn at(masses: Masses, _: &[(); MAX_DOF], position: &Axes) -> Self {
        let [_, inner, outer, ..] = *position;
        let ((sin_inner, cos_inner), (sin_outer, cos_outer)) = (math::sin_cos(inner), math::sin_cos(outer));
        Self { masses, sin_inner, cos_inner, sin_outer, cos_outer }
    }

    fn torques(&self, velocity: &Axes, acceleration: &Axes) -> Axes {
        let [turning, inner, outer, ..] = *velocity;
        let (by_inner, by_outer) = self.turning_slopes();
        let half_coupling = 0.5 * self.masses.coupling * self.cos_between();
        let [about, up, out, ..] = self.times_mass(acceleration);
        let [_, inner_weight, outer_weight, ..] = self.gravity();
        let turned = 0.5 * turning * turning;
        three([
            about + turning * (by_inner * inner + by_outer * outer),
            up - by_inner * turned + half_coupling * outer * outer + inner_weight,
            out - by_outer * turned - half_coupling * inner * inner + outer_weight,
        ])
    }

    fn momentum(&self, velocity: &Axes) -> (Axes, Axes) {
        let [turning, inner, outer, ..] = *velocity;
        let (by_inner, by_outer) = self.turning_slopes();
        let turned = 0.5 * turning * turning;
        let coupled = 0.5 * self.masses.coupling * self.cos_between() * inner * outer;
        let slopes = three([0.0, by_inner * turned - coupled, by_outer * turned + coupled]);
        (self.times_mass(velocity), slopes)
    }

    fn gravity(&self) -> Axes {
        let Masses { inner_weight, outer_weight, .. } = self.masses;
        three([0.0, inner_weight * self.cos_inner, outer_weight * self.sin_outer])
    }
}

impl Phantom {
    /// Returns the cosine of the difference of the link angles.
    fn cos_between(&self) -> f32 {
        self.cos_inner * self.cos_outer + self.sin_inner * self.sin_outer
    }

    fn times_mass(&self, [about, up, out, ..]: &Axes) -> Axes {
        let Self { sin_inner, cos_inner, sin_outer, cos_outer, masses } = self;
        let turning = masses.turning
            + masses.turning_with_inner * (cos_inner * cos_inner - sin_inner * sin_inner)
            + masses.turning_with_outer * (cos_outer * cos_outer - sin_outer * sin_outer)
            + masses.coupling * cos_inner * sin_outer;
        let between = -0.5 * masses.coupling * (sin_inner * cos_outer - cos_inner * sin_outer);
        three([turning * about, masses.inner * up + between * out, masses.outer * out + between * up])
    }

    /// Returns the derivatives of `M11` with respect to the link angles.
    fn turning_slopes(&self) -> (f32, f32) {
        let Self { sin_inner, cos_inner, sin_outer, cos_outer, masses } = self;
        let by_inner = -4.0 * masses.turning_with_inner * sin_inner * cos_inner
            - masses.coupling * sin_inner * sin_outer;
        let by_outer = -4.0 * masses.turning_with_outer * sin_outer * cos_outer
            + masses.coupling * cos_inner * cos_outer;
        (by_inner, by_outer)
    }
}

fn three([first, second, third]: [f32; 3]) -> Axes {
    [first, second, third, 0.0, 0.0, 0.0, 0.0, 0.0]
}
