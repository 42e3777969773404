//! What turns the bridge off, in the period in which it shows.

use core::f32::consts::FRAC_PI_2;

use dimsart_core::DriveFault;

use crate::Angle;
use crate::configuration::{Configuration, Inverter, Limits};
use crate::number::{larger, smaller};
use crate::sample::{Rotor, Sample};

/// Share of the trip current that the sum of the phases may be off: converters are not exact, but a dead one shows.
const SENSOR_SHARE: f32 = 0.2;
/// Of an encoder, beside what the fastest rotor turns in two periods, `rad`.
const ENCODER_NOISE_RAD: f32 = 0.01;
/// A reading of an encoder that is missing or wrong counts so much, a right one takes one back: two in a row are bridged by
/// the speed, and one in three for ever.
const BAD_READING: u8 = 2;
const MOST_BAD: u8 = 4;
/// Coldest that it can be, `°C`: a sensor whose wire is open says less.
const COLDEST_C: f32 = -40.0;
/// Share of the square of the largest current that a winding at rest loses by and by.
const COOLED_SHARE: f32 = 0.25;
/// Below this share of the fastest speed the encoder reports standstill.
const STANDSTILL_SHARE: f32 = 0.01;
/// Tolerance of the d-axis voltage as a share of the supply, beside the dead time: phase resistances differ by some percent.
const UNEXPECTED_SHARE: f32 = 0.01;
/// Its tolerance as a share of the magnets' voltage: a healthy angle is wrong by 12° at most, where `ψ` is 1.43 times as configured.
const EMF_SHARE: f32 = 0.35;
/// Its tolerance as a share of the voltage that couples the axes: `L` is 1.43 times as configured.
const COUPLING_SHARE: f32 = 0.45;
/// So much longer than not it has to make more, `s`: longer than the current takes to change.
const TURNING_UNSEEN_S: f32 = 0.005;
/// Change of the current within two periods, of the limit of the current, above which it oscillates.
const OSCILLATION_SHARE: f32 = 0.2;

/// Watches a drive.
#[derive(Debug, Clone)]
pub struct Protection {
    limits: Limits,
    /// Two periods: the checks of motion and of the encoder's alignment take turns.
    check_s: f32,
    most_sum_a: f32,
    most_surprise_rad: f32,
    standstill_rad_per_s: f32,
    /// Most current that may be asked for, per degree below the trip temperature.
    derating_a_per_c: f32,
    /// Of the square of a current, and what a winding loses: so that all of the current takes the time that it may.
    stall_per_a2: f32,
    cooled: f32,
    /// A quarter of an electrical turn.
    held_rad: f32,
    /// Where the rotor is held, as long as it stays near.
    held_at: Angle,
    unexpected_share: f32,
    emf_vs: f32,
    coupling_h: f32,
    unseen_periods: i32,
    most_unseen_periods: i32,
    last_a: f32,
    most_change_a: f32,
    unstable_periods: i32,
    bad_readings: u8,
    stalled_s: f32,
    fault: Option<DriveFault>,
}

impl Protection {
    /// With the limits of a configuration that is [right](Configuration::check).
    #[inline]
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "a cast saturates")]
    pub fn new(configuration: &Configuration) -> Self {
        let Configuration { motor, limits, inverter, .. } = *configuration;
        let Inverter { period_s, dead_time_share, .. } = inverter;
        Self {
            limits,
            check_s: 2.0 * period_s,
            most_sum_a: SENSOR_SHARE * limits.trip_current_a,
            most_surprise_rad: 2.0 * limits.speed_rad_per_s * period_s + ENCODER_NOISE_RAD,
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
            most_unseen_periods: (TURNING_UNSEEN_S / period_s) as i32,
            last_a: 0.0,
            most_change_a: OSCILLATION_SHARE * limits.current_a,
            unstable_periods: 0,
            bad_readings: 0,
            stalled_s: 0.0,
            fault: None,
        }
    }

    /// Why the bridge is off; none when it may be on.
    #[must_use]
    pub fn fault(&self) -> Option<DriveFault> {
        self.fault
    }

    /// Forgets the fault: what is still wrong is found again in the next period.
    pub fn clear(&mut self) {
        if self.fault.take().is_some() {
            (self.bad_readings, self.unseen_periods, self.unstable_periods) = (0, 0, 0);
        }
    }

    /// Looks at currents, supply and temperature.
    #[inline]
    pub(crate) fn look(&mut self, sample: &Sample) {
        let Limits { trip_current_a, least_bus_v, most_bus_v, trip_c, .. } = self.limits;
        let [u, v, w] = sample.phase_a;
        // What is no number is within nothing.
        let is_within = |value: f32, most: f32| value.abs() <= most;
        let has_current =
            is_within(u, trip_current_a) && is_within(v, trip_current_a) && is_within(w, trip_current_a);
        let found = match sample {
            // A converter at its end, beside two phases that do not add up to as much.
            _ if !has_current && (u + v + w).is_infinite() => DriveFault::CurrentSensors,
            _ if !has_current => DriveFault::Overcurrent,
            _ if !is_within(u + v + w, self.most_sum_a) => DriveFault::CurrentSensors,
            Sample { bus_v, .. } if *bus_v > most_bus_v => DriveFault::Overvoltage,
            Sample { bus_v, .. } if *bus_v >= least_bus_v => {
                match (COLDEST_C..trip_c).contains(&sample.temperature_c) {
                    true => return,
                    false => DriveFault::Overtemperature,
                }
            }
            _ => DriveFault::Undervoltage,
        };
        self.note(found);
    }

    /// Looks at what the encoder says, `surprise_rad` from where the rotor should be; gives that where it can be believed.
    #[inline]
    pub(crate) fn believe(&mut self, rotor: Rotor, surprise_rad: f32) -> Option<f32> {
        let found = match rotor {
            Rotor::At(_) if surprise_rad.abs() <= self.most_surprise_rad => {
                self.bad_readings = self.bad_readings.saturating_sub(1);
                return Some(surprise_rad);
            }
            Rotor::At(_) => DriveFault::EncoderJumped,
            Rotor::Awaited => return None,
            Rotor::Lost => DriveFault::EncoderLost,
            Rotor::BadMagnet => DriveFault::EncoderMagnet,
        };
        self.bad_readings = self.bad_readings.saturating_add(BAD_READING);
        if self.has_lost_rotor() {
            self.note(found);
        }
        None
    }

    /// Whether too many readings were missing or wrong to go by the speed: where the rotor is has to be found anew.
    #[inline]
    pub(crate) fn has_lost_rotor(&self) -> bool {
        self.bad_readings > MOST_BAD
    }

    /// Looks at the speed, which the supply can hold against up to `held_rad_per_s`, and how long the rotor is held under a current
    /// that makes torque: within a quarter of an electrical turn, trembling or not. Beyond that another phase warms up, and half of
    /// the time is taken back. In every second period.
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
        if angle.minus(self.held_at).rad().abs() > self.held_rad {
            self.held_at = angle;
            self.stalled_s *= 0.5;
        }
    }

    /// Looks whether the current that makes torque oscillates: where the motor has a fraction of the configured inductance, the
    /// current controller is unstable. It follows a step of the reference in a few periods. In every second period.
    #[inline]
    pub(crate) fn watch(&mut self, current_a: f32) {
        let change_a = current_a - self.last_a;
        self.last_a = current_a;
        let is_large = change_a.abs() > self.most_change_a;
        // A reference that steps in every tick makes large changes in half of the checks.
        self.unstable_periods = (self.unstable_periods + if is_large { 2 } else { -4 }).max(0);
        if self.unstable_periods > self.most_unseen_periods {
            self.note(DriveFault::CurrentLoop);
        }
    }

    /// Looks whether the encoder's angle is that of the magnets, by the voltage that the motor makes unexpectedly along d: a wrong
    /// angle has the magnets' voltage there. Where the encoder is gone the field stands, and the rotor slips past it or swings
    /// about it. In every second period.
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
        if self.unseen_periods > self.most_unseen_periods {
            let stands = speed_rad_per_s <= self.standstill_rad_per_s;
            self.note(if stands { DriveFault::EncoderLost } else { DriveFault::EncoderSlipped });
        }
    }

    /// The most current that may be asked for at a temperature below the trip temperature, `A`.
    #[inline]
    pub(crate) fn current_limit_a(&self, temperature_c: f32) -> f32 {
        let Limits { current_a, trip_c, .. } = self.limits;
        smaller(self.derating_a_per_c * (trip_c - temperature_c), current_a)
    }

    fn note(&mut self, fault: DriveFault) {
        self.fault.get_or_insert(fault);
    }
}
