//! The PHANToM Premium 1.5: three axes, Cartesian forces at its tip.
//!
//! Its [linkage] is from Cavusoglu, Feygin and Tendick (2002). Motors, gears, friction and joint limits are not in
//! their equations; the defaults are from another public description, based on drawings. The two differ by 3 % in
//! lengths, which limits the accuracy of friction and limits.
//!
//! The controller commands forces at the tip. Motor torques are `Jᵀ F`, with the Jacobian at the time of the command;
//! between commands the torques are constant, not the force.

mod linkage;
#[cfg(test)]
mod tests;

pub use linkage::{Linkage, LinkageParameters};

use super::coupled::{Actuator, AxisValues, Coupled, CoupledAxisState, Stop, Tip, transposed};
use super::joint::{JointEnergy, StopsParameters};
use super::parameter::{ParameterError, finite, not_negative, positive, positive_or_infinite};
use dimsart_core::limits::MAX_DOF;
use serde::{Deserialize, Serialize};

/// Type of command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum PhantomPort {
    /// Force at the tip: x forward, y left, z up, `N`.
    #[default]
    Cartesian,
    /// Torques of the three axes, `N m`.
    Joint,
    /// Torques of the three axes, `N m`, with the hand at the tip.
    HeldAtTip,
}

impl PhantomPort {
    /// Whether external forces act at the tip.
    #[must_use]
    pub fn is_held_at_tip(self) -> bool {
        self != Self::Joint
    }
}

/// Parameters of a PHANToM.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct PhantomParameters {
    /// Type of command.
    pub port: PhantomPort,
    /// Bodies and lengths.
    pub linkage: LinkageParameters,
    /// Start position, `rad`.
    pub start_position_rad: [f64; 3],
    /// Gear ratios, motor to joint, > 0.
    pub gear_ratio: [f64; 3],
    /// Rotor inertia of each motor, `kg m²`, >= 0.
    pub rotor_inertia_kg_m2: f64,
    /// Maximum torque of each motor, `N m` at the motor, > 0; `inf`: unlimited.
    pub motor_limit_nm: f64,
    /// Viscous friction of each joint, `N m s/rad`, >= 0.
    pub viscous_nms_per_rad: f64,
    /// Coulomb friction of each joint, `N m`, >= 0.
    pub coulomb_nm: f64,
    /// Lower end of each axis, `rad`; `-inf` for none.
    pub min_rad: [f64; 3],
    /// Upper end of each axis, `rad`; `inf` for none.
    pub max_rad: [f64; 3],
    /// Minimum of axis 1 minus axis 2, `rad`, with the elbow folded; negative; `-inf`: no stop.
    pub elbow_min_rad: f64,
    /// Maximum of axis 1 minus axis 2, `rad`, with the elbow stretched; `inf`: no stop.
    pub elbow_max_rad: f64,
    /// Stiffness of each stop, `N m/rad`, > 0.
    pub stop_stiffness_nm_per_rad: f64,
    /// Damping of each stop, `N m s/rad`, >= 0.
    pub stop_damping_nms_per_rad: f64,
}

impl Default for PhantomParameters {
    /// The device as published. The stop parameters are unpublished: 50 N m/rad and 0.3 N m s/rad are assumed.
    fn default() -> Self {
        Self {
            port: PhantomPort::default(),
            linkage: LinkageParameters::default(),
            start_position_rad: [0.0; 3],
            gear_ratio: [13.3, 11.2, 11.2],
            rotor_inertia_kg_m2: 1.08e-6,
            motor_limit_nm: 0.129,
            viscous_nms_per_rad: 5e-4,
            coulomb_nm: 0.01,
            min_rad: [-90.0, -124.0, -29.0].map(f64::to_radians),
            max_rad: [90.0, 119.0, 214.0].map(f64::to_radians),
            elbow_min_rad: -55_f64.to_radians(),
            elbow_max_rad: 65_f64.to_radians(),
            stop_stiffness_nm_per_rad: 50.0,
            stop_damping_nms_per_rad: 0.3,
        }
    }
}

impl PhantomParameters {
    /// Returns the device without Coulomb friction and stops. Motor limits and the coupled dynamics remain.
    #[must_use]
    pub fn linear(&self) -> Self {
        let (min, max) = (f64::NEG_INFINITY, f64::INFINITY);
        Self {
            coulomb_nm: 0.0,
            min_rad: [min; 3],
            max_rad: [max; 3],
            elbow_min_rad: min,
            elbow_max_rad: max,
            ..self.clone()
        }
    }

    /// Returns the linkage alone, as in the paper: also without damping, rotors and motor limits.
    #[must_use]
    pub fn ideal(&self) -> Self {
        Self {
            rotor_inertia_kg_m2: 0.0,
            motor_limit_nm: f64::INFINITY,
            viscous_nms_per_rad: 0.0,
            ..self.linear()
        }
    }

    /// Maximum motor torque at an axis, `N m`; `None` if commands are forces at the tip.
    #[must_use]
    pub fn max_force(&self, axis: usize) -> Option<f64> {
        let is_torque = self.port != PhantomPort::Cartesian;
        let gear_ratio = self.gear_ratio.get(axis).filter(|_| is_torque);
        gear_ratio.map(|gear_ratio| gear_ratio * self.motor_limit_nm)
    }

    /// Checks whether the device is physically possible and can be simulated.
    ///
    /// # Errors
    /// The first parameter out of range, or the parameter that requires too many sub-steps at the start.
    pub fn check(&self) -> Result<(), ParameterError> {
        self.build().map(drop)
    }

    /// Builds the device, at rest at its start position.
    ///
    /// # Errors
    /// As [`check`](Self::check).
    pub fn build(&self) -> Result<Phantom, ParameterError> {
        self.linkage.check().map_err(|error| error.with_path_prefix("linkage"))?;
        not_negative("rotor_inertia_kg_m2", self.rotor_inertia_kg_m2)?;
        positive_or_infinite("motor_limit_nm", self.motor_limit_nm)?;
        not_negative("viscous_nms_per_rad", self.viscous_nms_per_rad)?;
        not_negative("coulomb_nm", self.coulomb_nm)?;
        let mut actuators = Vec::new();
        for (axis, (&gear_ratio, &start_position)) in
            self.gear_ratio.iter().zip(&self.start_position_rad).enumerate()
        {
            positive(&format!("gear_ratio[{axis}]"), gear_ratio)?;
            finite(&format!("start_position_rad[{axis}]"), start_position)?;
            actuators.push(Actuator {
                viscous_path: "viscous_nms_per_rad".to_owned(),
                inertia: gear_ratio * gear_ratio * self.rotor_inertia_kg_m2,
                viscous: self.viscous_nms_per_rad,
                coulomb: self.coulomb_nm,
                effort_limit: gear_ratio * self.motor_limit_nm,
                start_position,
            });
        }
        let body = Coupled::new(Linkage::of(&self.linkage), actuators, self.stops()?)?;
        Ok(Phantom { port: self.port, body })
    }

    /// Stops of each axis and of the elbow.
    fn stops(&self) -> Result<Vec<Stop>, ParameterError> {
        positive("stop_stiffness_nm_per_rad", self.stop_stiffness_nm_per_rad)?;
        not_negative("stop_damping_nms_per_rad", self.stop_damping_nms_per_rad)?;
        let mut stops = Vec::new();
        for (axis, (&min, &max)) in self.min_rad.iter().zip(&self.max_rad).enumerate() {
            let paths = [format!("min_rad[{axis}]"), format!("max_rad[{axis}]")];
            let direction = core::array::from_fn(|other| if other == axis { 1.0 } else { 0.0 });
            stops.extend(self.stop(&paths, direction, min, max)?);
        }
        let mut across = [0.0; MAX_DOF];
        for (share, of_axis) in across.iter_mut().zip([0.0, 1.0, -1.0]) {
            *share = of_axis;
        }
        let paths = ["elbow_min_rad", "elbow_max_rad"].map(str::to_owned);
        stops.extend(self.stop(&paths, across, self.elbow_min_rad, self.elbow_max_rad)?);
        Ok(stops)
    }

    /// `None` without stops.
    fn stop(
        &self,
        [min_path, max_path]: &[String; 2],
        direction: AxisValues,
        min: f64,
        max: f64,
    ) -> Result<Option<Stop>, ParameterError> {
        let ends = StopsParameters {
            min,
            max,
            stiffness: self.stop_stiffness_nm_per_rad,
            damping: self.stop_damping_nms_per_rad,
        };
        ends.check().map_err(|error| {
            let path = if error.path == "min" { min_path } else { max_path };
            ParameterError { path: path.clone(), ..error }
        })?;
        let stop = Stop {
            stiffness_path: "stop_stiffness_nm_per_rad".to_owned(),
            damping_path: "stop_damping_nms_per_rad".to_owned(),
            direction,
            ends,
        };
        Ok((min.is_finite() || max.is_finite()).then_some(stop))
    }
}

/// Simulation of a PHANToM.
#[derive(Debug)]
pub struct Phantom {
    port: PhantomPort,
    body: Coupled<Linkage>,
}

impl Phantom {
    /// Applies the constant torques of `command` (of its [port](PhantomPort); missing entries are 0, surplus is
    /// ignored) from `start_s` for `period_s` with the external force `push` on the tip, `N`.
    ///
    /// NaN and infinite commands are applied unchanged within the motors' limits.
    pub fn advance(&mut self, start_s: f64, period_s: f64, command: &[f32], push: &dyn Fn(&Tip) -> [f64; 3]) {
        let mut wanted = [0.0; 3];
        for (wanted, command) in wanted.iter_mut().zip(command) {
            *wanted = f64::from(*command);
        }
        self.advance_at_tip(start_s, period_s, wanted, push);
    }

    /// Like `advance`, with external axis torques that can depend on time, positions and velocities (`Jᵀ F` of a
    /// force at the tip).
    pub(crate) fn advance_under(
        &mut self,
        start_s: f64,
        period_s: f64,
        wanted: [f64; 3],
        outside: &dyn Fn(f64, &AxisValues, &AxisValues) -> AxisValues,
    ) {
        let torques_nm = self.torques(wanted);
        self.body.advance_under(start_s, period_s, torques_nm, outside);
    }

    /// [`advance`](Self::advance) with an `f64` command.
    pub(crate) fn advance_at_tip(
        &mut self,
        start_s: f64,
        period_s: f64,
        wanted: [f64; 3],
        push: &dyn Fn(&Tip) -> [f64; 3],
    ) {
        let torques_nm = self.torques(wanted);
        self.body.advance_pushed_by(start_s, period_s, torques_nm, push);
    }

    /// Motor torques at the joints for a command of its port, `N m`.
    fn torques(&self, wanted: [f64; 3]) -> AxisValues {
        match self.port {
            PhantomPort::Cartesian => transposed(&self.body.tip_jacobian(self.body.positions()), &wanted),
            PhantomPort::Joint | PhantomPort::HeldAtTip => self.body.axes_of(&wanted),
        }
    }

    /// Type of command.
    #[must_use]
    pub fn port(&self) -> PhantomPort {
        self.port
    }

    /// Returns position and velocity of the tip at `time_s`.
    #[must_use]
    pub fn tip(&self, time_s: f64) -> Tip {
        self.body.tip(time_s)
    }

    /// Returns the true state of an axis: `rad`, `rad/s`, `N m`.
    #[must_use]
    pub fn axis(&self, axis: usize) -> CoupledAxisState {
        self.body.axis(axis)
    }

    /// Returns its energies.
    #[must_use]
    pub fn energy(&self) -> JointEnergy {
        self.body.energy()
    }

    /// Returns mass matrix, bias, gravity, kinematics.
    #[must_use]
    pub fn dynamics(&self) -> &Coupled<Linkage> {
        &self.body
    }

    pub(crate) fn body_mut(&mut self) -> &mut Coupled<Linkage> {
        &mut self.body
    }

    /// Sets angles and speeds of the axes, `rad` and `rad/s`.
    pub fn set_state(&mut self, positions_rad: &[f64; 3], velocities_rad_per_s: &[f64; 3]) {
        self.body.set_state(positions_rad, velocities_rad_per_s);
    }
}
