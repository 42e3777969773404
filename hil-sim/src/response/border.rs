//! Stability and passivity limits of a two-robot coupling by theory, from the rig's parameters.
//!
//! **Position-force.** The slave's controller outputs `F = K (x_m[k-n1] - x_s)`, the master receives `-S F[k-n2]`.
//! Both robots are sampled, forces are constant within a tick, and `G = x/F` is that of a mass-damper-spring. The
//! loop is `1 + z^-n L = 0`, with `L = S K G_m/(1 + K G_s)` and `n = n1 + n2`. A root reaches the unit circle where
//! `|L| = 1` at `z = exp(jθ)`; a delay of `n = (π + arg L)/θ` ticks shifts its phase to -180°. The minimum is the
//! delay margin (phase margin divided by frequency), of free space and of wall contact.
//!
//! **Wave variables, time-domain passivity, tanks.** The link is passive at any delay, and so is a wall. The
//! remaining active element is the sampled spring `K` at each robot, which the robot's damping must dissipate: `b >=
//! K h/2` (Colgate and Schenkel 1997), and `b >= K h/2 / (1 - K h/B)` for waves of impedance `B` in split form, which
//! is one tick later.

use std::f64::consts::PI;

use dimsart_core::{Engine, ModuleRef};
use nalgebra::{Complex, Matrix3, Matrix4};
use serde::Serialize;

use super::chain::{Controller, chosen, real};
use crate::link::InProcessParameters;
use crate::plant::{GearParameters, JointMotorParameters, JointParameters};
use crate::rig::{Rig, SimulatedDimsart};
use crate::rig_file::{AxisSection, ControllerSection, DeviceSection, LinkSection, RigFile};

/// Evaluated frequencies, logarithmic over the decades below half the sample rate.
const FREQUENCIES: u32 = 4_000;
const DECADES: f64 = 5.0;
/// Iterations for full resolution of a frequency.
const HALVINGS: u32 = 48;
/// Kinds of coupling.
const KNOWN: [&str; 7] =
    ["COMM_RXMOD", "COMM_TXMOD", "NORMALIZER_MOD", "PDCTRL_MOD", "TANK_MOD", "TDPA_MOD", "WTRANSF_MOD"];
/// Largest eigenvalue, within rounding, of a stable system or one with constant offsets.
const STABLE: f64 = 1.0 + 1e-9;

/// The deciding quantity and its limit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(untagged)]
pub enum StabilityLimit {
    /// A coupling that becomes unstable by delay.
    Delay {
        /// Round trip, ticks.
        round_trip_ticks: f64,
        /// Delay margin, ticks; `None` if stable for any delay.
        delay_margin_ticks: Option<f64>,
    },
    /// A coupling that is passive at any delay, at the robot with the least reserve. `N s/m` or `N m s/rad`.
    Damping {
        /// Damping required by its sampled controller.
        needed_damping: f64,
        /// Available damping, including the hand.
        damping: f64,
    },
}

/// A robot of one axis with its coupling.
struct Robot<'f> {
    axis: &'f AxisSection,
    joint: JointParameters,
    /// `K_PARAM` of its PD controller.
    stiffness: Option<f64>,
    /// Factor of the peer's force.
    force_scale: Option<f64>,
    /// Damping required by its coupling; `None` if the coupling is not known to be passive.
    needed_damping: Option<f64>,
    /// Whether its scheme delays received signals.
    adds_delay: bool,
}

/// Whether a scheme consists only of modules covered by the theory, each once and in every tick.
fn is_known(engine: &Engine) -> bool {
    let known = |module: ModuleRef| {
        let is_one = |name: &&str| ModuleRef::new(name, 1) == module;
        let is_in_every_tick = engine.module_rate(module).is_none_or(|rate| rate.every_ticks == 1);
        KNOWN.iter().any(is_one) && is_in_every_tick
    };
    engine.instances().filter(|module| engine.is_plugged_in(*module)).all(known)
}

impl StabilityLimit {
    /// Computes the limit of two rigid one-axis robots without motor lag, joined by links of constant delay, with
    /// schemes of the covered modules; `None` otherwise.
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
    /// `None` unless the device is one mass, damper and spring and its controller does not differentiate.
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

    /// Damping of robot and hand.
    fn damping(&self) -> f64 {
        self.joint.load.damping + self.joint.friction.viscous
    }

    /// Position response to a force that is constant within a tick; in contact, with a two-sided wall.
    fn sampled(&self, in_contact: bool, period_s: f64) -> Option<Sampled> {
        let wall = self.axis.active_wall().filter(|_| in_contact);
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

/// A robot as a sampled system: position, velocity and constant force.
struct Sampled(Matrix3<f64>);

impl Sampled {
    /// Returns `G(z)`.
    fn gain(&self, z: Complex<f64>) -> Complex<f64> {
        let step = &self.0;
        let [to_x, to_v] = [step.m13, step.m23];
        let determinant = (z - step.m11) * (z - step.m22) - step.m12 * step.m21;
        ((z - step.m22) * to_x + step.m12 * to_v) / determinant
    }
}

/// Position-force loop.
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

    /// Returns the maximum stable round trip in ticks, 0 if never stable.
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

    /// Whether it is stable without delay, by its eigenvalues. Constant offsets count as stable.
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

/// Round trip of two controllers with direct links to each other without a bus; a packet without delay waits for a
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
