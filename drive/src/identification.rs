//! Identification of motor and encoder with a bounded current: `R`, `L_d`, `L_q`, pole pairs, encoder direction and
//! offset. `ψ` is not identified, because it has no effect at standstill.
//!
//! ```text
//!   Resting   two currents along phase U, the rotor aligns there   R = Δu/Δi: the dead-time error cancels
//!   Shaking   a voltage of alternating sign, twice                 L = u T/Δi along the magnets, and across them
//!   Turning   the current vector rotates slowly and back           pole pairs, direction; offset as the mean of both ways
//! ```
//! The rotor moves to the nearest electrical zero, then by one and a quarter electrical turns and back: the joint must
//! be free to move.

mod resting;
mod shaking;
mod turning;

use dimsart_core::DriveFault;

use crate::configuration::{Configuration, ConfigurationError, ValidConfiguration};
use crate::modulation::{Duties, Modulation};
use crate::number::{larger, within};
use crate::protection::Protection;
use crate::sample::{Rotor, Sample};
use crate::vector::{AlphaBeta, Dq, Rotation};
use resting::{Rest, Resting};
use shaking::{Axis, Shaking};
use turning::Turning;

/// Maximum phase current relative to the requested current.
const MAX_SHARE: f32 = 1.25;

/// Minimum current as a share of the dead-time voltage over `R`, so that no phase exceeds [`MAX_SHARE`] while the
/// current vector rotates. There the dead-time effect is `cos 30°` of the effect along a phase, which carries `cos 30°`
/// of the current: `cos 30° (1 - cos 30°) / (MAX_SHARE - cos 30°)`.
const DEAD_TIME_SHARE: f32 = 0.302;
/// Minimum current relative to `dead_time_current_a`: at half of the requested current, less 5 %, two phases carry half
/// of it and must be above `dead_time_current_a`. Otherwise the dead-time effect is identified as resistance.
const MIN_SHARE: f32 = 4.5;
/// Margin for the back-EMF and for a resistance that is not known yet.
const RESERVE: f32 = 1.5;

/// Identified values.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MotorEstimate {
    /// Phase resistance `R`, `ohm`.
    pub resistance_ohm: f32,
    /// d-axis inductance `L_d`, `H`.
    pub direct_inductance_h: f32,
    /// q-axis inductance `L_q`, `H`.
    pub quadrature_inductance_h: f32,
    /// Number of pole pairs `p`.
    pub pole_pairs: u8,
    /// See [`Motor::is_encoder_reversed`](crate::Motor::is_encoder_reversed).
    pub is_encoder_reversed: bool,
    /// See [`Motor::encoder_offset_rad`](crate::Motor::encoder_offset_rad).
    pub encoder_offset_rad: f32,
}

/// Reason of a failed identification.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum IdentificationError {
    /// The supply voltage is too low for the current.
    SupplyTooLow,
    /// The phase currents do not match the voltage.
    PhaseMismatch,
    /// The current is too small: dead time or back-EMF changes it by more than a quarter.
    TooLittleCurrent {
        /// Recommended current, `A`.
        needed_a: f32,
    },
    /// The rotor did not move.
    DidNotMove,
    /// The travel does not match a whole number of pole pairs.
    Slipped {
        /// Travel per electrical turn, `rad`.
        travel_rad: f32,
    },
    /// A drive fault.
    Fault(DriveFault),
}

impl IdentificationError {
    fn too_little(min_a: f32) -> Self {
        Self::TooLittleCurrent { needed_a: RESERVE * min_a }
    }
}

/// Result of a period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum IdentificationStep {
    /// In progress, with the duty cycles for the next period.
    Running(Duties),
    /// Finished; the bridge must be off. Further steps return the same result.
    Finished(Result<MotorEstimate, IdentificationError>),
}

/// Stage of the identification.
#[derive(Debug, Clone)]
enum Stage {
    Resting(Resting),
    Shaking(Shaking),
    Turning(Turning),
    Over(Result<MotorEstimate, IdentificationError>),
}

/// An identification in progress.
#[derive(Debug, Clone)]
pub struct Identification {
    finds_inductances: bool,
    current_a: f32,
    period_s: f32,
    modulation: Modulation,
    protection: Protection,
    stage: Stage,
    found: MotorEstimate,
    /// Voltage of the current.
    held_v: f32,
}

impl Identification {
    /// Starts an identification with `current_a`, > 0, up to the configured limit. The configured motor is not used.
    ///
    /// # Errors
    /// Returns [`ConfigurationError`] with the first value out of range.
    pub fn new(configuration: &Configuration, current_a: f32) -> Result<Self, ConfigurationError> {
        let checked = configuration.checked()?;
        if !(current_a > 0.0 && current_a <= configuration.limits.current_a) {
            let range = "above 0, up to limits.current_a";
            return Err(ConfigurationError { name: "current_a", value: current_a, range });
        }
        Ok(Self::with_inductances(&checked, current_a))
    }

    /// Starts an identification as [`new`](Self::new), with a validated configuration; clamps the current to its limit.
    #[inline]
    #[must_use]
    pub fn with_inductances(configuration: &ValidConfiguration, current_a: f32) -> Self {
        Self::begin(configuration, current_a, true)
    }

    /// Starts an identification as [`with_inductances`](Self::with_inductances) without the inductances.
    #[inline]
    #[must_use]
    pub fn with_offset_only(configuration: &ValidConfiguration, current_a: f32) -> Self {
        Self::begin(configuration, current_a, false)
    }

    #[inline]
    fn begin(configuration: &ValidConfiguration, current_a: f32, finds_inductances: bool) -> Self {
        let configuration = configuration.get();
        let current_a = within(current_a, configuration.limits.current_a);
        let needed_a = MIN_SHARE * configuration.inverter.dead_time_current_a;
        let period_s = configuration.inverter.period_s;
        Self {
            finds_inductances,
            current_a,
            period_s,
            modulation: Modulation::new(configuration),
            protection: Protection::new(configuration),
            stage: match finds_inductances && current_a < needed_a {
                true => Stage::Over(Err(IdentificationError::TooLittleCurrent { needed_a })),
                false => Stage::Resting(Resting::new(current_a, period_s)),
            },
            found: MotorEstimate::default(),
            held_v: 0.0,
        }
    }

    /// Runs one period.
    #[inline]
    pub fn step(&mut self, sample: &Sample) -> IdentificationStep {
        if let Stage::Over(end) = self.stage {
            return IdentificationStep::Finished(end);
        }
        self.protection.look(sample);
        // The expected angle is not known yet.
        let _ = self.protection.believe(sample.rotor, 0.0);
        let supply = self.modulation.supply(sample.bus_v);
        let voltage_v = match self.protection.fault() {
            Some(fault) => Err(IdentificationError::Fault(fault)),
            None => self.voltage(sample, supply.max_v),
        };
        let within =
            |AlphaBeta { alpha, beta }: AlphaBeta| alpha * alpha + beta * beta <= supply.max_v * supply.max_v;
        let end = match voltage_v {
            Ok(Some(voltage_v)) if within(voltage_v) => {
                let duties = self.modulation.duties(voltage_v, AlphaBeta::default(), &supply);
                return IdentificationStep::Running(duties);
            }
            // The supply voltage has dropped below the voltage needed.
            Ok(Some(_)) => Err(IdentificationError::SupplyTooLow),
            Ok(None) => Ok(self.found),
            Err(error) => Err(error),
        };
        self.stage = Stage::Over(end);
        IdentificationStep::Finished(end)
    }

    /// Returns the voltage for the next period, `V`; `None` when finished.
    #[inline]
    fn voltage(&mut self, sample: &Sample, max_v: f32) -> Result<Option<AlphaBeta>, IdentificationError> {
        if sample.phase_a.iter().any(|phase_a| phase_a.abs() > MAX_SHARE * self.current_a) {
            let dead_time_a = self.held_v / self.found.resistance_ohm - self.current_a;
            return Err(IdentificationError::too_little(larger(
                DEAD_TIME_SHARE * dead_time_a,
                self.current_a,
            )));
        }
        let is_a = AlphaBeta::from_phases(sample.phase_a);
        let (current_a, period_s) = (self.current_a, self.period_s);
        let (voltage_v, next) = match &mut self.stage {
            Stage::Resting(resting) => {
                let (voltage_v, done) = resting.step(sample.phase_a, max_v)?;
                let next = done.map(|rest| {
                    (self.found.resistance_ohm, self.held_v) = (rest.resistance_ohm, rest.voltage_v);
                    match self.finds_inductances {
                        true => Stage::Shaking(Shaking::new(Axis::Direct, current_a, rest, period_s)),
                        false => Stage::Turning(Turning::new(period_s)),
                    }
                });
                (voltage_v, next)
            }
            Stage::Shaking(shaking) => {
                let (voltage_v, done) = shaking.step(is_a, max_v)?;
                let next = done.map(|inductance_h| match shaking.axis {
                    Axis::Direct => {
                        self.found.direct_inductance_h = inductance_h;
                        let rest = Rest { resistance_ohm: self.found.resistance_ohm, voltage_v: self.held_v };
                        Stage::Shaking(Shaking::new(Axis::Quadrature, current_a, rest, period_s))
                    }
                    Axis::Quadrature => {
                        self.found.quadrature_inductance_h = inductance_h;
                        Stage::Turning(Turning::new(period_s))
                    }
                });
                (voltage_v, next)
            }
            Stage::Turning(turning) => {
                let angle = match sample.rotor {
                    Rotor::Angle(angle) => Some(angle),
                    Rotor::NotSampled | Rotor::Lost | Rotor::BadMagnet => None,
                };
                let (place, done) = turning.step(angle)?;
                if let Some(turned) = done {
                    self.found.pole_pairs = turned.pole_pairs;
                    self.found.encoder_offset_rad = turned.offset_rad;
                    self.found.is_encoder_reversed = turned.is_reversed;
                    return Ok(None);
                }
                (Rotation::from_angle(place).unpark(Dq { d: self.held_v, q: 0.0 }), None)
            }
            Stage::Over(_) => return Ok(None),
        };
        if let Some(next) = next {
            self.stage = next;
        }
        Ok(Some(voltage_v))
    }
}
