//! A plant of independent axes.

use super::axis::Axis;
use super::{Actuation, AxisTruth, Plant};

/// Axes that share a period and nothing else.
#[derive(Debug)]
pub struct AxisWise {
    axes: Vec<Axis>,
}

impl AxisWise {
    /// A plant of `axes`.
    #[must_use]
    pub fn new(axes: Vec<Axis>) -> Self {
        Self { axes }
    }
}

impl Plant for AxisWise {
    fn dof(&self) -> usize {
        self.axes.len()
    }

    fn sense(&mut self, measured: &mut [f32]) {
        for (entry, axis) in measured.iter_mut().zip(&self.axes) {
            *entry = axis.sense();
        }
    }

    fn advance(&mut self, start_s: f64, period_s: f64, command: &[f32]) {
        let commands = command.iter().copied().chain(core::iter::repeat(0.0));
        for (axis, command_n) in self.axes.iter_mut().zip(commands) {
            axis.advance(start_s, period_s, f64::from(command_n));
        }
    }

    fn truth(&self, axis: usize) -> Option<AxisTruth> {
        self.axes.get(axis).map(Axis::truth)
    }

    fn position(&self, axis: usize) -> f64 {
        self.axes.get(axis).map_or(f64::NAN, Axis::position_m)
    }

    fn add_actuations(&self, actuations: &mut Vec<Actuation>) {
        actuations.extend(self.axes.iter().map(Axis::actuation));
    }

    fn is_touching(&self, axis: usize) -> bool {
        self.axes.get(axis).is_some_and(Axis::is_in_contact)
    }
}
