//! Pole pairs, direction and offset, from a current that turns slowly and back, and the rotor with it.
//!
//! A quarter of an electrical turn goes ahead either way, in which friction and play are taken up; the turn behind it
//! counts. What friction holds the rotor back by is the same both ways, and falls out of their mean.

use super::IdentificationError;
use crate::Angle;

/// Of an electrical turn.
const TURN_S: f32 = 2.0;
/// Of those turns: the quarter that goes ahead, and all of one way.
const AHEAD: f32 = 0.25;
const WAY: f32 = 1.25;
/// Of a pole pair, that may be missing to a whole number of them.
const MOST_FRACTION: f32 = 0.3;
/// A rotor that turns less in an electrical turn, in turns, did not move: nobody builds more pole pairs.
const LEAST_TRAVEL: f32 = 1.0 / 128.0;
/// Travel is counted in steps of this many units of an [`Angle`], of 2²⁸ a turn: eight turns either way.
const UNITS: i32 = 16;
const STEP: f32 = 1.0 / 268_435_456.0;
/// Turns that make any offset positive.
const WHOLE: f32 = 4.0;

/// What came of it.
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
    /// Since it began.
    time_s: f32,
    /// As the encoder says; none before it has said anything.
    start: Option<Angle>,
    last: Angle,
    /// Of the encoder since it began, in [`STEP`]s.
    travel: i32,
    forward: Way,
    back: Way,
}

/// What was seen of the turn that counts.
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

    /// From its begin to its end, in turns.
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

    /// One period: to where the current is to turn, and what came of it all, when it is done.
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
            let steps = angle.minus(self.last).0.cast_signed() / UNITS;
            self.travel = self.travel.saturating_add(steps);
            // What is less than a step counts in the next period.
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
        if forward.abs() < LEAST_TRAVEL || back.abs() < LEAST_TRAVEL {
            return Err(IdentificationError::DidNotMove);
        }
        let [pairs, pairs_back] = travels.map(|travel| 1.0 / travel.abs());
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most 128")]
        let pole_pairs = (pairs + 0.5) as u8;
        let is_whole = |pairs: f32| (pairs - f32::from(pole_pairs)).abs() <= MOST_FRACTION;
        if pole_pairs == 0 || forward * back < 0.0 || !is_whole(pairs) || !is_whole(pairs_back) {
            return Err(IdentificationError::Slipped { travel_rad: forward * core::f32::consts::TAU });
        }
        let is_reversed = forward < 0.0;
        // The current was at 3/4 of a turn on average on the way forward, at 1/2 on the way back.
        let start = self.start.unwrap_or_default().rad() / core::f32::consts::TAU;
        let mean = start + 0.5 * (self.forward.mean + self.back.mean) * STEP;
        let turns = if is_reversed { -mean } else { mean } - 0.625 / f32::from(pole_pairs);
        let offset = Angle::from_turns(turns + WHOLE);
        Ok(Turned { pole_pairs, offset_rad: offset.rad(), is_reversed })
    }
}
