//! The equations of motion of an open chain of rigid links.
//!
//! The mass matrix by the composite-rigid-body method (M. W. Walker, D. E. Orin, "Efficient dynamic computer simulation
//! of robotic mechanisms", ASME J. Dynamic Systems, Measurement, and Control 104, 1982), the bias by recursive
//! Newton-Euler with no acceleration (J. Y. S. Luh, M. W. Walker, R. P. C. Paul, "On-line computational scheme for
//! mechanical manipulators", the same journal 102, 1980).
#![expect(clippy::indexing_slicing, reason = "matrices of a fixed size")]

use super::ArmParameters;
use super::link::{LinkKind, LinkParameters};
use super::spatial::{Inertia, Twist, Wrench};
use super::vector::{Vector, cross, dot, plus, scaled, turned};
use crate::plant::coupled::{AxisValues, Dynamics, Matrix, Mechanism};
use dimsart_core::limits::MAX_DOF;

/// An open chain of rigid links.
#[derive(Debug, Clone)]
pub struct Chain {
    gravity_m_per_s2: Vector,
    tip_m: Vector,
    links: Vec<Link>,
}

#[derive(Debug, Clone)]
struct Link {
    kind: LinkKind,
    a_m: f64,
    /// Sine and cosine.
    alpha: (f64, f64),
    d_m: f64,
    theta_rad: f64,
    mass_kg: f64,
    centre_m: Vector,
    /// Inertia matrix by rows, about the centre of mass.
    inertia_kg_m2: [Vector; 3],
}

/// Frame of a link relative to the base.
#[derive(Debug, Clone, Copy)]
struct Frame {
    origin: Vector,
    x: Vector,
    y: Vector,
    z: Vector,
}

/// Motion of one joint.
#[derive(Debug, Clone, Copy, Default)]
struct Moved {
    /// Twist of all bodies beyond the joint, at unit velocity.
    twist: Twist,
    /// Inertia of its link.
    inertia: Inertia,
}

impl Frame {
    const BASE: Self = Self { origin: [0.0; 3], x: [1.0, 0.0, 0.0], y: [0.0, 1.0, 0.0], z: [0.0, 0.0, 1.0] };

    /// Converts a direction of this frame to the base frame.
    fn seen(&self, [x, y, z]: Vector) -> Vector {
        plus(plus(scaled(self.x, x), scaled(self.y, y)), scaled(self.z, z))
    }

    /// Converts a point of this frame to the base frame.
    fn place(&self, place: Vector) -> Vector {
        plus(self.origin, self.seen(place))
    }
}

impl Link {
    fn of(link: &LinkParameters) -> Self {
        let [xx, yy, zz, xy, xz, yz] = link.inertia_kg_m2;
        Self {
            kind: link.kind,
            a_m: link.a_m,
            alpha: libm::sincos(link.alpha_rad),
            d_m: link.d_m,
            theta_rad: link.theta_rad,
            mass_kg: link.mass_kg,
            centre_m: link.centre_of_mass_m,
            inertia_kg_m2: [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]],
        }
    }

    /// Computes its frame from the previous link's frame and its joint's position.
    fn frame(&self, before: &Frame, position: f64) -> Frame {
        let (turn, slide) = match self.kind {
            LinkKind::Revolute => (position, 0.0),
            LinkKind::Prismatic => (0.0, position),
        };
        let (y, z) = turned(before.y, before.z, self.alpha);
        let (x, y) = turned(before.x, y, libm::sincos(self.theta_rad + turn));
        let along = plus(scaled(before.x, self.a_m), scaled(z, self.d_m + slide));
        Frame { origin: plus(before.origin, along), x, y, z }
    }

    fn twist(&self, frame: &Frame) -> Twist {
        match self.kind {
            LinkKind::Revolute => Twist { angular: frame.z, linear: cross(frame.origin, frame.z) },
            LinkKind::Prismatic => Twist { angular: [0.0; 3], linear: frame.z },
        }
    }

    fn inertia(&self, frame: &Frame) -> Inertia {
        let Frame { x, y, z, .. } = *frame;
        let [first, second, third] = self.inertia_kg_m2;
        let (u, v, w) = (frame.seen(first), frame.seen(second), frame.seen(third));
        let row = |x: f64, y: f64, z: f64| plus(plus(scaled(u, x), scaled(v, y)), scaled(w, z));
        let ([x0, x1, x2], [y0, y1, y2], [z0, z1, z2]) = (x, y, z);
        let turned = [row(x0, y0, z0), row(x1, y1, z1), row(x2, y2, z2)];
        Inertia::of(self.mass_kg, frame.place(self.centre_m), turned)
    }
}

impl Chain {
    pub(super) fn of(parameters: &ArmParameters) -> Self {
        Self {
            gravity_m_per_s2: parameters.gravity_m_per_s2,
            tip_m: parameters.tip_m,
            links: parameters.link.iter().map(Link::of).collect(),
        }
    }

    /// Returns each link with its frame, starting at the base.
    fn frames(&self, position: &AxisValues) -> impl Iterator<Item = (&Link, Frame)> {
        self.links.iter().zip(position).scan(Frame::BASE, |before, (link, position)| {
            *before = link.frame(before, *position);
            Some((link, *before))
        })
    }

    fn moved(&self, position: &AxisValues) -> [Moved; MAX_DOF] {
        let mut moved = [Moved::default(); MAX_DOF];
        for (moved, (link, frame)) in moved.iter_mut().zip(self.frames(position)) {
            *moved = Moved { twist: link.twist(&frame), inertia: link.inertia(&frame) };
        }
        moved
    }
}

impl Mechanism for Chain {
    fn axes(&self) -> usize {
        self.links.len()
    }

    fn dynamics(&self, position: &AxisValues, velocity: &AxisValues) -> Dynamics {
        let moved = self.moved(position);
        let moved = moved.get(..self.axes()).unwrap_or(&moved);
        // Gravity equals an upward acceleration of the base.
        let mut acceleration = Twist { angular: [0.0; 3], linear: scaled(self.gravity_m_per_s2, -1.0) };
        let mut motion = Twist::default();
        let mut needed = [Wrench::default(); MAX_DOF];
        for ((moved, velocity), needed) in moved.iter().zip(velocity).zip(&mut needed) {
            let joint = moved.twist.scaled(*velocity);
            motion = motion.plus(joint);
            acceleration = acceleration.plus(motion.carries(joint));
            let momentum = moved.inertia.times(motion);
            *needed = moved.inertia.times(acceleration).plus(motion.carries_momentum(momentum));
        }
        let mut mass = Matrix::default();
        let mut bias = [0.0; MAX_DOF];
        let mut beyond = Inertia::default();
        let mut wrench = Wrench::default();
        for (axis, ((own, needed), bias)) in moved.iter().zip(&needed).zip(&mut bias).enumerate().rev() {
            beyond = beyond.plus(own.inertia);
            wrench = wrench.plus(*needed);
            *bias = own.twist.power(&wrench);
            let momentum = beyond.times(own.twist);
            for (other, moved) in moved.iter().take(axis + 1).enumerate() {
                let entry = moved.twist.power(&momentum);
                mass[(axis, other)] = entry;
                mass[(other, axis)] = entry;
            }
        }
        Dynamics { mass, bias }
    }

    fn potential_j(&self, position: &AxisValues) -> f64 {
        let lifted = |(link, frame): (&Link, Frame)| {
            -link.mass_kg * dot(self.gravity_m_per_s2, frame.place(link.centre_m))
        };
        self.frames(position).map(lifted).sum()
    }

    fn tip_m(&self, position: &AxisValues) -> [f64; 3] {
        self.frames(position).last().map_or(self.tip_m, |(_, frame)| frame.place(self.tip_m))
    }

    fn tip_jacobian(&self, position: &AxisValues) -> [AxisValues; 3] {
        let tip = self.tip_m(position);
        let mut columns = [[0.0; 3]; MAX_DOF];
        for (column, (link, frame)) in columns.iter_mut().zip(self.frames(position)) {
            *column = link.twist(&frame).velocity_at(tip);
        }
        [columns.map(|[x, _, _]| x), columns.map(|[_, y, _]| y), columns.map(|[_, _, z]| z)]
    }
}
