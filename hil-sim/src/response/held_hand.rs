//! The hand on an axis of a live rig, which a user can move in place of the experiment.

use crate::motion::{Motion, sum_at};
use crate::plant::Repetition;
use crate::rig_file::AxisUnit;

/// Maximum speed of the intended position, as of a human hand.
const MAX_RAD_PER_S: f64 = 5.0;
const MAX_M_PER_S: f64 = 0.5;

/// Intended position of a hand.
#[derive(Debug)]
pub(super) struct HeldHand {
    pub(super) station: usize,
    pub(super) axis: usize,
    motions: Vec<Motion>,
    max_speed: f64,
    /// Position that the user requests.
    held: Option<f64>,
    /// Position in place of the experiment's; `None` while the experiment moves the hand.
    shown: Option<f64>,
}

impl HeldHand {
    pub(super) fn new(station: usize, axis: usize, unit: AxisUnit, motions: Vec<Motion>) -> Self {
        let max_speed = match unit {
            AxisUnit::Radian => MAX_RAD_PER_S,
            AxisUnit::Metre => MAX_M_PER_S,
        };
        Self { station, axis, motions, max_speed, held: None, shown: None }
    }

    /// Holds the hand at a position; `None` returns it to the experiment.
    pub(super) fn hold(&mut self, value: Option<f64>) {
        self.held = value;
    }

    /// Whether the user moves the hand, or the hand returns to the experiment.
    pub(super) fn is_moved(&self) -> bool {
        self.held.is_some() || self.shown.is_some()
    }

    /// Returns the intended position of the next tick; `None` if the experiment moves the hand.
    pub(super) fn next(&mut self, repetition: &Repetition, time_s: f64, period_s: f64) -> Option<f64> {
        let planned = repetition.value(time_s, |time_s| sum_at(&self.motions, time_s));
        let target = self.held.unwrap_or(planned);
        let last = self.shown.unwrap_or(planned);
        let step = self.max_speed * period_s;
        let next = last + (target - last).clamp(-step, step);
        let has_returned = self.held.is_none() && (next - planned).abs() < step;
        self.shown = (!has_returned).then_some(next);
        self.shown
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig_file::Step;

    #[test]
    fn a_hand_moves_at_limited_speed_to_the_user_and_back_to_the_experiment() {
        let motions = vec![Motion::Step(Step { at_s: 0.0, amplitude: 0.1 })];
        let mut hand = HeldHand::new(0, 0, AxisUnit::Metre, motions);
        let next = |hand: &mut HeldHand| hand.next(&Repetition::ONCE, 1.0, 0.001);
        assert_eq!(next(&mut hand), None);
        hand.hold(Some(0.2));
        let (mut last, mut ticks) = (0.1, 0);
        while let Some(position) = next(&mut hand) {
            assert!((position - last).abs() <= 0.5 * 0.001 + 1e-12);
            (last, ticks) = (position, ticks + 1);
            if ticks == 300 {
                assert!((position - 0.2).abs() < 1e-12);
                hand.hold(None);
            }
        }
        // 0.1 m at 0.5 m/s, after 300 ticks.
        assert!((497..=501).contains(&ticks) && !hand.is_moved(), "{ticks}");
    }
}
