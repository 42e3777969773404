//! Planar arms: `PLANAR_TIP_MOD`, and dynamics for gravity compensation, computed torque and collision detection.
//!
//! Joint `k` rotates all links from `k` on about z; at positions 0 the arm is stretched along x. The tip is at the end
//! of the last link, at `z = 0`. The centre of mass of each link lies on the line between its joints. With the angle
//! `φ` of each link from x, `e = (cos φ, sin φ)`, `n = (-sin φ, cos φ)`, and `u = φ'' n - φ'² e`, link `k` needs the
//! torque `Q_k` about joint `k`:
//!
//! ```text
//! Q_k = J_k φ_k'' + n_k · (s_k (Σ_{j<k} l_j u_j - g) + l_k Σ_{j>k} s_j u_j)        tau_k = Σ_{j>=k} Q_j
//! s_k = m_k c_k + l_k Σ_{j>k} m_j                  J_k = I_k + m_k c_k² + l_k² Σ_{j>k} m_j
//! ```
//!
//! (Newton-Euler, link by link, with the masses beyond a joint lumped into it; Craig, chapter 6.)

use crate::dynamics::{ArmDynamics, Axes};
use crate::tip::{ForwardKinematics, Joint, TipPose, Vector3};
use dimsart_core::limits::MAX_DOF;
use dimsart_core::{Unit, math, words};

words! {
    /// Parameters of one joint.
    pub parameters Length {
        /// Length of the link, from joint to joint.
        length: f32 = per_axis("LENGTH", Unit::Metre, 0.0..=100.0, 0.0),
    }
    /// Gravity in the plane.
    pub parameters Gravity {
        /// Acceleration of gravity along x.
        along_x: f32 = real("GRAVITY_X", Unit::MetrePerSecondSquared, -20.0..=20.0, 0.0),
        /// Acceleration of gravity along y.
        along_y: f32 = real("GRAVITY_Y", Unit::MetrePerSecondSquared, -20.0..=20.0, -9.81),
    }
    /// Parameters of one link.
    pub parameters Link {
        /// Length of the link, from joint to joint.
        length: f32 = per_axis("LENGTH", Unit::Metre, 0.0..=100.0, 0.0),
        /// Mass of the link.
        mass: f32 = per_axis("MASS", Unit::Kilogram, 0.0..=1e4, 0.0),
        /// Distance from the joint to the centre of mass of the link.
        centre: f32 = per_axis("CENTRE", Unit::Metre, -100.0..=100.0, 0.0),
        /// Inertia of the link about its centre of mass.
        inertia: f32 = per_axis("INERTIA", Unit::Inertia, 0.0..=1e4, 0.0),
    }
}

type Vector2 = [f32; 2];

/// Kinematics of a planar arm.
#[derive(Debug, Clone, Copy)]
pub struct PlanarChain;

impl ForwardKinematics for PlanarChain {
    const TIP: &'static str = "PLANAR_TIP_MOD";
    type Settings = ();
    type Joint = Length;

    fn place((): (), joints: &[Joint<Length>]) -> TipPose {
        let mut placement = TipPose::default();
        let mut angle = 0.0;
        for (joint, column) in joints.iter().zip(&mut placement.columns) {
            *column = placement.tip;
            angle += joint.position;
            let (sine, cosine) = math::sin_cos(angle);
            placement.tip.x += joint.parameters.length * cosine;
            placement.tip.y += joint.parameters.length * sine;
        }
        let Vector3 { x, y, .. } = placement.tip;
        for (_, column) in joints.iter().zip(&mut placement.columns) {
            *column = Vector3 { x: column.y - y, y: x - column.x, z: 0.0 };
        }
        placement
    }
}

/// Dynamics of a planar arm in its present pose.
#[derive(Debug, Clone, Copy)]
pub struct PlanarDynamics {
    gravity: Vector2,
    links: [Lumped; MAX_DOF],
}

/// A link with the masses beyond it lumped into its end.
#[derive(Debug, Clone, Copy, Default)]
struct Lumped {
    length: f32,
    /// `s`.
    moment: f32,
    /// `J`.
    inertia: f32,
    /// `e`.
    along: Vector2,
}

impl Lumped {
    /// `n`.
    fn across(&self) -> Vector2 {
        let [cosine, sine] = self.along;
        [-sine, cosine]
    }
}

impl ArmDynamics for PlanarDynamics {
    const GRAVITY: &'static str = "PLANAR_GRAVITY_MOD";
    const COMPUTED_TORQUE: &'static str = "PLANAR_TORQUE_MOD";
    const COLLISION: &'static str = "PLANAR_COLLISION_MOD";
    type Settings = Gravity;
    type Link = Link;

    fn at(gravity: Gravity, links: &[Link; MAX_DOF], position: &Axes) -> Self {
        let mut lumped = [Lumped::default(); MAX_DOF];
        let mut angle = 0.0;
        for (lumped, position) in lumped.iter_mut().zip(position) {
            angle += position;
            let (sine, cosine) = math::sin_cos(angle);
            lumped.along = [cosine, sine];
        }
        let mut beyond = 0.0;
        for (lumped, link) in lumped.iter_mut().zip(links).rev() {
            lumped.length = link.length;
            lumped.moment = link.mass * link.centre + link.length * beyond;
            lumped.inertia =
                link.inertia + link.mass * link.centre * link.centre + link.length * link.length * beyond;
            beyond += link.mass;
        }
        Self { gravity: [gravity.along_x, gravity.along_y], links: lumped }
    }

    fn torques(&self, velocity: &Axes, acceleration: &Axes) -> Axes {
        let (rates, accelerations) = (outwards(velocity), outwards(acceleration));
        let mut moved = [Vector2::default(); MAX_DOF];
        for ((moved, link), (rate, acceleration)) in
            moved.iter_mut().zip(&self.links).zip(rates.iter().zip(accelerations))
        {
            *moved = plus(scaled(link.across(), acceleration), -rate * rate, link.along);
        }
        let pulls = self.pulls(self.gravity.map(|along| -along), &moved);
        let mut torques = [0.0; MAX_DOF];
        for ((torque, link), (pull, acceleration)) in
            torques.iter_mut().zip(&self.links).zip(pulls.iter().zip(accelerations))
        {
            *torque = link.inertia * acceleration + dot(link.across(), *pull);
        }
        inwards(torques)
    }

    fn momentum(&self, velocity: &Axes) -> (Axes, Axes) {
        let rates = outwards(velocity);
        let mut moved = [Vector2::default(); MAX_DOF];
        for ((moved, link), rate) in moved.iter_mut().zip(&self.links).zip(rates) {
            *moved = scaled(link.across(), rate);
        }
        let pulls = self.pulls([0.0; 2], &moved);
        let (mut momentum, mut slope) = ([0.0; MAX_DOF], [0.0; MAX_DOF]);
        for (((momentum, slope), link), (pull, rate)) in
            momentum.iter_mut().zip(&mut slope).zip(&self.links).zip(pulls.iter().zip(rates))
        {
            *momentum = link.inertia * rate + dot(link.across(), *pull);
            *slope = -rate * dot(link.along, *pull);
        }
        (inwards(momentum), inwards(slope))
    }
}

impl PlanarDynamics {
    /// Returns `s_k (base + Σ_{j<k} l_j u_j) + l_k Σ_{j>k} s_j u_j` for each link.
    fn pulls(&self, base: Vector2, moved: &[Vector2; MAX_DOF]) -> [Vector2; MAX_DOF] {
        let mut pulls = [Vector2::default(); MAX_DOF];
        let mut before = base;
        for ((pull, link), moved) in pulls.iter_mut().zip(&self.links).zip(moved) {
            *pull = scaled(before, link.moment);
            before = plus(before, link.length, *moved);
        }
        let mut behind = Vector2::default();
        for ((pull, link), moved) in pulls.iter_mut().zip(&self.links).zip(moved).rev() {
            *pull = plus(*pull, link.length, behind);
            behind = plus(behind, link.moment, *moved);
        }
        pulls
    }
}

/// Converts joint values to link values: sums over the joints up to each link.
fn outwards(of_joints: &Axes) -> Axes {
    let mut sum = 0.0;
    of_joints.map(|of_joint| {
        sum += of_joint;
        sum
    })
}

/// Converts link values to joint values: sums over the links from each joint on.
fn inwards(mut of_links: Axes) -> Axes {
    let mut sum = 0.0;
    for value in of_links.iter_mut().rev() {
        sum += *value;
        *value = sum;
    }
    of_links
}

fn scaled([x, y]: Vector2, factor: f32) -> Vector2 {
    [factor * x, factor * y]
}

/// Returns `one + factor other`.
fn plus([x, y]: Vector2, factor: f32, other: Vector2) -> Vector2 {
    let [dx, dy] = scaled(other, factor);
    [x + dx, y + dy]
}

fn dot([x, y]: Vector2, [to_x, to_y]: Vector2) -> f32 {
    x * to_x + y * to_y
}
