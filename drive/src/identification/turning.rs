//! Stage 3: pole pairs, direction and offset from a slowly rotating current vector that the rotor follows, forward and
//! back.
//!
//! In each direction, the first quarter of an electrical turn takes up friction and play; the following turn is
//! evaluated. The lag by friction is the same in both directions and cancels in their mean.

use super::IdentificationError;
use crate::Angle;

/// Duration of an electrical turn.
const TURN_S: f32 = 2.0;
/// Electrical turns: the lead-in, and the whole of one direction.
const AHEAD: f32 = 0.25;
const WAY: f32 = 1.25;
/// Maximum deviation from a whole number of pole pairs.
const MAX_FRACTION: f32 = 0.3;
/// Minimum travel per electrical turn, in turns; less counts as no motion (above 128 pole pairs).
const MIN_TRAVEL: f32 = 1.0 / 128.0;
/// Units of an [`Angle`] per step of travel: 2²⁸ steps per turn, range ±8 turns.
const UNITS: i32 = 16;
const STEP: f32 = 1.0 / 268_435_456.0;
/// Turns added to make any offset positive.
const WHOLE: f32 = 4.0;

/// Result of the stage.
#[derive(Debug, Clone, Copy)]
pub(super) struct Turned {
    pub(super) pole_pairs: u8,
    pub(super) offset_rad: f32,
    pub(super) is_reversed: bool,
}

/// The stage.
#[derive(Debug, Clone, Default)]
pub(super) struct Turning {
    period_s: f32,
    /// Time since the start.
    time_s: f32,
    /// First encoder angle; `None` before the first reading.
    start: Option<Angle>,
    last: Angle,
    /// Travel of the encoder since the start, in [`STEP`]s.
    travel: i32,
    forward: Way,
    back: Way,
}

/// Observations of the evaluated turn in one direction.
#[derive(Debug, Clone, Copy, Default)]
struct Way {
    first: Option<i32>,
    last: i32,
    mean: f32,
    samples: u32,
}

impl Way {
    #[inline]
    fn take(&mut self, travel: i32) {
        self.first.get_or_insert(travel);
        (self.last, self.samples) = (travel, self.samples + 1);
        self.mean += (travel as f32 - self.mean) / self.samples as f32;
    }

    /// Returns the travel, in turns.
    #[inline]
    fn travel(&self) -> f32 {
        (self.last - self.first.unwrap_or(self.last)) as f32 * STEP
    }
}

impl Turning {
    #[inline]
    pub(super) fn new(period_s: f32) -> Self {
        Self { period_s, ..Self::default() }
    }

    /// Runs one period. Returns the angle of the current vector, and the result when finished.
    #[inline]
    pub(super) fn step(
        &mut self,
        rotor: Option<Angle>,
    ) -> Result<(Angle, Option<Turned>), IdentificationError> {
        let turns = self.time_s / TURN_S;
        let is_forward = turns < WAY;
        let in_way = if is_forward { turns } else { turns - WAY };
        if let Some(angle) = rotor {
            if self.start.is_none() {
                (self.start, self.last) = (Some(angle), angle);
            }
            let steps = angle.wrapping_sub(self.last).0.cast_signed() / UNITS;
            self.travel = self.travel.saturating_add(steps);
            // The remainder is kept for the next period.
            self.last = Angle(self.last.0.wrapping_add((steps * UNITS).cast_unsigned()));
            if in_way >= AHEAD && turns < 2.0 * WAY {
                let way = if is_forward { &mut self.forward } else { &mut self.back };
                way.take(self.travel);
            }
        }
        self.time_s += self.period_s;
        let place = if is_forward { in_way } else { (WAY - in_way).max(0.0) };
        let done = if turns < 2.0 * WAY { None } else { Some(self.turned()?) };
        Ok((Angle::from_turns(place), done))
    }

    #[inline]
    fn turned(&self) -> Result<Turned, IdentificationError> {
        let travels = [self.forward.travel(), -self.back.travel()];
        let [forward, back] = travels;
        if forward.abs() < MIN_TRAVEL || back.abs() < MIN_TRAVEL {
            return Err(IdentificationError::DidNotMove);
        }
        let [pairs, pairs_back] = travels.map(|travel| 1.0 / travel.abs());
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most 128")]
        let pole_pairs = (pairs + 0.5) as u8;
        let is_whole = |pairs: f32| (pairs - f32::from(pole_pairs)).abs() <= MAX_FRACTION;
        if pole_pairs == 0 || forward * back < 0.0 || !is_whole(pairs) || !is_whole(pairs_back) {
            return Err(IdentificationError::Slipped { travel_rad: forward * core::f32::consts::TAU });
        }
        let is_reversed = forward < 0.0;
        // Mean angle of the current vector: 3/4 turn forward, 1/2 turn back.
        let start = self.start.unwrap_or_default().to_rad() / core::f32::consts::TAU;
        let mean = start + 0.5 * (self.forward.mean + self.back.mean) * STEP;
        let turns = if is_reversed { -mean } else { mean } - 0.625 / f32::from(pole_pairs);
        let offset = Angle::from_turns(turns + WHOLE);
        Ok(Turned { pole_pairs, offset_rad: offset.to_rad(), is_reversed })
    }
}
