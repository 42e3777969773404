//! Stage 1: resistance from two constant currents along phase U; the rotor aligns with it.

use super::IdentificationError;
use crate::number::larger;
use crate::vector::AlphaBeta;

/// Minimum rise time of the voltage to its maximum.
const RISE_S: f32 = 2.0;
/// Tolerance relative to the current: by how much the current may exceed its target before the voltage is reduced, or
/// its filtered value before the rise is paused. With `L/R` of 10 ms, the overshoot is at most 2.5 %.
const SHARE: f32 = 0.05;
const FILTER_S: f32 = 0.02;
/// Maximum attempts until the phase currents match the voltage.
const MAX_TRIES: u8 = 4;
/// Minimum difference of the two compared currents, relative to the current.
const MIN_CHANGE: f32 = 0.25;
/// Time for the rotor to come to rest.
const SETTLE_S: f32 = 0.5;
/// Averaging time of a current.
const AVERAGE_S: f32 = 0.2;
/// Valid share of the current in each of the other two phases; nominally half.
const OTHER_PHASE_SHARE: core::ops::Range<f32> = 0.4..0.6;

/// Result of the stage.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rest {
    pub(super) resistance_ohm: f32,
    /// Voltage of the full current.
    pub(super) voltage_v: f32,
}

/// The stage.
#[derive(Debug, Clone)]
pub(super) struct Resting {
    current_a: f32,
    period_s: f32,
    voltage_v: f32,
    /// The current, filtered with [`FILTER_S`].
    filtered_a: f32,
    /// Time since the current was reached; `None` while the voltage rises.
    held_s: Option<f32>,
    /// Sums of the phase currents since then, and number of samples.
    sum_a: [f32; 3],
    samples: f32,
    /// Whether the current has been steady meanwhile.
    is_steady: bool,
    tries: u8,
    /// Voltage and current at half of the current.
    half: Option<(f32, f32)>,
}

impl Resting {
    #[inline]
    pub(super) fn new(current_a: f32, period_s: f32) -> Self {
        Self {
            current_a,
            period_s,
            voltage_v: 0.0,
            filtered_a: 0.0,
            held_s: None,
            sum_a: [0.0; 3],
            samples: 0.0,
            is_steady: true,
            tries: 0,
            half: None,
        }
    }

    /// Runs one period. Returns the voltage for the next period, `V`, and the result when finished.
    #[inline]
    pub(super) fn step(
        &mut self,
        phase_a: [f32; 3],
        max_v: f32,
    ) -> Result<(AlphaBeta, Option<Rest>), IdentificationError> {
        let [along_a, v, w] = phase_a;
        let largest_a = larger(larger(along_a.abs(), v.abs()), w.abs());
        let wanted_a = if self.half.is_none() { 0.5 * self.current_a } else { self.current_a };
        let (missing_a, max_a) = (wanted_a - largest_a, SHARE * self.current_a);
        let rise_a = largest_a - self.filtered_a;
        self.filtered_a += rise_a * self.period_s / FILTER_S;
        let change_v = max_v * self.period_s / RISE_S;
        let mut done = None;
        match &mut self.held_s {
            None => {
                if rise_a < max_a {
                    self.voltage_v += change_v;
                }
                if missing_a <= 0.0 {
                    self.held_s = Some(0.0);
                } else if self.voltage_v > max_v {
                    return Err(IdentificationError::SupplyTooLow);
                }
            }
            Some(held_s) => {
                *held_s += self.period_s;
                if *held_s > SETTLE_S {
                    self.samples += 1.0;
                    self.is_steady &= missing_a < MIN_CHANGE * self.current_a;
                    for (sum_a, phase_a) in self.sum_a.iter_mut().zip(phase_a) {
                        *sum_a += phase_a;
                    }
                } else if missing_a > max_a && rise_a < max_a {
                    self.voltage_v += change_v;
                } else if missing_a < -max_a && rise_a > -max_a {
                    self.voltage_v -= change_v;
                }
                if *held_s > SETTLE_S + AVERAGE_S {
                    let [along_a, v, w] = core::mem::take(&mut self.sum_a);
                    let mean_a = along_a / core::mem::take(&mut self.samples);
                    let is_right = |phase_a: f32| OTHER_PHASE_SHARE.contains(&(-phase_a / along_a));
                    let is_steady = core::mem::replace(&mut self.is_steady, true);
                    if !(is_steady && mean_a > 0.0 && is_right(v) && is_right(w)) {
                        // The rotor may still move: its back-EMF brakes it, more so at low resistance.
                        *held_s = 0.0;
                        self.tries += 1;
                        if self.tries > MAX_TRIES {
                            return Err(IdentificationError::PhaseMismatch);
                        }
                    } else if let Some((half_v, half_a)) = self.half {
                        if mean_a - half_a < MIN_CHANGE * self.current_a {
                            return Err(IdentificationError::too_little(self.current_a));
                        }
                        let resistance_ohm = (self.voltage_v - half_v) / (mean_a - half_a);
                        done = Some(Rest { resistance_ohm, voltage_v: self.voltage_v });
                    } else {
                        (self.half, self.held_s) = (Some((self.voltage_v, mean_a)), None);
                    }
                }
            }
        }
        Ok((AlphaBeta { alpha: self.voltage_v, beta: 0.0 }, done))
    }
}
