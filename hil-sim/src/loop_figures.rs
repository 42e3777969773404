//! Figures of control loops.

use serde::Serialize;

/// Growth per tick that is not distinguishable from 1.
pub(crate) const UNDECIDED: f64 = 1e-5;

/// Figures of the loop of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct LoopFigures {
    /// Growth per tick of the slowest decaying disturbance: above 1 the loop is unstable and has no other figures.
    /// `None` if all disturbances decay fast.
    pub growth_per_tick: Option<f64>,
    /// Phase margin, minimum distance of the phase from -180°, lag or lead, degrees; `None` without a gain crossing.
    pub phase_margin_deg: Option<f64>,
    /// Frequency of the margin, `Hz`.
    pub crossover_hz: Option<f64>,
    /// Gain margin, factor; `None` if unlimited.
    pub gain_margin: Option<f64>,
    /// Bandwidth: frequency at which the closed loop from reference to position (velocity loop: to velocity) falls
    /// below 0.707, `Hz`; `None` without a measured reference or without a crossing.
    pub bandwidth_hz: Option<f64>,
}

/// Loop of an axis.
#[derive(Debug, Default)]
pub(crate) struct AxisLoop {
    pub(crate) station: usize,
    /// Index in the station.
    pub(crate) axis: usize,
    /// `None` if not linear.
    pub(crate) free: Option<LoopFigures>,
    /// Loop with every axis held by its wall; `None` without a wall.
    pub(crate) in_contact: Option<LoopFigures>,
}

impl AxisLoop {
    /// A nonlinear loop.
    pub(crate) fn unknown(station: usize, axis: usize) -> Self {
        Self { station, axis, ..Self::default() }
    }
}
