//! Where theory has a coupling of two robots become unstable, or active: worked out of a rig's own numbers, beside its run.
//!
//! **Position-force.** The slave's controller pushes by `F = K (x_m[k-n1] - x_s)`, the master is pushed by `-S F[k-n2]`.
//! With both robots sampled and their force held, `G = x/F` of a mass with damper and spring, the loop is
//! `1 + z^-n L = 0`, `L = S K G_m/(1 + K G_s)`, `n = n1 + n2`. A root comes to the unit circle where `|L| = 1` at
//! `z = exp(jθ)`, and `n = (π + arg L)/θ` ticks turn its phase to -180°: the smallest one is the delay margin, phase
//! margin over frequency. It is the smaller one of free space and of the slave held by its wall.
//!
//! **Wave variables, passivity in time domain, tanks.** The link is passive whatever its delay, and so is a wall. What is
//! left is the sampled spring `K` at each robot, which the robot's own damping has to pay for: `b >= K h/2` (Colgate and
//! Schenkel 1997), and `b >= K h/2 / (1 - K h/B)` for waves of impedance `B` in their split form, which is later by a tick.

use std::f64::consts::PI;

use dimsart_core::ModuleRef;
use nalgebra::{Complex, Matrix3, Matrix4};
use serde::Serialize;

use super::chain::{Controller, SimulatedEngine, chosen, real};
use crate::link::InProcessParameters;
use crate::plant::{GearParameters, JointMotorParameters, JointParameters};
use crate::rig::{Rig, SimulatedDimsart};
use crate::rig_file::{AxisSection, ControllerSection, DeviceSection, LinkSection, RigFile};

/// Frequencies at which the loop is looked at, evenly on a logarithmic scale over the decades below half the sample rate.
const FREQUENCIES: u32 = 4_000;
const DECADES: f64 = 5.0;
/// Until a frequency is known to the last bits.
const HALVINGS: u32 = 48;
/// What a coupling may be made of.
const KNOWN: [&str; 7] =
    ["COMM_RXMOD", "COMM_TXMOD", "NORMALIZER_MOD", "PDCTRL_MOD", "TANK_MOD", "TDPA_MOD", "WTRANSF_MOD"];
/// Largest eigenvalue, but for rounding, of what is stable or stays where it is.
const STABLE: f64 = 1.0 + 1e-9;

/// What decides, and what it must not pass.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Border {
    /// Of a coupling that the delay makes unstable.
    Delay {
        /// Ticks there and back.
        round_trip_ticks: f64,
        /// So many of them it is stable below; none when any number of them is.
        delay_margin_ticks: Option<f64>,
    },
    /// Of a coupling that is passive at any delay, at the robot that has the least to spare. `N s/m` or `N m s/rad`.
    Damping {
        /// What its sampled controller needs.
        needed_damping: f64,
        /// What it has, with the hand that holds it.
        damping: f64,
    },
}

/// A robot of one axis, and what its controller couples it by.
struct Robot<'f> {
    axis: &'f AxisSection,
    joint: JointParameters,
    /// `K_PARAM` of its PD controller.
    stiffness: Option<f64>,
    /// What the other one's force is multiplied by.
    force_scale: Option<f64>,
    /// The damping of its own that its coupling needs; none where the coupling is not known to be passive.
    needed_damping: Option<f64>,
    /// Whether its scheme has what comes over the link wait.
    adds_delay: bool,
}

/// Whether a scheme has modules that theory knows here and no others, each of them once and in every tick.
fn is_known(engine: &SimulatedEngine) -> bool {
    let known = |module: ModuleRef| {
        let is_one = |name: &&str| ModuleRef::new(name, 1) == module;
        let is_in_every_tick = engine.rate_of(module).is_none_or(|rate| rate.every_ticks == 1);
        KNOWN.iter().any(is_one) && is_in_every_tick
    };
    engine.instances().filter(|module| engine.is_plugged_in(*module)).all(known)
}

impl Border {
    /// Of two robots of one axis each, rigid and without a motor's lag, that links of constant delay join, under schemes of the
    /// modules that the coupling is made of; `None` of anything else.
    #[must_use]
    pub fn of(file: &RigFile, rig: &mut Rig) -> Option<Self> {
        let [one, other] = file.controllers.as_slice() else { return None };
        if [one, other].iter().any(|controller| controller.every_ticks != 1) {
            return None;
        }
        let period_s = file.sample_period_s;
        let mut robot = |controller: &ControllerSection| {
            let station = rig.stations_mut().iter_mut().find(|station| station.name == controller.name())?;
            if !is_known(station.dimsart.engine()) {
                return None;
            }
            Robot::of(file.device(&controller.device)?, &mut station.dimsart, period_s)
        };
        let robots = [robot(one)?, robot(other)?];
        if let [Some(one_needs), Some(other_needs)] = robots.each_ref().map(|robot| robot.needed_damping) {
            let [one_has, other_has] = robots.each_ref().map(Robot::damping);
            let spares_less = one_has - one_needs < other_has - other_needs;
            let (needed_damping, damping) =
                if spares_less { (one_needs, one_has) } else { (other_needs, other_has) };
            return Some(Self::Damping { needed_damping, damping });
        }
        if robots.iter().any(|robot| robot.adds_delay) {
            return None;
        }
        let round_trip_ticks = round_trip_ticks(file, [one.name(), other.name()])?;
        let [master, slave] = match robots {
            [slave, master] if master.stiffness.is_none() => [master, slave],
            robots => robots,
        };
        let loops = [false, true].map(|in_contact| PositionForce::of(&master, &slave, in_contact, period_s));
        let [free, in_contact] = loops;
        let margins = [free?.delay_margin_ticks(), in_contact?.delay_margin_ticks()];
        let margin = margins.into_iter().fold(f64::INFINITY, f64::min);
        Some(Self::Delay { round_trip_ticks, delay_margin_ticks: margin.is_finite().then_some(margin) })
    }
}

impl<'f> Robot<'f> {
    /// None of a device that is not one mass, damper and spring, or whose controller differentiates.
    fn of(device: &'f DeviceSection, dimsart: &mut SimulatedDimsart, period_s: f64) -> Option<Self> {
        let [axis] = device.axes.as_slice() else { return None };
        let joint = axis.joint()?;
        let is_ideal =
            joint.motor == JointMotorParameters::default() && joint.gear == GearParameters::default();
        if !is_ideal || joint.flexible.is_some() || device.delay_ticks > 0.0 || !axis.sensor.is_empty() {
            return None;
        }
        let adds_delay = Controller::read(dimsart).delay_ticks != Some(0);
        let engine = dimsart.engine_mut();
        let stiffness = real(engine, "PDCTRL_MOD", "K_PARAM", 0);
        if real(engine, "PDCTRL_MOD", "D_PARAM", 0).is_some_and(|damping| damping > 0.0) {
            return None;
        }
        let force_scale = real(engine, "NORMALIZER_MOD", "SCALE", 0);
        let sampled = 0.5 * period_s * stiffness.unwrap_or(0.0);
        let waves = real(engine, "WTRANSF_MOD", "B_PARAM", 0);
        let needed_damping = match (waves, chosen(engine, "WTRANSF_MOD", "FORM")) {
            (Some(_), Some("IMPLICIT")) => Some(sampled),
            (Some(impedance), Some("SPLIT")) => {
                let left = 1.0 - 2.0 * sampled / impedance;
                (left > 0.0).then_some(sampled / left)
            }
            (None, None) => {
                let holds = [("TDPA_MOD", "DRIFT_RATE"), ("TANK_MOD", "SHARE")];
                let is_held = holds.iter().any(|(module, known)| real(engine, module, known, 0).is_some());
                is_held.then_some(sampled)
            }
            _ => None,
        };
        Some(Self { axis, joint, stiffness, force_scale, needed_damping, adds_delay })
    }

    /// Of its own and of the hand that holds it.
    fn damping(&self) -> f64 {
        self.joint.load.damping + self.joint.friction.viscous
    }

    /// How its position follows a force that is held for a tick; in contact, with its wall on both sides.
    fn sampled(&self, in_contact: bool, period_s: f64) -> Option<Sampled> {
        let wall = self.axis.met_wall().filter(|_| in_contact);
        let (wall_stiffness, wall_damping) = wall.map_or((0.0, 0.0), |wall| (wall.stiffness, wall.damping));
        let inertia = self.joint.load.inertia;
        let a = Matrix3::new(
            0.0,
            1.0,
            0.0,
            -(self.joint.load.stiffness + wall_stiffness) / inertia,
            -(self.damping() + wall_damping) / inertia,
            1.0 / inertia,
            0.0,
            0.0,
            0.0,
        );
        let step = (a * period_s).exp();
        step.iter().all(|value| value.is_finite()).then_some(Sampled(step))
    }
}

/// A robot from tick to tick: position, velocity and the force that is held.
struct Sampled(Matrix3<f64>);

impl Sampled {
    /// `G(z)`.
    fn gain(&self, z: Complex<f64>) -> Complex<f64> {
        let step = &self.0;
        let [to_x, to_v] = [step.m13, step.m23];
        let determinant = (z - step.m11) * (z - step.m22) - step.m12 * step.m21;
        ((z - step.m22) * to_x + step.m12 * to_v) / determinant
    }
}

/// The loop of position-force.
struct PositionForce {
    master: Sampled,
    slave: Sampled,
    stiffness: f64,
    force_scale: f64,
}

impl PositionForce {
    fn of(master: &Robot<'_>, slave: &Robot<'_>, in_contact: bool, period_s: f64) -> Option<Self> {
        if master.stiffness.is_some() || [master, slave].iter().any(|robot| robot.needed_damping.is_some()) {
            return None;
        }
        Some(Self {
            master: master.sampled(false, period_s)?,
            slave: slave.sampled(in_contact, period_s)?,
            stiffness: slave.stiffness?,
            force_scale: -master.force_scale?,
        })
    }

    /// Ticks there and back up to which it is stable, 0 of one that never is.
    fn delay_margin_ticks(&self) -> f64 {
        if !self.is_stable_at_once() {
            return 0.0;
        }
        let loop_gain = |angle: f64| {
            let z = Complex::from_polar(1.0, angle);
            let slave = self.slave.gain(z) * self.stiffness;
            self.master.gain(z) * (self.force_scale * self.stiffness) / (slave + 1.0)
        };
        let angle = |n: f64| PI * libm::exp10(DECADES * (n / f64::from(FREQUENCIES) - 1.0));
        let excess = |n: f64| loop_gain(angle(n)).norm() - 1.0;
        let crossing = |n: u32| {
            let (mut from, mut to) = (f64::from(n), f64::from(n + 1));
            let is_above = excess(from) > 0.0;
            if is_above == (excess(to) > 0.0) {
                return None;
            }
            for _ in 0..HALVINGS {
                let middle = 0.5 * (from + to);
                if (excess(middle) > 0.0) == is_above { from = middle } else { to = middle }
            }
            Some((PI + loop_gain(angle(from)).arg()) / angle(from))
        };
        (0..FREQUENCIES).filter_map(crossing).fold(f64::INFINITY, f64::min)
    }

    /// Whether it is stable without delay: by its eigenvalues. What stays where it is counts as stable.
    fn is_stable_at_once(&self) -> bool {
        let [master, slave] = [&self.master.0, &self.slave.0];
        let [to_slave, to_master] = [self.stiffness, -self.force_scale * self.stiffness];
        let step = Matrix4::new(
            master.m11 + master.m13 * to_master,
            master.m12,
            -master.m13 * to_master,
            0.0,
            master.m21 + master.m23 * to_master,
            master.m22,
            -master.m23 * to_master,
            0.0,
            slave.m13 * to_slave,
            0.0,
            slave.m11 - slave.m13 * to_slave,
            slave.m12,
            slave.m23 * to_slave,
            0.0,
            slave.m21 - slave.m23 * to_slave,
            slave.m22,
        );
        step.complex_eigenvalues().iter().all(|eigenvalue| eigenvalue.norm() <= STABLE)
    }
}

/// Of two controllers, each with a link to the other one that goes over no bus; a packet without delay waits for a
/// controller that is stepped earlier.
fn round_trip_ticks(file: &RigFile, [one, other]: [&str; 2]) -> Option<f64> {
    let [there, back] = file.links.as_slice() else { return None };
    let is_both_ways = (there.from.as_str(), there.to.as_str()) == (back.to.as_str(), back.from.as_str());
    let joins = [[one, other], [other, one]].contains(&[there.from.as_str(), there.to.as_str()]);
    let is_constant = |link: &&LinkSection| {
        let InProcessParameters { jitter_ticks, loss, reordering, .. } = link.carrier;
        link.bus.is_none() && jitter_ticks == 0 && loss <= 0.0 && reordering <= 0.0
    };
    if !is_both_ways || !joins || ![there, back].iter().all(is_constant) {
        return None;
    }
    let ticks = there.carrier.delay_ticks.saturating_add(back.carrier.delay_ticks);
    let waits = if there.to == one { there } else { back }.carrier.delay_ticks == 0;
    Some(f64::from(ticks) + f64::from(u8::from(waits)))
}
