//! Finds out what a motor and its encoder are, with a current that is bounded: `R`, `L_d`, `L_q`, pole pairs, and which way and
//! from where the encoder counts. `ψ` is not among it: at rest it does nothing.
//!
//! ```text
//!   Resting   two currents along phase U, the rotor turns there    R = Δu/Δi: what dead time takes is in both
//!   Shaking   a voltage of alternating sign, twice                 L = u T/Δi along the magnets, and across them
//!   Turning   the current turns slowly and back                    pole pairs, direction; offset as the mean of both ways
//! ```
//! The rotor turns to the nearest of its electrical zeros, then by one and a quarter of an electrical turn and back: the
//! joint must be free to.

mod resting;
mod shaking;
mod turning;

use dimsart_core::DriveFault;

use crate::configuration::{Checked, Configuration, ConfigurationError};
use crate::modulation::{Duties, Modulation};
use crate::number::{larger, within};
use crate::protection::Protection;
use crate::sample::{Rotor, Sample};
use crate::vector::{Dq, Stator, Turn};
use resting::{Rest, Resting};
use shaking::{Axis, Shaking};
use turning::Turning;

/// Of the current that was asked for: more is not made by what is done here.
const MOST_SHARE: f32 = 1.25;

/// Of what dead time takes, over `R`: the least current with which no phase exceeds [`MOST_SHARE`] where the current turns.
/// There dead time takes `cos 30°` of what it takes along a phase, which has `cos 30°` of the current:
/// `cos 30° (1 - cos 30°) / (MOST_SHARE - cos 30°)`.
const DEAD_TIME_SHARE: f32 = 0.302;
/// Of the current below which dead time takes less: half of the requested current, less 5 %, has half of that in two phases,
/// which exceeds it. Otherwise dead time would count as resistance.
const LEAST_SHARE: f32 = 4.5;
/// For what the rotor's own voltage adds, and where the resistance is not known yet.
const RESERVE: f32 = 1.5;

/// What was found.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Identified {
    /// `R` of a phase, `ohm`.
    pub resistance_ohm: f32,
    /// `L_d`, `H`.
    pub direct_inductance_h: f32,
    /// `L_q`, `H`.
    pub quadrature_inductance_h: f32,
    /// `p`.
    pub pole_pairs: u8,
    /// As [`Motor::is_encoder_reversed`](crate::Motor::is_encoder_reversed).
    pub is_encoder_reversed: bool,
    /// As [`Motor::encoder_offset_rad`](crate::Motor::encoder_offset_rad).
    pub encoder_offset_rad: f32,
}

/// Why nothing was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum IdentificationError {
    /// The supply's voltage makes no such current.
    NoCurrent,
    /// The currents are not where the voltage is.
    WrongPhases,
    /// Dead time, or the rotor's own voltage, changes so small a current by over a quarter.
    TooLittleCurrent {
        /// With which to try again, `A`.
        needed_a: f32,
    },
    /// The rotor did not turn.
    DidNotMove,
    /// It turned, and not as a whole number of pole pairs does.
    Slipped {
        /// In an electrical turn, `rad`.
        travel_rad: f32,
    },
    /// What turns off a drive, too.
    Fault(DriveFault),
}

impl IdentificationError {
    fn too_little(least_a: f32) -> Self {
        Self::TooLittleCurrent { needed_a: RESERVE * least_a }
    }
}

/// What a period comes to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum IdentificationStep {
    /// It goes on, with these duty cycles for the next period.
    GoesOn(Duties),
    /// It is over, and the bridge is to be off; so it stays.
    Over(Result<Identified, IdentificationError>),
}

/// What it is at.
#[derive(Debug, Clone)]
enum Stage {
    Resting(Resting),
    Shaking(Shaking),
    Turning(Turning),
    Over(Result<Identified, IdentificationError>),
}

/// An identification under way.
#[derive(Debug, Clone)]
pub struct Identification {
    finds_inductances: bool,
    current_a: f32,
    period_s: f32,
    modulation: Modulation,
    protection: Protection,
    stage: Stage,
    found: Identified,
    /// That makes the current.
    held_v: f32,
}

impl Identification {
    /// With `current_a`, > 0, up to the limit of a configuration, of whose motor nothing is believed.
    ///
    /// # Errors
    /// [`ConfigurationError`] with the first value outside its range.
    pub fn new(configuration: &Configuration, current_a: f32) -> Result<Self, ConfigurationError> {
        let checked = configuration.checked()?;
        if !(current_a > 0.0 && current_a <= configuration.limits.current_a) {
            let range = "above 0, up to limits.current_a";
            return Err(ConfigurationError { name: "current_a", value: current_a, range });
        }
        Ok(Self::of_motor(&checked, current_a))
    }

    /// As [`new`](Self::new), with a configuration that is checked. More current than the limit is not made.
    #[inline]
    #[must_use]
    pub fn of_motor(configuration: &Checked, current_a: f32) -> Self {
        Self::begin(configuration, current_a, true)
    }

    /// As [`of_motor`](Self::of_motor), of a motor whose inductances are known: they are not shaken, and not found.
    #[inline]
    #[must_use]
    pub fn of_offset(configuration: &Checked, current_a: f32) -> Self {
        Self::begin(configuration, current_a, false)
    }

    #[inline]
    fn begin(configuration: &Checked, current_a: f32, finds_inductances: bool) -> Self {
        let configuration = configuration.get();
        let current_a = within(current_a, configuration.limits.current_a);
        let needed_a = LEAST_SHARE * configuration.inverter.dead_time_current_a;
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
            found: Identified::default(),
            held_v: 0.0,
        }
    }

    /// One period.
    #[inline]
    pub fn step(&mut self, sample: &Sample) -> IdentificationStep {
        if let Stage::Over(end) = self.stage {
            return IdentificationStep::Over(end);
        }
        self.protection.look(sample);
        // Where the rotor should be is not known yet: nothing surprises.
        let _ = self.protection.believe(sample.rotor, 0.0);
        let supply = self.modulation.supply(sample.bus_v);
        let voltage_v = match self.protection.fault() {
            Some(fault) => Err(IdentificationError::Fault(fault)),
            None => self.voltage(sample, supply.most_v),
        };
        let within =
            |Stator { alpha, beta }: Stator| alpha * alpha + beta * beta <= supply.most_v * supply.most_v;
        let end = match voltage_v {
            Ok(Some(voltage_v)) if within(voltage_v) => {
                let duties = self.modulation.duties(voltage_v, Stator::default(), &supply);
                return IdentificationStep::GoesOn(duties);
            }
            // The supply has become too low for what it made before.
            Ok(Some(_)) => Err(IdentificationError::NoCurrent),
            Ok(None) => Ok(self.found),
            Err(error) => Err(error),
        };
        self.stage = Stage::Over(end);
        IdentificationStep::Over(end)
    }

    /// The voltage for the next period, `V`; none when all is found.
    #[inline]
    fn voltage(&mut self, sample: &Sample, most_v: f32) -> Result<Option<Stator>, IdentificationError> {
        if sample.phase_a.iter().any(|phase_a| phase_a.abs() > MOST_SHARE * self.current_a) {
            let dead_time_a = self.held_v / self.found.resistance_ohm - self.current_a;
            return Err(IdentificationError::too_little(larger(
                DEAD_TIME_SHARE * dead_time_a,
                self.current_a,
            )));
        }
        let is_a = Stator::from_phases(sample.phase_a);
        let (current_a, period_s) = (self.current_a, self.period_s);
        let (voltage_v, next) = match &mut self.stage {
            Stage::Resting(resting) => {
                let (voltage_v, done) = resting.step(sample.phase_a, most_v)?;
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
                let (voltage_v, done) = shaking.step(is_a, most_v)?;
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
                    Rotor::At(angle) => Some(angle),
                    Rotor::Awaited | Rotor::Lost | Rotor::BadMagnet => None,
                };
                let (place, done) = turning.step(angle)?;
                if let Some(turned) = done {
                    self.found.pole_pairs = turned.pole_pairs;
                    self.found.encoder_offset_rad = turned.offset_rad;
                    self.found.is_encoder_reversed = turned.is_reversed;
                    return Ok(None);
                }
                (Turn::to(place).unpark(Dq { d: self.held_v, q: 0.0 }), None)
            }
            Stage::Over(_) => return Ok(None),
        };
        if let Some(next) = next {
            self.stage = next;
        }
        Ok(Some(voltage_v))
    }
}
