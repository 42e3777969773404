//! What is between a controller's force and the world: joints, arms, drives, and what holds and stops them.
//!
//! A rigid [`Joint`] takes exact steps; a machine whose axes move each other is a file here that says
//! its equations of motion, a [`Mechanism`], and [`Coupled`] moves it. A plant of another kind is a file that implements
//! [`Plant`], and a variant of `Body` in `response/body.rs`.

mod arm;
mod cia402;
mod coupled;
mod drive_bus;
mod joint;
mod joints;
mod moteus;
mod parameter;
mod phantom;
mod repetition;
mod sensor;
mod transition;

pub use arm::{Arm, ArmParameters, Chain, LinkKind, LinkParameters};
pub use cia402::Cia402Drive;
pub use coupled::{Axes, Coupled, CoupledAxisState, Dynamics, Matrix, Mechanism, Tip};
pub use drive_bus::{Absence, Cia402Parameters, DriveBus, FoundFault, MoteusParameters};
pub use joint::{
    BridgeMotor, BridgeState, BrushedParameters, FlexibleParameters, FrictionParameters, GearParameters,
    Joint, JointEnergy, JointMotorParameters, JointParameters, JointState, LoadParameters, StopsParameters,
    ThermalParameters, ThreePhaseParameters,
};
pub use joints::{Joints, Push};
pub use moteus::MoteusDrive;
pub use parameter::ParameterError;
pub use phantom::{Linkage, LinkageParameters, Phantom, PhantomParameters, PhantomPort};
pub use repetition::{PEAK_SPEED, Repetition, minimum_jerk};
pub use sensor::{Sensor, SensorParameters};

/// Sub-steps of a held command, at least, where something may happen in them.
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
    fn quantities(&self, axis: usize) -> &'static [(&'static str, &'static str)];

    /// Puts what [is known](Self::quantities) of an axis now into `values`.
    fn look(&self, axis: usize, values: &mut [f64]);
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
pub const MAX_QUANTITIES: usize = 9;
