//! `DH_TIP_MOD`: forward kinematics of a serial chain by modified Denavit-Hartenberg parameters.
//!
//! From the previous joint's frame: rotate by `DH_ALPHA` about x, translate by `DH_A` along x, rotate by `DH_THETA`
//! about the new z, translate by `DH_D` along z (J. J. Craig, *Introduction to Robotics*, section 3.4). A rotary joint
//! adds its position to theta, a linear one to d. The tip is at `TIP_X`, `TIP_Y`, `TIP_Z` in the last frame. Ports and
//! limits are those of every [tip](crate::tip).

use core::ops::RangeInclusive;

use crate::tip::{ForwardKinematics, Joint, TipPose, Vector3};
use dimsart_core::{AxisKind, Unit, math, words};

const LENGTH: RangeInclusive<f32> = -100.0..=100.0;
const ANGLE: RangeInclusive<f32> = -7.0..=7.0;

words! {
    /// Parameters of one joint.
    pub parameters Row {
        /// DH parameter a: offset along the previous x axis.
        a: f32 = per_axis("DH_A", Unit::Metre, LENGTH, 0.0),
        /// DH parameter alpha: twist about the previous x axis.
        alpha: f32 = per_axis("DH_ALPHA", Unit::Radian, ANGLE, 0.0),
        /// DH parameter d: offset along the joint axis.
        d: f32 = per_axis("DH_D", Unit::Metre, LENGTH, 0.0),
        /// DH parameter theta: angle about the joint axis.
        theta: f32 = per_axis("DH_THETA", Unit::Radian, ANGLE, 0.0),
        sin_alpha: f32,
        cos_alpha: f32,
    }
    /// Position of the tip in the last frame.
    pub parameters TipOffset {
        /// Tip position along x in the last frame.
        x: f32 = real("TIP_X", Unit::Metre, LENGTH, 0.0),
        /// Tip position along y in the last frame.
        y: f32 = real("TIP_Y", Unit::Metre, LENGTH, 0.0),
        /// Tip position along z in the last frame.
        z: f32 = real("TIP_Z", Unit::Metre, LENGTH, 0.0),
    }
}

/// See the [module docs](self).
#[derive(Debug, Clone, Copy)]
pub struct DenavitHartenberg;

/// Origin and axes of a frame.
#[derive(Debug, Clone, Copy)]
struct Frame {
    origin: Vector3,
    x: Vector3,
    y: Vector3,
    z: Vector3,
}

impl ForwardKinematics for DenavitHartenberg {
    const TIP: &'static str = "DH_TIP_MOD";
    type Settings = TipOffset;
    type Joint = Row;

    fn prepare(row: &mut Row) {
        (row.sin_alpha, row.cos_alpha) = math::sin_cos(row.alpha);
    }

    fn place(TipOffset { x, y, z }: TipOffset, joints: &[Joint<Row>]) -> TipPose {
        let tip = Vector3 { x, y, z };
        let axis = |x, y, z| Vector3 { x, y, z };
        let (x, y, z) = (axis(1.0, 0.0, 0.0), axis(0.0, 1.0, 0.0), axis(0.0, 0.0, 1.0));
        let mut frame = Frame { origin: Vector3::default(), x, y, z };
        let mut placement = TipPose::default();
        // Until the tip is known, a column holds the origin of its joint.
        let mut axes = [Vector3::default(); dimsart_core::limits::MAX_DOF];
        for ((joint, column), axis) in joints.iter().zip(&mut placement.columns).zip(&mut axes) {
            frame = frame.behind(joint);
            (*column, *axis) = (frame.origin, frame.z);
        }
        placement.tip = frame.of(tip);
        for ((joint, column), axis) in joints.iter().zip(&mut placement.columns).zip(axes) {
            *column = match joint.kind {
                AxisKind::Rotary => cross(axis, sum(placement.tip, -1.0, *column)),
                AxisKind::Linear => axis,
            };
        }
        placement
    }
}

impl Frame {
    fn behind(&self, joint: &Joint<Row>) -> Self {
        let Row { a, d, theta, sin_alpha, cos_alpha, .. } = joint.parameters;
        let (d, theta) = match joint.kind {
            AxisKind::Rotary => (d, theta + joint.position),
            AxisKind::Linear => (d + joint.position, theta),
        };
        let (sine, cosine) = math::sin_cos(theta);
        let y = sum(scaled(self.y, cos_alpha), sin_alpha, self.z);
        let z = sum(scaled(self.z, cos_alpha), -sin_alpha, self.y);
        Self {
            origin: sum(sum(self.origin, a, self.x), d, z),
            x: sum(scaled(self.x, cosine), sine, y),
            y: sum(scaled(y, cosine), -sine, self.x),
            z,
        }
    }

    /// Transforms a point from this frame to the base frame.
    fn of(&self, place: Vector3) -> Vector3 {
        sum(sum(sum(self.origin, place.x, self.x), place.y, self.y), place.z, self.z)
    }
}

fn scaled(vector: Vector3, factor: f32) -> Vector3 {
    Vector3 { x: factor * vector.x, y: factor * vector.y, z: factor * vector.z }
}

/// Returns `one + factor other`.
fn sum(one: Vector3, factor: f32, other: Vector3) -> Vector3 {
    let Vector3 { x, y, z } = other;
    Vector3 { x: one.x + factor * x, y: one.y + factor * y, z: one.z + factor * z }
}

fn cross(one: Vector3, other: Vector3) -> Vector3 {
    Vector3 {
        x: one.y * other.z - one.z * other.y,
        y: one.z * other.x - one.x * other.z,
        z: one.x * other.y - one.y * other.x,
    }
}
