//! The current loop, run once per PWM period, without registers: from ADC counts to duty cycles.
//!
//! ```text
//!   at rest     bridge off; measures the offsets of the current sensors
//!   unaligned   bridge off; aligns the rotor at the next torque command
//!   aligning    turns the rotor a little and back with limited current, once
//!   driving     follows the tick's torque command
//!   identifying turns the rotor with limited current to identify the motor, on request; then waits until the torque command
//!               ends
//! ```
//! A rotor with an absolute encoder is not aligned: the configuration contains the offset. A torque command
//! expires after three ticks. After that, faults are cleared, and detected again in the same period if they
//! persist.

mod exchange;
mod identifying;
mod scaling;

pub use exchange::{CommandAge, LoopExchange, LoopState};
pub use identifying::IdentificationMailbox;
pub use scaling::{MAX_COUNTS, OffsetError, Scaling, ZeroCurrentOffsets, amperes};

use dimsart_core::DriveFault;
use dimsart_link::protocol::{self, IdentificationFailure, IdentifiedMotor};
use drive::{
    As5600, Configuration, Drive, Duties, Encoder, Identification, IdentificationError, IdentificationStep,
    MotorEstimate, Rotor, Sample, ValidConfiguration,
};

use crate::catalogue::ThreePhaseDrive;

/// Delay from the capture of the angle to the sampling of the currents used with it. An SPI encoder is read
/// at the end of a period, 10 us after the sampling of the currents, and answers in the next period.
const SPI_AGE_PERIODS: f32 = 0.785;
/// An I²C encoder captures the angle 24 us after the sampling of the currents two periods earlier.
const I2C_AGE_PERIODS: f32 = 1.51;
/// Maximum age of a torque command, ticks.
const MAX_TICKS: f32 = 3.0;

/// ADC counts of a period.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AdcCounts {
    /// Phases U, V, W.
    pub phases: [u16; 3],
    /// Supply.
    pub bus: u16,
    /// Temperature of the bridge.
    pub temperature: u16,
}

/// A motor with a board's bridge and ADCs.
#[derive(Debug, Clone)]
pub struct CurrentLoop {
    scaling: Scaling,
    configuration: ValidConfiguration,
    zero_current_counts: [f32; 3],
    stage: Stage,
    drive: Drive,
    age: CommandAge,
    /// Periods without a torque command, up to its maximum age.
    idle_periods: u16,
    max_periods: u16,
    periods: u32,
    fault: Option<DriveFault>,
}

#[derive(Debug, Clone)]
enum Stage {
    AtRest(ZeroCurrentOffsets),
    Unaligned,
    Aligning(Identification),
    Driving,
    IdentificationMailbox(Identification),
    Identified,
}

impl CurrentLoop {
    /// Creates a loop with the bridge off, for ticks of `tick_s`. `checked` is the drive's configuration.
    #[must_use]
    pub fn new(drive: &ThreePhaseDrive, checked: &ValidConfiguration, tick_s: f32) -> Self {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a cast saturates")]
        let max_periods = (MAX_TICKS * tick_s / checked.get().inverter.period_s + 0.5) as u16;
        let Configuration { encoder, inverter, .. } = checked.get();
        let encoder_age_s = match encoder {
            Encoder::Incremental { .. } => 0.0,
            Encoder::As5047p | Encoder::Mt6701 => SPI_AGE_PERIODS * inverter.period_s,
            Encoder::As5600 => I2C_AGE_PERIODS * inverter.period_s + As5600::MEAN_LATENCY_S,
        };
        Self {
            scaling: drive.scaling,
            configuration: *checked,
            zero_current_counts: [drive.scaling.zero_current_counts; 3],
            stage: Stage::AtRest(ZeroCurrentOffsets::default()),
            drive: Drive::from_valid(checked).with_encoder_latency(encoder_age_s),
            age: CommandAge::new(max_periods),
            idle_periods: 0,
            max_periods,
            periods: 0,
            fault: None,
        }
    }

    /// Runs one period; returns the duty cycles for the next one, or `None` to turn off the bridge at once.
    #[inline]
    pub fn run_period(&mut self, counts: AdcCounts, rotor: Rotor, exchange: &LoopExchange) -> Option<Duties> {
        let wanted_nm = self.age.fresh_command(exchange.command_and_count());
        self.idle_periods = if wanted_nm.is_some() { 0 } else { self.idle_periods.saturating_add(1) };
        if self.idle_periods >= self.max_periods {
            self.idle_periods = 0;
            self.forget();
        }
        if exchange.identification.is_requested() {
            self.begin_identification(&exchange.identification);
        }
        let sample = Sample {
            phase_a: amperes(counts.phases, self.zero_current_counts, &self.scaling),
            bus_v: f32::from(counts.bus) * self.scaling.v_per_count,
            temperature_c: self.scaling.celsius(counts.temperature),
            rotor,
        };
        let is_wanted = wanted_nm.is_some();
        let is_driving = matches!(self.stage, Stage::Driving);
        // Before driving, computes angle, speed and faults only. A single call, because two would double the
        // code.
        let duties = self.drive.step(&sample, wanted_nm.filter(|_| is_driving));
        let duties = if is_driving { duties } else { self.prepare(&counts, &sample, is_wanted, exchange) };
        self.periods = self.periods.wrapping_add(1);
        let measured = self.drive.measured();
        exchange.publish(&LoopState {
            angle: measured.angle.0,
            speed_rad_per_s: measured.speed_rad_per_s,
            current_a: measured.current_a.q,
            bus_v: sample.bus_v,
            temperature_c: sample.temperature_c,
            fault: self.fault.or_else(|| self.drive.fault()),
            is_ready: matches!(self.stage, Stage::Driving),
            periods: self.periods,
        });
        duties
    }

    /// Runs a period before driving.
    #[cold]
    #[inline(never)]
    fn prepare(
        &mut self,
        counts: &AdcCounts,
        sample: &Sample,
        is_wanted: bool,
        exchange: &LoopExchange,
    ) -> Option<Duties> {
        match &mut self.stage {
            Stage::AtRest(rest) => match rest.step(counts.phases, &self.scaling) {
                Ok(None) => {}
                Ok(Some(zero_current_counts)) => {
                    self.zero_current_counts = zero_current_counts;
                    self.drive.clear();
                    self.stage = self.first_stage();
                    self.fault = None;
                }
                Err(OffsetError) => {
                    self.fault = Some(DriveFault::CurrentSensors);
                    self.stage = Stage::AtRest(ZeroCurrentOffsets::default());
                }
            },
            Stage::Unaligned => {
                if is_wanted && self.fault.is_none() && self.drive.fault().is_none() {
                    let identification = Identification::with_offset_only(
                        &self.configuration,
                        self.configuration.get().aligning_current_a,
                    );
                    self.stage = Stage::Aligning(identification);
                }
            }
            Stage::Aligning(_) if !is_wanted => self.stage = Stage::Unaligned,
            Stage::Aligning(identification) => match identification.step(sample) {
                IdentificationStep::Running(duties) => return Some(duties),
                IdentificationStep::Finished(Ok(found)) => {
                    let motor = &self.configuration.get().motor;
                    let is_this_motor = (found.pole_pairs, found.is_encoder_reversed)
                        == (motor.pole_pairs, motor.is_encoder_reversed);
                    if is_this_motor {
                        self.drive.align(found.encoder_offset_rad);
                        // The identification current looks like a fault to the drive.
                        self.drive.clear();
                        self.stage = Stage::Driving;
                    } else {
                        self.fault = Some(DriveFault::NotAligned);
                        self.stage = Stage::Unaligned;
                    }
                }
                IdentificationStep::Finished(Err(error)) => {
                    self.fault = Some(match error {
                        IdentificationError::Fault(fault) => fault,
                        _ => DriveFault::NotAligned,
                    });
                    self.stage = Stage::Unaligned;
                }
            },
            Stage::IdentificationMailbox(_) if !is_wanted => {
                exchange.identification.publish(failed(IdentificationFailure::Ended));
                self.stage = self.first_stage();
            }
            Stage::IdentificationMailbox(identification) => {
                // The motor's parameters may be wrong; only faults of the bridge count.
                self.drive.clear();
                match identification.step(sample) {
                    IdentificationStep::Running(duties) => return Some(duties),
                    IdentificationStep::Finished(end) => {
                        exchange
                            .identification
                            .publish(end.map_or_else(|error| failed(identification_failure(error)), found));
                        self.stage = Stage::Identified;
                    }
                }
            }
            Stage::Identified if !is_wanted => self.stage = self.first_stage(),
            Stage::Identified | Stage::Driving => {}
        }
        None
    }

    /// Returns the stage after a fault-free rest.
    fn first_stage(&self) -> Stage {
        if self.configuration.get().encoder.is_absolute() { Stage::Driving } else { Stage::Unaligned }
    }

    #[cold]
    #[inline(never)]
    fn begin_identification(&mut self, identification: &IdentificationMailbox) {
        let current_a = identification.take_request();
        if matches!(self.stage, Stage::AtRest(_)) {
            let fault = self.fault.unwrap_or(DriveFault::CurrentSensors);
            return identification.publish(failed(IdentificationFailure::Drive(fault.reason().number())));
        }
        self.fault = None;
        self.stage =
            Stage::IdentificationMailbox(Identification::with_inductances(&self.configuration, current_a));
    }

    /// Clears a fault.
    #[cold]
    #[inline(never)]
    fn forget(&mut self) {
        use DriveFault::{EncoderJumped, EncoderLost, EncoderSlipped};
        let has_lost_rotor = matches!(self.drive.fault(), Some(EncoderLost | EncoderJumped | EncoderSlipped));
        self.drive.clear();
        if !matches!(self.stage, Stage::AtRest(_)) {
            self.fault = None;
            if has_lost_rotor {
                // An incremental encoder may have missed counts.
                self.stage = self.first_stage();
            }
        }
    }
}

fn failed(failure: IdentificationFailure) -> protocol::Identification {
    protocol::Identification::Failed(failure)
}

/// Converts the result to protocol units.
fn found(found: MotorEstimate) -> protocol::Identification {
    protocol::Identification::Found(IdentifiedMotor {
        resistance_ohm: found.resistance_ohm,
        direct_inductance_h: found.direct_inductance_h,
        quadrature_inductance_h: found.quadrature_inductance_h,
        pole_pairs: found.pole_pairs,
        is_encoder_reversed: found.is_encoder_reversed,
        encoder_offset_rad: found.encoder_offset_rad,
    })
}

/// Converts an identification error to the protocol's.
#[must_use]
pub fn identification_failure(error: IdentificationError) -> IdentificationFailure {
    match error {
        IdentificationError::SupplyTooLow => IdentificationFailure::SupplyTooLow,
        IdentificationError::PhaseMismatch => IdentificationFailure::PhaseMismatch,
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a cast saturates")]
        IdentificationError::TooLittleCurrent { needed_a } => {
            IdentificationFailure::TooLittleCurrent(((10.0 * needed_a) as u16).saturating_add(1))
        }
        IdentificationError::DidNotMove => IdentificationFailure::DidNotMove,
        IdentificationError::Slipped { .. } => IdentificationFailure::Slipped,
        IdentificationError::Fault(fault) => IdentificationFailure::Drive(fault.reason().number()),
    }
}
