//! A force over a step: a parabola through its start, middle and end.

use core::ops::Add;

/// The force at four instants of a step.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Push {
    pub(super) start: f64,
    pub(super) quarter: f64,
    pub(super) middle: f64,
    pub(super) end: f64,
}

impl Push {
    /// A constant force.
    pub(super) fn held(force: f64) -> Self {
        Self { start: force, quarter: force, middle: force, end: force }
    }

    /// The parabola through three values.
    pub(super) fn parabola([start, middle, end]: [f64; 3]) -> Self {
        Self { start, quarter: 0.375 * start + 0.75 * middle - 0.125 * end, middle, end }
    }

    /// Whether the error of the parabola at the quarter exceeds `max`, or is unknown.
    pub(super) fn is_rougher_than(&self, max: f64) -> bool {
        let miss = (self.quarter - Self::parabola([self.start, self.middle, self.end]).quarter).abs();
        miss.is_nan() || miss > max
    }

    pub(super) fn scale(&self) -> f64 {
        self.start.abs() + self.middle.abs() + self.end.abs()
    }

    /// Deviation of its middle from the line between start and end.
    fn bulge(&self) -> f64 {
        self.middle - 0.5 * (self.start + self.end)
    }

    /// Upper bound of its total variation.
    pub(super) fn variation(&self) -> f64 {
        (self.end - self.start).abs() + 2.0 * self.bulge().abs()
    }

    /// Minimum and maximum.
    pub(super) fn range(&self) -> [f64; 2] {
        let bulge = self.bulge().abs();
        [self.start.min(self.end) - bulge, self.start.max(self.end) + bulge]
    }

    /// Start and slope of the line with the impulse of the parabola.
    pub(super) fn line(&self) -> [f64; 2] {
        [self.start + 2.0 / 3.0 * self.bulge(), self.end - self.start]
    }

    pub(super) fn first_half(&self) -> Self {
        Self::parabola([self.start, self.quarter, self.middle])
    }
}

impl Add for Push {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            start: self.start + other.start,
            quarter: self.quarter + other.quarter,
            middle: self.middle + other.middle,
            end: self.end + other.end,
        }
    }
}
