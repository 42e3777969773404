//! What stands between a controller's force and the world: masses, motors, hands, walls.
//!
//! ```text
//!   command_n ──▶ motor (or ideal source) ──▶ mass m: m a = F_motor + F_friction + Σ F_environment ──▶ encoder ──▶ position_m
//! ```
//! Every force is linear between events (contact, release, friction reversal, voltage limit), so each sub-step is
//! taken with the exact zero-order-hold matrix of the linear regime it is in, and only events are approximated.
//!
//! A new environment is a file here, a line in the registry below, and its keys in `scenarios/bilateral.toml`, in a
//! section of its name; a scenario chooses it by `environment = "name"`. A plant of another kind than independent
//! axes is a file here that implements [`Plant`], and a line in `bilateral/station.rs`, which builds it. A machine whose
//! axes move each other is a file here that says its equations of motion, a [`Mechanism`]; [`Coupled`] moves it.

mod arm;
mod axis;
mod axis_wise;
mod cia402;
mod coupled;
mod device;
mod drive_bus;
mod environment;
mod hand;
mod hand_phase;
mod joint;
mod moteus;
mod motor;
mod obstacle;
mod parameter;
mod phantom;
#[cfg(test)]
mod physics;
mod registry;
mod repetition;
mod scene;
mod sensor;
mod spring;
mod transition;
mod transitions;
mod wall;

pub use arm::{Arm, ArmParameters, Chain, LinkKind, LinkParameters};
pub use axis::Axis;
pub use axis_wise::AxisWise;
pub use cia402::Cia402Drive;
pub use coupled::{Axes, Coupled, CoupledAxisState, Dynamics, Matrix, Mechanism, Tip};
pub use device::DeviceParameters;
pub use drive_bus::{Absence, Cia402Parameters, DriveBus, FoundFault, MoteusParameters};
pub use environment::{Environment, Law, Role};
pub use hand::{Hand, HandParameters};
pub use hand_phase::HandPhase;
pub use joint::{
    BridgeMotor, BridgeState, BrushedParameters, FlexibleParameters, FrictionParameters, GearParameters,
    Joint, JointEnergy, JointMotorParameters, JointParameters, JointState, LoadParameters, StopsParameters,
    ThermalParameters, ThreePhaseParameters,
};
pub use moteus::MoteusDrive;
pub use motor::{MotorParameters, MotorTruth};
pub use obstacle::Obstacle;
pub use parameter::ParameterError;
pub use phantom::{Linkage, LinkageParameters, Phantom, PhantomParameters, PhantomPort};
pub use repetition::{PEAK_SPEED, Repetition, minimum_jerk};
pub use sensor::{Sensor, SensorParameters};
pub use spring::{Spring, SpringParameters};
pub use wall::{RIGID_STIFFNESS_N_PER_M, Wall, WallParameters, WallSide};

/// Sub-steps that every plant takes per held command, at least.
pub const SUB_STEPS_MIN: u32 = 20;

/// Anything with sensors and actuators that a rig can join to a controller.
///
/// Deterministic: the same calls give the same bits. Never reads a clock.
pub trait Plant: core::fmt::Debug + Send {
    /// Number of axes.
    fn dof(&self) -> usize;

    /// What its sensors show now, as its device's frame is laid out: all axes' positions first, `m` or `rad`. Fills as many
    /// entries as it has sensors, leaves the rest.
    fn sense(&mut self, measured: &mut [f32]);

    /// Holds `command` (`N` or `N m`, one per axis; missing entries are 0, surplus is ignored) from `start_s` for
    /// `period_s` and moves the world on, in [`SUB_STEPS_MIN`] sub-steps or more; where a bound shows that no
    /// event can fall into the period, they may be taken as one exact step.
    ///
    /// A command that is NaN or infinite is applied as it is: a plant hides no fault of its controller. It shows
    /// in the truth, and in the motion unless friction holds the axis.
    fn advance(&mut self, start_s: f64, period_s: f64, command: &[f32]);

    /// Tells it before [`advance`](Self::advance) whether its actuators are commanded, or off. A plant whose actuators cannot
    /// be off does nothing.
    fn switch(&mut self, _is_on: bool) {}

    /// Sets the time of the experiment that moves its references, loads and hands. A plant without an experiment does
    /// nothing.
    fn repeat(&mut self, _repetition: Repetition) {}

    /// The simulator's own truth about a linear `axis` that hands and walls push; none for any other.
    fn truth(&self, axis: usize) -> Option<AxisTruth>;

    /// Where an axis really is now, `m` or `rad`; NaN for one that it does not have.
    fn position(&self, axis: usize) -> f64 {
        let mut values = [f64::NAN; MAX_QUANTITIES];
        self.look(axis, &mut values);
        let [position, ..] = values;
        position
    }

    /// Adds what its actuators do now, by axis; of a plant without any, nothing.
    fn add_actuations(&self, _actuations: &mut Vec<Actuation>) {}

    /// Whether an axis pushes against a wall or a stop.
    fn is_touching(&self, axis: usize) -> bool;

    /// What the simulator knows of an axis, in the order of [`look`](Self::look): names and units.
    fn quantities(&self, _axis: usize) -> &'static [(&'static str, &'static str)] {
        &AxisTruth::QUANTITIES
    }

    /// Puts what [is known](Self::quantities) of an axis now into `values`.
    fn look(&self, axis: usize, values: &mut [f64]) {
        let truth = self.truth(axis).map(|truth| truth.quantities()).unwrap_or([f64::NAN; 5]);
        for (entry, value) in values.iter_mut().zip(truth) {
            *entry = value;
        }
    }
}

/// What an actuator does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Actuation {
    /// Where it acts, `m` or `rad`.
    pub position: f64,
    /// What it applies, `N` or `N m`.
    pub force: f64,
    /// Whether that is held for a whole period, as by an ideal source; the force of a motor changes.
    pub is_held: bool,
    /// Whether it moves several of the device's directions, as the joints of one that is held at its tip.
    pub moves_several: bool,
}

/// Most quantities that are known of an axis.
pub const MAX_QUANTITIES: usize = 8;

/// The simulator's own truth about one axis; no encoder stands in between. Forces act *on the device*.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisTruth {
    /// Position, `m`.
    pub position_m: f64,
    /// Velocity, `m/s`.
    pub velocity_m_per_s: f64,
    /// What the motor really applies, `N`; the held command if the axis has an ideal force source.
    pub actuator_force_n: f64,
    /// Sum over all hands, `N`, as a force sensor between hand and device reads it: the hand's inertia included.
    pub hand_force_n: f64,
    /// Sum over all walls, `N`; 0 when not touching.
    pub wall_force_n: f64,
    /// Whether a wall pushes.
    pub is_in_contact: bool,
    /// The motor's electrical side, none for an ideal force source.
    pub motor: Option<MotorTruth>,
}

impl AxisTruth {
    const QUANTITIES: [(&'static str, &'static str); 5] = [
        ("position", "m"),
        ("velocity", "m/s"),
        ("actuator_force", "N"),
        ("hand_force", "N"),
        ("wall_force", "N"),
    ];

    fn quantities(&self) -> [f64; 5] {
        let Self { position_m, velocity_m_per_s, actuator_force_n, hand_force_n, wall_force_n, .. } = *self;
        [position_m, velocity_m_per_s, actuator_force_n, hand_force_n, wall_force_n]
    }
}

registry::environments! {
    /// A one-sided spring-damper.
    wall: Wall(WallParameters),
    /// A two-sided spring-damper, always attached.
    spring: Spring(SpringParameters),
}
