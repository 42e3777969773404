//! Stage 2: an inductance from a voltage that alternates every period, too fast for rotor and resistance to matter.

use super::IdentificationError;
use super::resting::Rest;
use crate::number::smaller;
use crate::vector::AlphaBeta;

/// Periods per amplitude, an even number.
const PERIODS: u16 = 400;
/// Periods skipped at the start: the voltage acts two samples later.
const BEFORE: u16 = 10;
/// Sufficient current change per sample, relative to the current, and the minimum if the supply voltage limits it.
const SHARE: f32 = 0.15;
const MIN_SHARE: f32 = 0.01;
/// First amplitude, relative to the voltage across the resistance; without the dead-time voltage, which may dominate.
const FIRST_SHARE: f32 = 0.25;

/// Axis of the rotor, which is aligned with phase U.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Axis {
    Direct,
    Quadrature,
}

/// The stage.
#[derive(Debug, Clone)]
pub(super) struct Shaking {
    pub(super) axis: Axis,
    current_a: f32,
    period_s: f32,
    /// Voltage along phase U that holds the rotor.
    held_v: f32,
    amplitude_v: f32,
    periods: u16,
    last_a: f32,
    sum_a: f32,
}

impl Shaking {
    #[inline]
    pub(super) fn new(axis: Axis, current_a: f32, rest: Rest, period_s: f32) -> Self {
        let held_v = rest.voltage_v;
        let amplitude_v = FIRST_SHARE * rest.resistance_ohm * current_a;
        Self { axis, current_a, period_s, held_v, amplitude_v, periods: 0, last_a: 0.0, sum_a: 0.0 }
    }

    /// Runs one period. Returns the voltage for the next period, `V`, and the inductance, `H`, when finished.
    #[inline]
    pub(super) fn step(
        &mut self,
        is_a: AlphaBeta,
        max_v: f32,
    ) -> Result<(AlphaBeta, Option<f32>), IdentificationError> {
        let along_a = match self.axis {
            Axis::Direct => is_a.alpha,
            Axis::Quadrature => is_a.beta,
        };
        // Conservative bound of the circle across the holding voltage: without the square root.
        let room_v = match self.axis {
            Axis::Direct => max_v - self.held_v,
            Axis::Quadrature => max_v - self.held_v * self.held_v / max_v,
        };
        self.amplitude_v = smaller(self.amplitude_v, room_v);
        // The change since the last sample is caused by the voltage of two periods ago, of the same sign.
        let sign = if self.periods.is_multiple_of(2) { 1.0 } else { -1.0 };
        if self.periods >= BEFORE {
            self.sum_a += sign * (along_a - self.last_a);
        }
        self.last_a = along_a;
        self.periods += 1;
        let mut done = None;
        if self.periods == BEFORE + PERIODS {
            let change_a = self.sum_a / f32::from(PERIODS);
            let min_share = if 2.0 * self.amplitude_v <= room_v { SHARE } else { MIN_SHARE };
            if change_a >= min_share * self.current_a {
                done = Some(self.amplitude_v * self.period_s / change_a);
            } else if min_share < SHARE {
                return Err(IdentificationError::SupplyTooLow);
            } else {
                self.amplitude_v *= 2.0;
            }
            (self.periods, self.sum_a) = (2, 0.0);
        }
        // Half amplitude in the first period, so that the current alternates symmetrically.
        let swing_v = if self.periods == 1 { 0.5 * self.amplitude_v } else { sign * self.amplitude_v };
        let voltage = match self.axis {
            Axis::Direct => AlphaBeta { alpha: self.held_v + swing_v, beta: 0.0 },
            Axis::Quadrature => AlphaBeta { alpha: self.held_v, beta: swing_v },
        };
        Ok((voltage, done))
    }
}
