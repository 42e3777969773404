//! Equations of motion of the PHANToM Premium 1.5.
//!
//! M. C. Cavusoglu, D. Feygin, F. Tendick, "A critical study of the mechanical and electrical properties of the
//! PHANToM haptic interface and improvements for high-performance control", Presence 11(6), 2002. Axis 0 rotates the
//! whole device about the vertical; axis 1 is the angle of the inner link above the horizontal; axis 2 is the angle
//! of the outer link from the vertical. A parallel bar drives the outer link, so axis 2 is relative to the base, not
//! to the inner link.
//!
//! Four bodies pivot: the outer link `a`, the parallel bar `c`, the inner link with motor and counterweight `be`, the
//! bar at the shoulder with the other motor `df`; `base` rotates about the vertical only. With `A = l1 (l2 ma + l3
//! mc)`, the Coriolis matrix of the bias below has the entries `C23 = ½ A cos(q2 - q3) q3'` and `C32 = -½ A cos(q2 -
//! q3) q2'`. A public implementation has `C32` with a plus sign, which would make `dM/dt - 2 C` not skew-symmetric
//! and generate energy.
#![expect(clippy::indexing_slicing, reason = "matrices of a fixed size")]

use crate::plant::coupled::{AxisValues, Dynamics, Matrix, Mechanism, transposed};
use crate::plant::parameter::{ParameterError, finite, not_negative, positive};
use dimsart_core::limits::MAX_DOF;
use serde::{Deserialize, Serialize};

/// Lengths, masses and moments of inertia. Those of `be` and `df` are about their pivots, the others about the mass
/// centres; with all axes at 0, `x` is normal to the plane of the links, `y` up, `z` forward.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct LinkageParameters {
    /// `l1`, of the inner link, `m`.
    pub inner_m: f64,
    /// `l2`, of the outer link, from the elbow to the tip, `m`.
    pub outer_m: f64,
    /// `l3`, between inner link and parallel bar, `m`.
    pub parallel_m: f64,
    /// `l5`, from the shoulder along the inner link to the mass centre of `be`, `m`; negative: a counterweight.
    pub inner_centre_m: f64,
    /// `l6`, from the shoulder to the mass centre of `df`, against the outer link's direction, `m`.
    pub shoulder_centre_m: f64,
    /// `ma`, `kg`.
    pub outer_kg: f64,
    /// `mc`, `kg`.
    pub parallel_kg: f64,
    /// `mbe`, `kg`.
    pub inner_kg: f64,
    /// `mdf`, `kg`.
    pub shoulder_kg: f64,
    /// `Ia`, `[xx, yy, zz]`, `kg m²`.
    pub outer_kg_m2: [f64; 3],
    /// `Ic`, `[xx, yy, zz]`, `kg m²`.
    pub parallel_kg_m2: [f64; 3],
    /// `Ibe`, `[xx, yy, zz]`, `kg m²`.
    pub inner_kg_m2: [f64; 3],
    /// `Idf`, `[xx, yy, zz]`, `kg m²`.
    pub shoulder_kg_m2: [f64; 3],
    /// `Ibase`, about the vertical, `kg m²`.
    pub base_kg_m2: f64,
    /// Down, `m/s²`.
    pub gravity_m_per_s2: f64,
    /// Mass attached to the tip, such as a hand that carries its own weight: without gravity, `kg`.
    pub tip_kg: f64,
}

impl Default for LinkageParameters {
    /// As measured by Cavusoglu, Feygin and Tendick.
    fn default() -> Self {
        Self {
            inner_m: 0.215,
            outer_m: 0.170,
            parallel_m: 0.0325,
            inner_centre_m: -0.0368,
            shoulder_centre_m: 0.0527,
            outer_kg: 0.0202,
            parallel_kg: 0.0249,
            inner_kg: 0.2359,
            shoulder_kg: 0.1906,
            outer_kg_m2: [0.4864e-4, 0.001843e-4, 0.4864e-4],
            parallel_kg_m2: [0.959e-4, 0.959e-4, 0.0051e-4],
            inner_kg_m2: [11.09e-4, 10.06e-4, 0.591e-4],
            shoulder_kg_m2: [7.11e-4, 0.629e-4, 6.246e-4],
            base_kg_m2: 11.87e-4,
            gravity_m_per_s2: 9.81,
            tip_kg: 0.0,
        }
    }
}

impl LinkageParameters {
    pub(super) fn check(&self) -> Result<(), ParameterError> {
        positive("inner_m", self.inner_m)?;
        positive("outer_m", self.outer_m)?;
        finite("parallel_m", self.parallel_m)?;
        finite("inner_centre_m", self.inner_centre_m)?;
        finite("shoulder_centre_m", self.shoulder_centre_m)?;
        not_negative("outer_kg", self.outer_kg)?;
        not_negative("parallel_kg", self.parallel_kg)?;
        not_negative("inner_kg", self.inner_kg)?;
        not_negative("shoulder_kg", self.shoulder_kg)?;
        let moments = [
            ("outer_kg_m2", &self.outer_kg_m2),
            ("parallel_kg_m2", &self.parallel_kg_m2),
            ("inner_kg_m2", &self.inner_kg_m2),
            ("shoulder_kg_m2", &self.shoulder_kg_m2),
        ];
        for (path, moments) in moments {
            for (index, moment) in moments.iter().enumerate() {
                not_negative(&format!("{path}[{index}]"), *moment)?;
            }
        }
        // Each axis then has an inertia of its own in every position.
        positive("base_kg_m2", self.base_kg_m2)?;
        for (path, [xx, ..]) in
            [("inner_kg_m2[0]", self.inner_kg_m2), ("shoulder_kg_m2[0]", self.shoulder_kg_m2)]
        {
            positive(path, xx)?;
        }
        not_negative("tip_kg", self.tip_kg)?;
        finite("gravity_m_per_s2", self.gravity_m_per_s2)
    }
}

/// The linkage: parameters of the equations of motion.
#[derive(Debug, Clone)]
pub struct Linkage {
    inner_m: f64,
    outer_m: f64,
    /// Coefficients of `M11`, `kg m²`: constant, of `cos 2 q2`, of `cos 2 q3`.
    turning: [f64; 3],
    /// `M22` and `M33`, `kg m²`.
    inner: f64,
    outer: f64,
    /// `A`, `kg m²`.
    coupling: f64,
    /// Coefficients of `cos q2` in `N2` and of `sin q3` in `N3`, `N m`.
    weights_nm: [f64; 2],
    tip_kg: f64,
}

/// Sines and cosines of all three axes.
struct Angles {
    base: (f64, f64),
    inner: (f64, f64),
    outer: (f64, f64),
}

impl Linkage {
    pub(super) fn of(parameters: &LinkageParameters) -> Self {
        let p = parameters;
        let (l1, l2, l3) = (p.inner_m, p.outer_m, p.parallel_m);
        let (ma, mc) = (p.outer_kg, p.parallel_kg);
        let ([axx, ayy, azz], [cxx, cyy, czz]) = (p.outer_kg_m2, p.parallel_kg_m2);
        let ([bexx, beyy, bezz], [dfxx, dfyy, dfzz]) = (p.inner_kg_m2, p.shoulder_kg_m2);
        // Mass centres of `a` and `c`, relative to elbow and shoulder.
        let inner = l1 * l1 * (ma + 0.25 * mc);
        let outer = 0.25 * l2 * l2 * ma + l3 * l3 * mc;
        let around = ayy + azz + beyy + bezz + cyy + czz + dfyy + dfzz;
        Self {
            inner_m: l1,
            outer_m: l2,
            tip_kg: p.tip_kg,
            turning: [
                p.base_kg_m2 + 0.5 * (around + inner + outer),
                0.5 * (beyy - bezz + cyy - czz + inner),
                0.5 * (ayy - azz + dfyy - dfzz - outer),
            ],
            inner: bexx + cxx + inner,
            outer: axx + dfxx + outer,
            coupling: l1 * (l2 * ma + l3 * mc),
            weights_nm: [
                p.gravity_m_per_s2 * (l1 * ma + p.inner_centre_m * p.inner_kg + 0.5 * l1 * mc),
                p.gravity_m_per_s2 * (0.5 * l2 * ma + l3 * mc - p.shoulder_centre_m * p.shoulder_kg),
            ],
        }
    }

    /// Contribution of a mass at the tip: `m Jᵀ J`, and `m Jᵀ a` with the acceleration `a` of the tip at constant
    /// axis speeds.
    fn add_tip(
        &self,
        position: &AxisValues,
        velocity: &AxisValues,
        mass: &mut Matrix,
        bias: &mut AxisValues,
    ) {
        if self.tip_kg <= 0.0 {
            return;
        }
        let jacobian = self.tip_jacobian(position);
        for (one, of_one) in
            (0..3).map(|axis| (axis, jacobian.map(|row| row.get(axis).copied().unwrap_or(0.0))))
        {
            for (other, of_other) in
                (0..3).map(|axis| (axis, jacobian.map(|row| row.get(axis).copied().unwrap_or(0.0))))
            {
                let product: f64 = of_one.iter().zip(of_other).map(|(one, other)| one * other).sum();
                mass[(one, other)] += self.tip_kg * product;
            }
        }
        let angles = Angles::of(position);
        let ((sin, cos), (inner_sin, inner_cos)) = (angles.base, angles.inner);
        let (outer_sin, outer_cos) = angles.outer;
        let [turning, inner, outer, ..] = *velocity;
        let reach_rate = -self.inner_m * inner_sin * inner + self.outer_m * outer_cos * outer;
        // At constant axis speeds.
        let outward = -self.inner_m * inner_cos * inner * inner
            - self.outer_m * outer_sin * outer * outer
            - self.reach_m(&angles) * turning * turning;
        let sideward = 2.0 * reach_rate * turning;
        let upward = -self.inner_m * inner_sin * inner * inner + self.outer_m * outer_cos * outer * outer;
        let acceleration = [outward * cos - sideward * sin, outward * sin + sideward * cos, upward];
        let added = transposed(&jacobian, &acceleration.map(|along| self.tip_kg * along));
        for (bias, added) in bias.iter_mut().zip(added) {
            *bias += added;
        }
    }

    /// Distance of the tip from the vertical axis, `m`.
    fn reach_m(&self, angles: &Angles) -> f64 {
        self.inner_m * angles.inner.1 + self.outer_m * angles.outer.0
    }
}

impl Angles {
    fn of(position: &AxisValues) -> Self {
        let [base, inner, outer, ..] = *position;
        Self { base: libm::sincos(base), inner: libm::sincos(inner), outer: libm::sincos(outer) }
    }
}

impl Mechanism for Linkage {
    fn axes(&self) -> usize {
        3
    }

    fn dynamics(&self, position: &AxisValues, velocity: &AxisValues) -> Dynamics {
        let Angles { inner: (sin_inner, cos_inner), outer: (sin_outer, cos_outer), .. } =
            Angles::of(position);
        let [turning_rad_per_s, inner_rad_per_s, outer_rad_per_s, ..] = *velocity;
        let [constant, with_inner, with_outer] = self.turning;
        let coupling = self.coupling;
        // Cosine and sine of the difference of the two angles.
        let sin_between = sin_inner * cos_outer - cos_inner * sin_outer;
        let cos_between = cos_inner * cos_outer + sin_inner * sin_outer;

        let mut mass = Matrix::default();
        let turning = constant
            + with_inner * (cos_inner * cos_inner - sin_inner * sin_inner)
            + with_outer * (cos_outer * cos_outer - sin_outer * sin_outer)
            + coupling * cos_inner * sin_outer;
        mass[(0, 0)] += turning;
        mass[(1, 1)] += self.inner;
        mass[(2, 2)] += self.outer;
        mass[(1, 2)] += -0.5 * coupling * sin_between;
        mass[(2, 1)] += -0.5 * coupling * sin_between;

        // Half of the derivative of M11 by each angle gives C11, C12 and C13.
        let by_inner = -4.0 * with_inner * sin_inner * cos_inner - coupling * sin_inner * sin_outer;
        let by_outer = -4.0 * with_outer * sin_outer * cos_outer + coupling * cos_inner * cos_outer;
        let [inner_nm, outer_nm] = self.weights_nm;
        let mut bias = [0.0; MAX_DOF];
        let of_axes = [
            turning_rad_per_s * (by_inner * inner_rad_per_s + by_outer * outer_rad_per_s),
            -0.5 * by_inner * turning_rad_per_s * turning_rad_per_s
                + 0.5 * coupling * cos_between * outer_rad_per_s * outer_rad_per_s
                + inner_nm * cos_inner,
            -0.5 * by_outer * turning_rad_per_s * turning_rad_per_s
                - 0.5 * coupling * cos_between * inner_rad_per_s * inner_rad_per_s
                + outer_nm * sin_outer,
        ];
        for (bias, torque_nm) in bias.iter_mut().zip(of_axes) {
            *bias = torque_nm;
        }
        self.add_tip(position, velocity, &mut mass, &mut bias);
        Dynamics { mass, bias }
    }

    fn potential_j(&self, position: &AxisValues) -> f64 {
        let angles = Angles::of(position);
        let [inner_nm, outer_nm] = self.weights_nm;
        inner_nm * angles.inner.0 - outer_nm * angles.outer.1
    }

    /// `x` forward, `y` left, `z` up, from the intersection of the axes.
    fn tip_m(&self, position: &AxisValues) -> [f64; 3] {
        let angles = Angles::of(position);
        let reach_m = self.reach_m(&angles);
        let height_m = self.inner_m * angles.inner.0 - self.outer_m * angles.outer.1;
        [reach_m * angles.base.1, reach_m * angles.base.0, height_m]
    }

    fn tip_jacobian(&self, position: &AxisValues) -> [AxisValues; 3] {
        let angles = Angles::of(position);
        let reach_m = self.reach_m(&angles);
        let (sin, cos) = angles.base;
        let inner = (-self.inner_m * angles.inner.0, self.inner_m * angles.inner.1);
        let outer = (self.outer_m * angles.outer.1, self.outer_m * angles.outer.0);
        let row = |one, two, three| {
            let mut row = [0.0; MAX_DOF];
            for (entry, value) in row.iter_mut().zip([one, two, three]) {
                *entry = value;
            }
            row
        };
        [
            row(-reach_m * sin, cos * inner.0, cos * outer.0),
            row(reach_m * cos, sin * inner.0, sin * outer.0),
            row(0.0, inner.1, outer.1),
        ]
    }
}
