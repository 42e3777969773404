//! Plants: joints, arms, drives, and the stops and hands on them.
//!
//! A rigid [`Joint`] is integrated exactly. A machine with coupled axes implements [`Mechanism`] (its equations of
//! motion) in a file here and is integrated by [`Coupled`]. Any other plant implements [`Plant`] and is a variant of
//! `Body` in `response/body.rs`.

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
pub use coupled::{AxisValues, Coupled, CoupledAxisState, Dynamics, Matrix, Mechanism, Tip};
pub use drive_bus::{Absence, Cia402Parameters, DriveBus, InjectedFault, MoteusParameters};
pub use joint::{
    BridgeMotor, BridgeState, BrushedParameters, FlexibleParameters, FrictionParameters, GearParameters,
    Joint, JointEnergy, JointMotorParameters, JointParameters, JointState, LoadParameters, StopsParameters,
    ThermalParameters, ThreePhaseParameters,
};
pub use joints::{ExternalForce, Joints};
pub use moteus::MoteusDrive;
pub use parameter::ParameterError;
pub(crate) use parameter::valid_axes;
pub use phantom::{Linkage, LinkageParameters, Phantom, PhantomParameters, PhantomPort};
pub use repetition::{PEAK_SPEED, Repetition, minimum_jerk};
pub use sensor::{Sensor, SensorParameters};

/// Minimum sub-steps of a constant command if an event is possible.
pub const SUB_STEPS_MIN: u32 = 20;

/// A plant with sensors and actuators that a controller can be connected to.
///
/// Deterministic: equal calls give bit-identical results. Never reads a clock.
pub trait Plant: core::fmt::Debug + Send {
    /// Returns the number of axes.
    fn dof(&self) -> usize;

    /// Reads its sensors in the order of the device's frame: all positions first, `m` or `rad`. Fills one entry per
    /// sensor and leaves the rest unchanged.
    fn sense(&mut self, measured: &mut [f32]);

    /// Applies the constant `command` (`N` or `N m`, one per axis; missing entries are 0, surplus is ignored) from
    /// `start_s` for `period_s`, in at least [`SUB_STEPS_MIN`] sub-steps; a period without possible events can be one
    /// exact step.
    ///
    /// NaN and infinite commands are applied unchanged, to expose controller faults: they appear in the plant's
    /// signals, and in its motion unless friction holds the axis.
    fn advance(&mut self, start_s: f64, period_s: f64, command: &[f32]);

    /// Sets before [`advance`](Self::advance) whether its actuators are commanded or off. No effect on a plant whose
    /// actuators cannot be off.
    fn set_enabled(&mut self, _is_on: bool) {}

    /// Sets the time of the experiment that moves its references, loads and hands. No effect without an experiment.
    fn repeat(&mut self, _repetition: Repetition) {}

    /// Sets the intended position of the hand on an axis, `m` or `rad`; `None` returns the hand to the experiment. No
    /// effect without a hand.
    fn hold_hand(&mut self, _axis: usize, _position: Option<f64>) {}

    /// Returns the true position of an axis, `m` or `rad`; NaN for a nonexistent axis.
    fn position(&self, axis: usize) -> f64 {
        let mut values = [f64::NAN; MAX_QUANTITIES];
        self.read_quantities(axis, &mut values);
        let [position, ..] = values;
        position
    }

    /// Adds the state of its actuators, by axis.
    fn add_actuations(&self, _actuations: &mut Vec<Actuation>) {}

    /// Whether an axis is in contact with a wall or a stop.
    fn is_touching(&self, axis: usize) -> bool;

    /// Names and units of the quantities of an axis, in the order of [`read_quantities`](Self::read_quantities).
    fn quantities(&self, axis: usize) -> &'static [(&'static str, &'static str)];

    /// Writes the [quantities](Self::quantities) of an axis to `values`.
    fn read_quantities(&self, axis: usize, values: &mut [f64]);
}

/// State of an actuator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Actuation {
    /// Position, `m` or `rad`.
    pub position: f64,
    /// Force, `N` or `N m`.
    pub force: f64,
    /// Whether the force is constant over a period, as of an ideal source; the force of a motor varies.
    pub is_zero_order_hold: bool,
    /// Whether it moves several directions of the device, as the joints of a device held at its tip.
    pub is_coupled: bool,
}

/// Maximum number of quantities of an axis.
pub const MAX_QUANTITIES: usize = 9;
