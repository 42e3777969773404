//! An inductance, from a voltage that changes sign in every period: too fast for the rotor, and for the resistance to matter.

use super::IdentificationError;
use super::resting::Rest;
use crate::number::smaller;
use crate::vector::Stator;

/// Periods with one amplitude, an even number.
const PERIODS: u16 = 400;
/// At its beginning, that are left out: the voltage acts two samples later.
const BEFORE: u16 = 10;
/// Of the current: a change from one sample to the next that is large enough, and the least one where the supply makes no
/// larger one.
const SHARE: f32 = 0.15;
const LEAST_SHARE: f32 = 0.01;
/// Of what the resistance takes of the current: the first amplitude. What dead time takes is left out, which may be most.
const FIRST_SHARE: f32 = 0.25;

/// Along which axis of the rotor, which points along phase U.
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
    /// That holds the rotor, along phase U.
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

    /// One period: the voltage for the next one, `V`, and the inductance, `H`, when it is done.
    #[inline]
    pub(super) fn step(
        &mut self,
        is_a: Stator,
        most_v: f32,
    ) -> Result<(Stator, Option<f32>), IdentificationError> {
        let along_a = match self.axis {
            Axis::Direct => is_a.alpha,
            Axis::Quadrature => is_a.beta,
        };
        // Across what holds the rotor there is more room in the circle: a root, taken as its square, which is less.
        let room_v = match self.axis {
            Axis::Direct => most_v - self.held_v,
            Axis::Quadrature => most_v - self.held_v * self.held_v / most_v,
        };
        self.amplitude_v = smaller(self.amplitude_v, room_v);
        // The change since the last sample is by the voltage of two periods ago, which had this sign, too.
        let sign = if self.periods.is_multiple_of(2) { 1.0 } else { -1.0 };
        if self.periods >= BEFORE {
            self.sum_a += sign * (along_a - self.last_a);
        }
        self.last_a = along_a;
        self.periods += 1;
        let mut done = None;
        if self.periods == BEFORE + PERIODS {
            let change_a = self.sum_a / f32::from(PERIODS);
            let least_share = if 2.0 * self.amplitude_v <= room_v { SHARE } else { LEAST_SHARE };
            if change_a >= least_share * self.current_a {
                done = Some(self.amplitude_v * self.period_s / change_a);
            } else if least_share < SHARE {
                return Err(IdentificationError::NoCurrent);
            } else {
                self.amplitude_v *= 2.0;
            }
            (self.periods, self.sum_a) = (2, 0.0);
        }
        // The first period is half as large: so the current swings to both sides of what it was.
        let swing_v = if self.periods == 1 { 0.5 * self.amplitude_v } else { sign * self.amplitude_v };
        let voltage = match self.axis {
            Axis::Direct => Stator { alpha: self.held_v + swing_v, beta: 0.0 },
            Axis::Quadrature => Stator { alpha: self.held_v, beta: swing_v },
        };
        Ok((voltage, done))
    }
}
