//! Figures of a step response.
//!
//! `before` and `after` are the reference's values around its step, sampled per tick. Crossings between two ticks are
//! interpolated linearly.

/// Settling band, as a share of the step.
const BAND: f64 = 0.02;
/// Levels of the rise time, as shares of the step.
const RISE: [f64; 2] = [0.1, 0.9];
/// Minimum share of the time inside the band.
const STAYED: f64 = 0.1;

/// The figures of one step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct StepFigures {
    /// Rise time, 10 % to 90 %, `s`; `None` if 90 % is not reached.
    pub(super) rise_time_s: Option<f64>,
    /// Overshoot, as a share of the step.
    pub(super) overshoot: f64,
    /// Settling time to 2 %, `s`; `None` if not reached, or not kept for 10 % of the time, as an oscillation is in
    /// the band at times.
    pub(super) settling_time_s: Option<f64>,
}

/// Observes one step.
#[derive(Debug)]
pub(super) struct StepResponse {
    at_s: f64,
    /// Time of the next other move, `s`.
    until_s: f64,
    before: f64,
    after: f64,
    /// Time and share of the step of the last tick.
    last: Option<(f64, f64)>,
    risen_s: [Option<f64>; 2],
    most: f64,
    /// Last time of entry into the band.
    inside_s: Option<f64>,
}

impl StepResponse {
    pub(super) fn new(at_s: f64, until_s: f64, before: f64, after: f64) -> Self {
        let (last, risen_s, inside_s) = (None, [None; 2], None);
        Self { at_s, until_s, before, after, last, risen_s, most: 0.0, inside_s }
    }

    /// Adds the response at a time.
    pub(super) fn add(&mut self, time_s: f64, value: f64) {
        if time_s < self.at_s || time_s >= self.until_s {
            return;
        }
        let share = (value - self.before) / (self.after - self.before);
        let before = self.last.replace((time_s, share));
        for (risen_s, level) in self.risen_s.iter_mut().zip(RISE) {
            if risen_s.is_none() && share >= level {
                *risen_s = Some(crossing_s(before, (time_s, share), level));
            }
        }
        self.most = self.most.max(share - 1.0);
        let is_inside = (share - 1.0).abs() <= BAND;
        let entry = if share > 1.0 { 1.0 + BAND } else { 1.0 - BAND };
        let came = || crossing_s(before, (time_s, share), entry);
        self.inside_s = is_inside.then(|| self.inside_s.unwrap_or_else(came));
    }

    /// Returns the figures.
    pub(super) fn figures(&self) -> StepFigures {
        let [tenth_s, max_s] = self.risen_s;
        let end_s = self.last.map_or(self.at_s, |(time_s, _)| time_s);
        let has_stayed = |inside_s: f64| end_s - inside_s >= STAYED * (end_s - self.at_s);
        StepFigures {
            rise_time_s: tenth_s.zip(max_s).map(|(from_s, to_s)| to_s - from_s),
            overshoot: self.most,
            settling_time_s: self
                .inside_s
                .filter(|inside_s| has_stayed(*inside_s))
                .map(|inside_s| inside_s - self.at_s),
        }
    }
}

/// Returns the interpolated time of a level crossing since the last tick.
fn crossing_s(before: Option<(f64, f64)>, (time_s, share): (f64, f64), level: f64) -> f64 {
    let Some((from_s, from)) = before else { return time_s };
    let part = (level - from) / (share - from);
    if (0.0..=1.0).contains(&part) { from_s + part * (time_s - from_s) } else { time_s }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figures(response: impl Fn(f64) -> f64, end_s: f64) -> StepFigures {
        let mut step = StepResponse::new(0.1, end_s, 1.0, 3.0);
        for tick in 0..20_000 {
            let time_s = f64::from(tick) * 1e-3;
            if time_s < end_s {
                step.add(time_s, 1.0 + 2.0 * if time_s > 0.1 { response(time_s - 0.1) } else { 0.0 });
            }
        }
        step.figures()
    }

    /// Ogata, Modern Control Engineering, section 5-3: first order.
    #[test]
    fn of_a_first_order_lag() {
        let StepFigures { rise_time_s, overshoot, settling_time_s } =
            figures(|t| 1.0 - libm::exp(-t / 0.2), 5.0);
        assert!((rise_time_s.unwrap() - 0.2 * libm::log(9.0)).abs() < 1e-5, "{rise_time_s:?}");
        assert!((settling_time_s.unwrap() - 0.2 * libm::log(50.0)).abs() < 1e-5, "{settling_time_s:?}");
        assert!(overshoot <= 0.0);
    }

    /// Ogata, section 5-3: second order, underdamped.
    #[test]
    fn of_a_second_order_lag() {
        let (damping, rad_per_s) = (0.4_f64, 20.0);
        let damped = (1.0 - damping * damping).sqrt();
        let response = |t: f64| {
            let angle = rad_per_s * damped * t;
            1.0 - libm::exp(-damping * rad_per_s * t)
                * (libm::cos(angle) + damping / damped * libm::sin(angle))
        };
        let found = figures(response, 5.0);
        let overshoot = libm::exp(-std::f64::consts::PI * damping / damped);
        assert!((found.overshoot - overshoot).abs() < 1e-4, "{}", found.overshoot);
        // Last entry into the band, found by bisection of the formula.
        let last_out =
            (0..500_000).rev().map(|n| f64::from(n) * 1e-5).find(|t| (response(*t) - 1.0).abs() > 0.02);
        assert!((found.settling_time_s.unwrap() - last_out.unwrap()).abs() < 1e-4, "{found:?} {last_out:?}");
    }

    #[test]
    fn what_never_gets_there_has_no_times() {
        let found = figures(|t| 0.5 * (1.0 - libm::exp(-t)), 5.0);
        assert_eq!((found.rise_time_s, found.settling_time_s), (None, None));
        let swings = figures(|t| 1.0 + 0.1 * libm::sin(50.0 * t), 5.0);
        assert_eq!(swings.settling_time_s, None);
    }
}
