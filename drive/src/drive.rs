//! The drive: one step of control and protection per PWM period.

use core::f32::consts::FRAC_PI_4;

use dimsart_core::DriveFault;

use crate::Angle;
use crate::configuration::{
    Configuration, ConfigurationError, Inverter, Motor, PERIODS_TO_VOLTAGE, TRACKING_RAD_PER_S,
    ValidConfiguration,
};
use crate::current_controller::CurrentController;
use crate::modulation::{Duties, Modulation};
use crate::number::{smaller, within};
use crate::protection::Protection;
use crate::sample::{Rotor, Sample};
use crate::tracking::AngleObserver;
use crate::vector::{AlphaBeta, Dq, Rotation};

/// Settling time of the observer; the bridge stays off meanwhile.
const SETTLED_S: f32 = 5.0 / TRACKING_RAD_PER_S;

/// Controller of a motor with its inverter and encoder.
#[derive(Debug, Clone)]
pub struct Drive {
    motor: Motor,
    /// Encoder angle at which the magnets align with phase U.
    offset: Angle,
    /// `A/(N m)`.
    current_per_torque: f32,
    /// Delay from a sample to the middle of the period of its voltage, for the electrical angle: `s` times pole pairs.
    ahead_s: f32,
    /// Age of the encoder angle relative to the currents, `s`.
    encoder_age_s: f32,
    period_s: f32,
    tracking: AngleObserver,
    controller: CurrentController,
    modulation: Modulation,
    protection: Protection,
    current_a: Dq,
    voltage_v: Dq,
    /// Rotor speed per volt of back-EMF.
    speed_per_v: f32,
    /// Whether the bridge was on in the last period.
    is_on: bool,
    /// Whether this period checks the encoder's alignment instead of the motion.
    feels: bool,
    /// Time of valid encoder readings, `s`; `None` before the first.
    seen_s: Option<f32>,
}

/// Measured state of the motor in the last period.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Measured {
    /// Rotor angle from the encoder's zero, within one turn.
    pub angle: Angle,
    /// Rotor speed, `rad/s`.
    pub speed_rad_per_s: f32,
    /// Current in the rotor frame, `A`.
    pub current_a: Dq,
    /// Torque computed from the currents, `N m`.
    pub torque_nm: f32,
    /// Voltage for the next period in the rotor frame, `V`; 0 while the bridge is off.
    pub voltage_v: Dq,
}

impl Drive {
    /// Creates a drive that is off.
    ///
    /// # Errors
    /// Returns [`ConfigurationError`] with the first value out of range.
    pub fn new(configuration: &Configuration) -> Result<Self, ConfigurationError> {
        Ok(Self::from_valid(&configuration.checked()?))
    }

    /// Creates a drive that is off, from a validated configuration.
    #[inline]
    #[must_use]
    pub fn from_valid(configuration: &ValidConfiguration) -> Self {
        let configuration = configuration.get();
        let Configuration { motor, inverter: Inverter { period_s, .. }, .. } = *configuration;
        let pole_pairs = f32::from(motor.pole_pairs);
        Self {
            motor,
            offset: Angle::from_rad(motor.encoder_offset_rad),
            current_per_torque: 1.0 / motor.torque_constant_nm_per_a(),
            ahead_s: PERIODS_TO_VOLTAGE * period_s * pole_pairs,
            encoder_age_s: 0.0,
            period_s,
            tracking: AngleObserver::new(period_s, TRACKING_RAD_PER_S),
            controller: CurrentController::new(configuration),
            modulation: Modulation::new(configuration),
            protection: Protection::new(configuration),
            current_a: Dq::default(),
            voltage_v: Dq::default(),
            speed_per_v: 1.0 / (pole_pairs * motor.flux_linkage_vs),
            is_on: false,
            feels: false,
            seen_s: None,
        }
    }

    /// Sets the age of each encoder angle relative to the currents sampled with it, at most ten periods.
    #[must_use]
    pub fn with_encoder_latency(self, age_s: f32) -> Self {
        Self { encoder_age_s: age_s, ..self }
    }

    /// Sets the encoder angle, after inversion, at which the magnets align with phase U, -π to π. Needed after each
    /// start with an incremental encoder. Call it while the bridge is off.
    pub fn align(&mut self, encoder_offset_rad: f32) {
        self.motor.encoder_offset_rad = encoder_offset_rad;
        self.offset = Angle::from_rad(encoder_offset_rad);
    }

    /// Runs one period with a sample and the commanded torque, `N m`, or `None` to turn the bridge off. Returns the
    /// duty cycles for the next period, or `None`: open all six switches at once.
    ///
    /// A NaN or infinite torque turns the bridge off.
    #[inline]
    pub fn step(&mut self, sample: &Sample, torque_nm: Option<f32>) -> Option<Duties> {
        self.track(sample.rotor);
        self.protection.look(sample);
        let speed_rad_per_s = self.tracking.speed_rad_per_s();
        let electrical = self.angle().wrapping_sub(self.offset).to_electrical(self.motor.pole_pairs);
        let now = Rotation::from_angle(electrical);
        self.current_a = now.park(AlphaBeta::from_phases(sample.phase_a));
        let supply = self.modulation.supply(sample.bus_v);
        // Before settling, a single encoder count is a high speed.
        let has_settled = self.seen_s > Some(SETTLED_S);
        if has_settled {
            self.feels = !self.feels;
            let Dq { d, q } = self.current_a;
            if !self.feels {
                let (angle, held_rad_per_s) = (self.tracking.angle(), supply.max_v * self.speed_per_v);
                self.protection.weigh(q, angle, speed_rad_per_s, held_rad_per_s);
            } else if self.is_on {
                let (unexpected_v, pole_pairs) =
                    (self.controller.d_axis_residual_v(d), f32::from(self.motor.pole_pairs));
                self.protection.watch(q);
                self.protection.feel(unexpected_v, q, speed_rad_per_s, pole_pairs, sample.bus_v);
            }
        }
        let may_be_on = has_settled && self.fault().is_none();
        let Some(torque_nm) = torque_nm.filter(|torque_nm| may_be_on && torque_nm.is_finite()) else {
            self.controller.reset();
            self.voltage_v = Dq::default();
            self.is_on = false;
            // A saturated converter measures no valid current.
            if !self.current_a.q.is_finite() {
                self.current_a = Dq::default();
            }
            return None;
        };
        self.is_on = true;
        let max_a = self.protection.current_limit_a(sample.temperature_c);
        let wanted_a = within(torque_nm * self.current_per_torque, max_a);
        self.voltage_v = self.controller.step(
            Dq { d: 0.0, q: wanted_a },
            self.current_a,
            f32::from(self.motor.pole_pairs) * speed_rad_per_s,
            &supply,
        );
        // Rotor angle while the voltage is applied.
        let ahead = now.advanced_by(within(self.ahead_s * speed_rad_per_s, FRAC_PI_4));
        Some(self.modulation.duties(ahead.unpark(self.voltage_v), ahead.unpark_q(wanted_a), &supply))
    }

    /// Returns the measured state of the motor.
    #[inline(always)]
    #[must_use]
    pub fn measured(&self) -> Measured {
        Measured {
            angle: self.angle(),
            speed_rad_per_s: self.tracking.speed_rad_per_s(),
            current_a: self.current_a,
            torque_nm: self.motor.torque_nm(self.current_a),
            voltage_v: self.voltage_v,
        }
    }

    /// Returns the latched fault; `None` if the bridge may be on.
    #[must_use]
    pub fn fault(&self) -> Option<DriveFault> {
        self.protection.fault()
    }

    /// Clears the fault; a persisting one is detected again in the next period.
    pub fn clear(&mut self) {
        self.protection.clear();
    }

    /// Returns the rotor angle at the time of the current samples.
    #[inline]
    fn angle(&self) -> Angle {
        self.tracking.angle().add_rad(self.encoder_age_s * self.tracking.speed_rad_per_s())
    }

    /// Updates the observer. Two consistent readings initialise angle and speed; an inconsistent reading before the
    /// observer has settled restarts it.
    #[inline]
    fn track(&mut self, rotor: Rotor) {
        let Rotor::Angle(angle) = rotor else {
            // Extrapolate at the last speed.
            let _ = self.protection.believe(rotor, 0.0);
            if self.protection.has_lost_rotor() {
                self.seen_s = None;
            }
            return self.tracking.step(0.0);
        };
        let angle = if self.motor.is_encoder_reversed { Angle(0).wrapping_sub(angle) } else { angle };
        let Some(seen_s) = self.seen_s else {
            self.tracking.begin(angle, 0.0);
            self.seen_s = Some(0.0);
            return;
        };
        match self.protection.believe(rotor, self.tracking.prediction_error_rad(angle)) {
            Some(prediction_error_rad) if seen_s > 0.0 => self.tracking.step(prediction_error_rad),
            Some(moved_rad) => self.tracking.begin(angle, moved_rad),
            None if seen_s > SETTLED_S && !self.protection.has_lost_rotor() => {
                return self.tracking.step(0.0);
            }
            None => {
                self.tracking.begin(angle, 0.0);
                self.seen_s = Some(0.0);
                return;
            }
        }
        self.seen_s = Some(smaller(seen_s + self.period_s, 1.0));
    }
}
