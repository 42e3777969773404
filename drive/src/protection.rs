//! Protection: turns the bridge off in the period in which a fault is detected.

use core::f32::consts::FRAC_PI_2;

use dimsart_core::DriveFault;

use crate::Angle;
use crate::configuration::{Configuration, Inverter, Limits};
use crate::number::{larger, smaller};
use crate::sample::{Rotor, Sample};

/// Tolerance of the phase current sum, as a share of the trip current: allows converter errors, detects a dead converter.
const SENSOR_SHARE: f32 = 0.2;
/// Encoder noise added to the travel at maximum speed in two periods, `rad`.
const ENCODER_NOISE_RAD: f32 = 0.01;
/// Count of a missing or invalid encoder reading; a valid one subtracts 1. Two in a row, or one in three permanently,
/// are bridged by extrapolation.
const BAD_READING: u8 = 2;
const MAX_BAD: u8 = 4;
/// Minimum plausible temperature, `°C`: an open sensor reads lower.
const COLDEST_C: f32 = -40.0;
/// Heat that a winding at standstill dissipates, as a share of the square of the maximum current.
const COOLED_SHARE: f32 = 0.25;
/// Share of the maximum speed below which the encoder reports standstill.
const STANDSTILL_SHARE: f32 = 0.01;
/// Tolerance of the d-axis voltage as a share of the supply, in addition to dead time: phase resistances differ by a
/// few percent.
const UNEXPECTED_SHARE: f32 = 0.01;
/// Tolerance as a share of the back-EMF: a correct angle is off by at most 12°, with `ψ` 1.43 times its configured value.
const EMF_SHARE: f32 = 0.35;
/// Tolerance as a share of the coupling voltage: `L` 1.43 times its configured value.
const COUPLING_SHARE: f32 = 0.45;
/// Excess time of an unexpected voltage until the fault, `s`: longer than current transients.
const TURNING_UNSEEN_S: f32 = 0.005;
/// Current change within two periods above which the current oscillates, as a share of the current limit.
const OSCILLATION_SHARE: f32 = 0.2;

/// Protection of a drive.
#[derive(Debug, Clone)]
pub struct Protection {
    limits: Limits,
    /// Two periods: the checks of motion and of the encoder's alignment alternate.
    check_s: f32,
    max_sum_a: f32,
    max_surprise_rad: f32,
    standstill_rad_per_s: f32,
    /// Current limit per degree below the trip temperature.
    derating_a_per_c: f32,
    /// Factor of the squared current in the stall timer, scaled so that full current takes `stall_s`.
    stall_per_a2: f32,
    cooled: f32,
    /// A quarter of an electrical turn.
    held_rad: f32,
    /// Angle near which the rotor is held.
    held_at: Angle,
    unexpected_share: f32,
    emf_vs: f32,
    coupling_h: f32,
    unseen_periods: i32,
    max_unseen_periods: i32,
    last_a: f32,
    max_change_a: f32,
    unstable_periods: i32,
    bad_readings: u8,
    stalled_s: f32,
    fault: Option<DriveFault>,
}

impl Protection {
    /// Creates the protection of a [valid](Configuration::check) configuration.
    #[inline]
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "a cast saturates")]
    pub fn new(configuration: &Configuration) -> Self {
        let Configuration { motor, limits, inverter, .. } = *configuration;
        let Inverter { period_s, dead_time_share, .. } = inverter;
        Self {
            limits,
            check_s: 2.0 * period_s,
            max_sum_a: SENSOR_SHARE * limits.trip_current_a,
            max_surprise_rad: 2.0 * limits.speed_rad_per_s * period_s + ENCODER_NOISE_RAD,
            standstill_rad_per_s: STANDSTILL_SHARE * limits.speed_rad_per_s,
            derating_a_per_c: limits.current_a / (limits.trip_c - limits.derating_c),
            stall_per_a2: 1.0 / (limits.current_a * limits.current_a * (1.0 - COOLED_SHARE)),
            cooled: COOLED_SHARE / (1.0 - COOLED_SHARE),
            held_rad: FRAC_PI_2 / f32::from(motor.pole_pairs),
            held_at: Angle(0),
            unexpected_share: UNEXPECTED_SHARE + dead_time_share,
            emf_vs: EMF_SHARE * motor.flux_linkage_vs,
            coupling_h: COUPLING_SHARE * motor.quadrature_inductance_h,
            unseen_periods: 0,
            max_unseen_periods: (TURNING_UNSEEN_S / period_s) as i32,
            last_a: 0.0,
            max_change_a: OSCILLATION_SHARE * limits.current_a,
            unstable_periods: 0,
            bad_readings: 0,
            stalled_s: 0.0,
            fault: None,
        }
    }

    /// Returns the latched fault; `None` if the bridge may be on.
    #[must_use]
    pub fn fault(&self) -> Option<DriveFault> {
        self.fault
    }

    /// Clears the fault; a persisting one is detected again in the next period.
    pub fn clear(&mut self) {
        if self.fault.take().is_some() {
            (self.bad_readings, self.unseen_periods, self.unstable_periods) = (0, 0, 0);
        }
    }

    /// Checks currents, supply voltage and temperature.
    #[inline]
    pub(crate) fn look(&mut self, sample: &Sample) {
        let Limits { trip_current_a, min_bus_v, max_bus_v, trip_c, .. } = self.limits;
        let [u, v, w] = sample.phase_a;
        // NaN fails every comparison.
        let is_within = |value: f32, most: f32| value.abs() <= most;
        let has_current =
            is_within(u, trip_current_a) && is_within(v, trip_current_a) && is_within(w, trip_current_a);
        let found = match sample {
            // A saturated converter: the other two phases do not balance it.
            _ if !has_current && (u + v + w).is_infinite() => DriveFault::CurrentSensors,
            _ if !has_current => DriveFault::Overcurrent,
            _ if !is_within(u + v + w, self.max_sum_a) => DriveFault::CurrentSensors,
            Sample { bus_v, .. } if *bus_v > max_bus_v => DriveFault::Overvoltage,
            Sample { bus_v, .. } if *bus_v >= min_bus_v => {
                match (COLDEST_C..trip_c).contains(&sample.temperature_c) {
                    true => return,
                    false => DriveFault::Overtemperature,
                }
            }
            _ => DriveFault::Undervoltage,
        };
        self.note(found);
    }

    /// Checks an encoder reading that differs from the prediction by `prediction_error_rad`; returns it if plausible.
    #[inline]
    pub(crate) fn believe(&mut self, rotor: Rotor, prediction_error_rad: f32) -> Option<f32> {
        let found = match rotor {
            Rotor::Angle(_) if prediction_error_rad.abs() <= self.max_surprise_rad => {
                self.bad_readings = self.bad_readings.saturating_sub(1);
                return Some(prediction_error_rad);
            }
            Rotor::Angle(_) => DriveFault::EncoderJumped,
            Rotor::NotSampled => return None,
            Rotor::Lost => DriveFault::EncoderLost,
            Rotor::BadMagnet => DriveFault::EncoderMagnet,
        };
        self.bad_readings = self.bad_readings.saturating_add(BAD_READING);
        if self.has_lost_rotor() {
            self.note(found);
        }
        None
    }

    /// Checks whether too many readings were missing or invalid to extrapolate: the observer must be reinitialised.
    #[inline]
    pub(crate) fn has_lost_rotor(&self) -> bool {
        self.bad_readings > MAX_BAD
    }

    /// Checks overspeed and stall. The speed limit is the lower of the configured one and `held_rad_per_s`, up to which
    /// the supply controls the current. The rotor is stalled while it stays within a quarter of an electrical turn
    /// under q-axis current; beyond, another phase heats up and the stall time is halved. Called every second period.
    #[inline]
    pub(crate) fn weigh(&mut self, current_a: f32, angle: Angle, speed_rad_per_s: f32, held_rad_per_s: f32) {
        if speed_rad_per_s.abs() > smaller(self.limits.speed_rad_per_s, held_rad_per_s) {
            self.note(DriveFault::Overspeed);
        }
        let heated = current_a * current_a * self.stall_per_a2;
        self.stalled_s = larger(self.stalled_s + self.check_s * (heated - self.cooled), 0.0);
        if self.stalled_s > self.limits.stall_s {
            self.note(DriveFault::Stalled);
        }
        if angle.wrapping_sub(self.held_at).to_rad().abs() > self.held_rad {
            self.held_at = angle;
            self.stalled_s *= 0.5;
        }
    }

    /// Checks for oscillation of the q-axis current: the current controller is unstable if the motor has a fraction of
    /// the configured inductance. A step of the reference settles in a few periods. Called every second period.
    #[inline]
    pub(crate) fn watch(&mut self, current_a: f32) {
        let change_a = current_a - self.last_a;
        self.last_a = current_a;
        let is_large = change_a.abs() > self.max_change_a;
        // A reference that steps in every tick causes large changes in half of the checks.
        self.unstable_periods = (self.unstable_periods + if is_large { 2 } else { -4 }).max(0);
        if self.unstable_periods > self.max_unseen_periods {
            self.note(DriveFault::CurrentLoop);
        }
    }

    /// Checks the encoder's alignment by the unexpected d-axis voltage: at a wrong angle, the back-EMF has a d
    /// component. If the encoder reports standstill, the field is fixed while the rotor slips or oscillates about it.
    /// Called every second period.
    #[inline]
    pub(crate) fn feel(
        &mut self,
        unexpected_v: f32,
        current_a: f32,
        speed_rad_per_s: f32,
        pole_pairs: f32,
        bus_v: f32,
    ) {
        let speed_rad_per_s = speed_rad_per_s.abs();
        let tolerance_v = self.unexpected_share * bus_v
            + pole_pairs * speed_rad_per_s * (self.emf_vs + self.coupling_h * current_a.abs());
        let is_wrong = unexpected_v.abs() > tolerance_v;
        self.unseen_periods = (self.unseen_periods + if is_wrong { 2 } else { -1 }).max(0);
        if self.unseen_periods > self.max_unseen_periods {
            let stands = speed_rad_per_s <= self.standstill_rad_per_s;
            self.note(if stands { DriveFault::EncoderLost } else { DriveFault::EncoderSlipped });
        }
    }

    /// Returns the current limit at a temperature below the trip temperature, `A`.
    #[inline]
    pub(crate) fn current_limit_a(&self, temperature_c: f32) -> f32 {
        let Limits { current_a, trip_c, .. } = self.limits;
        smaller(self.derating_a_per_c * (trip_c - temperature_c), current_a)
    }

    fn note(&mut self, fault: DriveFault) {
        self.fault.get_or_insert(fault);
    }
}
