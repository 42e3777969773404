//! What changes as time goes on.

use super::Axes;

/// State of a coupled machine, and its rate of change.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct State {
    pub(super) position: Axes,
    pub(super) velocity: Axes,
    pub(super) supplied_j: f64,
    pub(super) dissipated_j: f64,
}

impl State {
    /// After `step_s` at the constant `rate`.
    pub(super) fn after(&self, step_s: f64, rate: &Self) -> Self {
        let mut next = *self;
        for (value, rate) in next.position.iter_mut().zip(&rate.position) {
            *value += step_s * rate;
        }
        for (value, rate) in next.velocity.iter_mut().zip(&rate.velocity) {
            *value += step_s * rate;
        }
        next.supplied_j += step_s * rate.supplied_j;
        next.dissipated_j += step_s * rate.dissipated_j;
        next
    }
}
