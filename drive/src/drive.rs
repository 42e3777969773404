//! One period of a drive.

use dimsart_core::math::limit;

use crate::Angle;
use crate::configuration::{Configuration, ConfigurationError};
use crate::current_controller::CurrentController;
use crate::modulation::{Duties, duties, radius_v};
use crate::protection::{Fault, Protection};
use crate::sample::{Rotor, Sample};
use crate::tracking::Tracking;
use crate::vector::{Dq, Stator, Turn};

/// Poles of the observer of angle and speed, `rad/s`.
const TRACKING_RAD_PER_S: f32 = 2_000.0;
/// From a sample to the middle of the period that its voltage is made in: the one after it.
const PERIODS_TO_VOLTAGE: f32 = 1.5;

/// A motor, its inverter and its encoder, under control.
#[derive(Debug, Clone)]
pub struct Drive {
    configuration: Configuration,
    /// Of the encoder where the magnets point along phase U.
    offset: Angle,
    /// `A/(N m)`.
    current_per_torque: f32,
    tracking: Tracking,
    controller: CurrentController,
    protection: Protection,
    measured: Measured,
    /// Whether the encoder has said anything yet.
    has_begun: bool,
}

/// What a drive knows of its motor, as of the last period.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Measured {
    /// Of the rotor, from the encoder's own zero, once around.
    pub angle: Angle,
    /// Of the rotor, `rad/s`.
    pub speed_rad_per_s: f32,
    /// In the rotor's frame, `A`.
    pub current_a: Dq,
    /// By these currents, `N m`.
    pub torque_nm: f32,
    /// Most current that may be asked for, at this temperature, `A`.
    pub current_limit_a: f32,
    /// What the last period's voltage is of what the supply can make, 0 to 1.
    pub voltage_share: f32,
}

impl Drive {
    /// A drive that is off.
    ///
    /// # Errors
    /// [`ConfigurationError`] with the first value outside its range.
    pub fn new(configuration: &Configuration) -> Result<Self, ConfigurationError> {
        configuration.check()?;
        let motor = &configuration.motor;
        Ok(Self {
            configuration: *configuration,
            offset: Angle::from_rad(motor.encoder_offset_rad),
            current_per_torque: 1.0 / motor.torque_constant_nm_per_a(),
            tracking: Tracking::new(configuration.period_s, TRACKING_RAD_PER_S),
            controller: CurrentController::new(configuration),
            protection: Protection::new(configuration),
            measured: Measured::default(),
            has_begun: false,
        })
    }

    /// One period: what the converters show, and the torque that is commanded, `N m`, or none for a bridge that is off. Gives
    /// the duty cycles for the next period, or none: then all six switches are to be opened at once.
    ///
    /// A torque that is no number is none.
    pub fn step(&mut self, sample: &Sample, torque_nm: Option<f32>) -> Option<Duties> {
        self.track(sample.rotor);
        self.protection.look(sample);
        let motor = &self.configuration.motor;
        let electrical = self.tracking.angle().minus(self.offset).times(motor.pole_pairs);
        let speed_rad_per_s = self.tracking.speed_rad_per_s();
        let is_a = Turn::to(electrical).park(Stator::from_phases(sample.phase_a));
        let current_limit_a = self.protection.current_limit_a(sample.temperature_c);
        self.measured = Measured {
            angle: self.tracking.angle(),
            speed_rad_per_s,
            current_a: is_a,
            torque_nm: self.torque_nm(is_a),
            current_limit_a,
            voltage_share: 0.0,
        };
        let commanded_nm = torque_nm.filter(|torque_nm| torque_nm.is_finite());
        let Some(torque_nm) = commanded_nm.filter(|_| self.has_begun && self.fault().is_none()) else {
            self.controller.reset();
            return None;
        };
        let wanted_a = Dq { d: 0.0, q: limit(torque_nm * self.current_per_torque, current_limit_a) };
        self.protection.weigh(wanted_a.q, speed_rad_per_s);
        let electrical_rad_per_s = f32::from(motor.pole_pairs) * speed_rad_per_s;
        let Configuration { period_s, most_duty, .. } = self.configuration;
        let most_v = radius_v(sample.bus_v, most_duty);
        let voltage_v = self.controller.step(wanted_a, is_a, electrical_rad_per_s, most_v);
        self.measured.voltage_share =
            dimsart_core::math::sqrt(voltage_v.d * voltage_v.d + voltage_v.q * voltage_v.q) / most_v;
        // Where the rotor will be while the voltage is made.
        let ahead = Turn::to(electrical.plus_rad(PERIODS_TO_VOLTAGE * period_s * electrical_rad_per_s));
        let duties =
            duties(ahead.unpark(voltage_v), ahead.unpark(wanted_a), sample.bus_v, &self.configuration);
        Some(duties)
    }

    /// What it knows of its motor.
    #[must_use]
    pub fn measured(&self) -> Measured {
        self.measured
    }

    /// Why the bridge is off; none when it may be on.
    #[must_use]
    pub fn fault(&self) -> Option<Fault> {
        self.protection.fault()
    }

    /// Forgets a fault: what is still wrong is found again in the next period.
    pub fn clear(&mut self) {
        self.protection.clear();
        self.has_begun = false;
    }

    fn track(&mut self, rotor: Rotor) {
        let surprise_rad = match rotor {
            Rotor::At(angle) if !self.has_begun => {
                self.tracking.begin(angle);
                self.has_begun = true;
                0.0
            }
            Rotor::At(angle) => self.tracking.surprise_rad(angle),
            Rotor::Lost | Rotor::BadMagnet => 0.0,
        };
        let believed_rad = self.protection.believe(rotor, surprise_rad).unwrap_or(0.0);
        self.tracking.step(believed_rad);
    }

    /// `3/2 p (ψ i_q + (L_d - L_q) i_d i_q)`.
    fn torque_nm(&self, Dq { d, q }: Dq) -> f32 {
        let motor = &self.configuration.motor;
        let saliency_h = motor.direct_inductance_h - motor.quadrature_inductance_h;
        1.5 * f32::from(motor.pole_pairs) * (motor.flux_linkage_vs + saliency_h * d) * q
    }
}
