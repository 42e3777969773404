//! A repetition of an experiment, and the return to its first values.

/// Signals run once through the experiment, then return to their first values without a jump.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Repetition {
    /// Time of the rig at which the experiment starts, `s`.
    pub start_s: f64,
    /// Time of its last tick since the start, `s`; infinite for an experiment that does not repeat.
    pub end_s: f64,
    /// Duration of the return, `s`.
    pub return_s: f64,
}

/// Rounding error of a tick's time, `s`.
const ROUNDING_S: f64 = 1e-9;

impl Repetition {
    /// The experiment runs once, from the start of the rig.
    pub const ONCE: Self = Self { start_s: 0.0, end_s: f64::INFINITY, return_s: 1.0 };

    /// The value of a signal at a time of the rig; `at` gives the experiment's, by its own time.
    pub fn value(&self, time_s: f64, at: impl Fn(f64) -> f64) -> f64 {
        let time_s = time_s - self.start_s;
        if time_s <= self.end_s + ROUNDING_S {
            return at(time_s);
        }
        let last = at(self.end_s);
        last + (at(0.0) - last) * minimum_jerk((time_s - self.end_s) / self.return_s)
    }
}

/// `10 t³ - 15 t⁴ + 6 t⁵`, 0 to 1 while `t` is.
#[must_use]
pub fn minimum_jerk(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * t * (10.0 + t * (-15.0 + 6.0 * t))
}

/// Peak speed of a [minimum-jerk](minimum_jerk) motion over its mean speed.
pub const PEAK_SPEED: f64 = 1.875;
