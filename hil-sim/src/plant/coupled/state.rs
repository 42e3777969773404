//! State of a coupled machine.

use super::AxisValues;

/// State of a coupled machine, or its rate of change.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct State {
    pub(super) position: AxisValues,
    pub(super) velocity: AxisValues,
    pub(super) supplied_j: f64,
    pub(super) dissipated_j: f64,
}

impl State {
    /// Returns the state after `step_s` with a weighted sum of `rates`.
    pub(super) fn after<const N: usize>(&self, step_s: f64, rates: [(f64, &Self); N]) -> Self {
        let mut next = *self;
        for (weight, rate) in rates {
            next.add(step_s * weight, rate);
        }
        next
    }

    fn add(&mut self, factor: f64, rate: &Self) {
        for (value, rate) in self.position.iter_mut().zip(&rate.position) {
            *value += factor * rate;
        }
        for (value, rate) in self.velocity.iter_mut().zip(&rate.velocity) {
            *value += factor * rate;
        }
        self.supplied_j += factor * rate.supplied_j;
        self.dissipated_j += factor * rate.dissipated_j;
    }

    fn values(&self) -> impl Iterator<Item = f64> {
        let Self { position, velocity, supplied_j, dissipated_j } = *self;
        position.into_iter().chain(velocity).chain([supplied_j, dissipated_j])
    }

    /// Returns the largest entry relative to 1 + `scale`; NaN if an entry is NaN.
    pub(super) fn largest(&self, scale: &Self) -> f64 {
        let parts = self.values().zip(scale.values()).map(|(value, scale)| value.abs() / (1.0 + scale.abs()));
        parts.fold(0.0, |largest, part| if part > largest || part.is_nan() { part } else { largest })
    }

    /// Interpolates at a share of a step of `step_s` to `next`, with the rates at both ends (cubic Hermite).
    pub(super) fn between(&self, next: &Self, [first, last]: [&Self; 2], step_s: f64, share: f64) -> Self {
        let rest = 1.0 - share;
        let mut between = Self::default();
        between.add(rest * rest * (1.0 + 2.0 * share), self);
        between.add(share * share * (3.0 - 2.0 * share), next);
        between.add(step_s * share * rest * rest, first);
        between.add(-step_s * share * share * rest, last);
        between
    }
}
