//! Jitter of the tick period, with a histogram.

use std::fmt::Write as _;

use serde::{Deserialize, Serialize};

use super::Check;

/// Tolerance of a period: 10 µs at 1 kHz.
const SHARE: f64 = 0.01;
/// Maximum bins of a histogram, and characters of its longest bar.
const BINS: f64 = 20.0;
const BAR: usize = 50;

/// Histogram with intervals of equal width.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Histogram {
    /// Title.
    pub title: String,
    /// Unit of the values.
    pub unit: String,
    /// Start of the first interval.
    pub begin: f64,
    /// Width of an interval.
    pub width: f64,
    /// Number of values in each interval.
    pub counts: Vec<usize>,
}

impl Histogram {
    /// Counts finite values in at most 21 intervals, whose width is 1, 2 or 5 times a power of ten.
    #[must_use]
    pub fn of(title: &str, unit: &str, values: &[f64]) -> Option<Self> {
        let least = values.iter().copied().reduce(f64::min)?;
        let most = values.iter().copied().reduce(f64::max)?;
        let wanted = ((most - least) / BINS).max(f64::MIN_POSITIVE);
        let decade = 10_f64.powf(wanted.log10().floor());
        let width =
            [1.0, 2.0, 5.0, 10.0].map(|step| step * decade).into_iter().find(|width| *width >= wanted)?;
        let begin = (least / width).floor() * width;
        let mut counts = Vec::new();
        for value in values {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 20")]
            let bin = ((value - begin) / width) as usize;
            counts.resize(counts.len().max(bin + 1), 0);
            if let Some(count) = counts.get_mut(bin) {
                *count += 1;
            }
        }
        Some(Self { title: title.to_owned(), unit: unit.to_owned(), begin, width, counts })
    }

    /// Formats a line per interval, with a bar.
    #[must_use]
    pub fn text(&self) -> String {
        let most = self.counts.iter().copied().max().unwrap_or(0).max(1);
        let mut text = String::new();
        for (bin, count) in (0_u32..).zip(&self.counts) {
            let begin = self.begin + f64::from(bin) * self.width;
            // Rounded up: a single value is visible.
            let bar = "#".repeat((count * BAR).div_ceil(most));
            let _ = writeln!(text, "{begin:>10.3} {} {count:>7} {bar}", self.unit);
        }
        text
    }
}

/// Checks the jitter of `periods_cycles` around their mean, which corresponds to `1 / hz`; the tick rate is a separate check.
pub(super) fn judge(name: &str, periods_cycles: &[f64], hz: f64) -> (Check, Option<Histogram>) {
    #[expect(clippy::cast_precision_loss, reason = "some thousands")]
    let count = periods_cycles.len() as f64;
    let mean = periods_cycles.iter().sum::<f64>() / count;
    let off_us: Vec<f64> = periods_cycles.iter().map(|cycles| (cycles / mean - 1.0) * 1e6 / hz).collect();
    let histogram = Histogram::of("Jitter of the tick period", "µs", &off_us);
    let Some(farthest) = off_us.iter().copied().max_by(|one, other| one.abs().total_cmp(&other.abs())) else {
        return (Check::not_run(name, "the device does not measure the tick period"), None);
    };
    let deviation = (off_us.iter().map(|off| off * off).sum::<f64>() / count).sqrt();
    let allowed = SHARE * 1e6 / hz;
    let check = Check::new(
        name,
        farthest.abs() <= allowed,
        format!(
            "{farthest:+.2} µs max deviation from the mean period of {mean:.0} cycles, standard deviation \
             {deviation:.2} µs, {count} ticks sampled"
        ),
        format!("max deviation {allowed} µs"),
        "find the cause of blocked interrupts: a debugger, a write to flash, or a critical section in your own code",
    );
    (check, histogram)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::commissioning::Verdict;

    #[test]
    fn every_value_is_in_the_interval_that_it_lies_in() {
        let values = [-0.9, -0.1, 0.0, 0.0, 0.3, 7.99];
        let histogram = Histogram::of("", "µs", &values).unwrap();
        assert!(
            (histogram.width - 0.5).abs() < 1e-12 && (histogram.begin + 1.0).abs() < 1e-12,
            "{histogram:?}"
        );
        assert_eq!(histogram.counts.iter().sum::<usize>(), values.len());
        assert_eq!(histogram.counts[..3], [1, 1, 3]);
        assert_eq!(histogram.counts.last(), Some(&1));
        assert_eq!(Histogram::of("", "", &[2.0; 9]).unwrap().counts, [9]);
        assert_eq!(Histogram::of("", "", &[]), None);
    }

    #[test]
    fn one_tick_that_begins_late_is_told_with_how_much() {
        let mut periods = vec![168_000.0; 999];
        let (check, _) = judge("", &periods, 1e3);
        assert_eq!(check.verdict, Verdict::Passed, "{check}");
        periods.push(168_000.0 + 12.0 * 168.0);
        let (check, histogram) = judge("", &periods, 1e3);
        assert!(check.verdict == Verdict::Failed && check.found.starts_with("+11.99 µs"), "{check}");
        assert_eq!(histogram.unwrap().counts.last(), Some(&1));
        assert_eq!(judge("", &[], 1e3).0.verdict, Verdict::NotRun);
    }
}
