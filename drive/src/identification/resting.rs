//! The resistance, from two currents that stand still along phase U; meanwhile the rotor turns there.

use super::IdentificationError;
use crate::number::larger;
use crate::vector::Stator;

/// In which the voltage rises to all that the supply can make.
const RISE_S: f32 = 2.0;
/// For the rotor to come to rest.
const SETTLE_S: f32 = 0.5;
/// Over which a current is averaged.
const AVERAGE_S: f32 = 0.2;
/// Of the current, in each of the other two phases: half of it, if they are both there.
const OTHER_PHASE_SHARE: core::ops::Range<f32> = 0.4..0.6;

/// What came of it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rest {
    pub(super) resistance_ohm: f32,
    /// That makes all of the current.
    pub(super) voltage_v: f32,
}

/// The stage.
#[derive(Debug, Clone)]
pub(super) struct Resting {
    current_a: f32,
    period_s: f32,
    voltage_v: f32,
    /// Since the current was reached; before that, the voltage rises.
    held_s: Option<f32>,
    sum_a: f32,
    samples: u16,
    /// Voltage and current at half of the current.
    half: Option<(f32, f32)>,
}

impl Resting {
    #[inline]
    pub(super) fn new(current_a: f32, period_s: f32) -> Self {
        Self { current_a, period_s, voltage_v: 0.0, held_s: None, sum_a: 0.0, samples: 0, half: None }
    }

    /// One period: the voltage for the next one, `V`, and what came of it all, when it is done.
    #[inline]
    pub(super) fn step(
        &mut self,
        phase_a: [f32; 3],
        most_v: f32,
    ) -> Result<(Stator, Option<Rest>), IdentificationError> {
        let [along_a, v, w] = phase_a;
        let largest_a = larger(larger(along_a.abs(), v.abs()), w.abs());
        let mut done = None;
        match &mut self.held_s {
            None => {
                let wanted_a = if self.half.is_none() { 0.5 * self.current_a } else { self.current_a };
                self.voltage_v += most_v * self.period_s / RISE_S;
                if largest_a >= wanted_a {
                    // The rotor may still move, and its magnets with it.
                    if along_a < 0.5 * wanted_a {
                        return Err(IdentificationError::WrongPhases);
                    }
                    (self.held_s, self.sum_a, self.samples) = (Some(0.0), 0.0, 0);
                } else if self.voltage_v > most_v {
                    return Err(IdentificationError::NoCurrent);
                }
            }
            Some(held_s) => {
                *held_s += self.period_s;
                if *held_s > SETTLE_S {
                    (self.sum_a, self.samples) = (self.sum_a + along_a, self.samples + 1);
                }
                if *held_s > SETTLE_S + AVERAGE_S {
                    let mean_a = self.sum_a / f32::from(self.samples);
                    self.held_s = None;
                    match self.half {
                        None => self.half = Some((self.voltage_v, mean_a)),
                        Some((half_v, half_a)) => {
                            let is_right = |phase_a: f32| OTHER_PHASE_SHARE.contains(&(-phase_a / along_a));
                            if !is_right(v) || !is_right(w) {
                                return Err(IdentificationError::WrongPhases);
                            }
                            let resistance_ohm = (self.voltage_v - half_v) / (mean_a - half_a);
                            done = Some(Rest { resistance_ohm, voltage_v: self.voltage_v });
                        }
                    }
                }
            }
        }
        Ok((Stator { alpha: self.voltage_v, beta: 0.0 }, done))
    }
}
