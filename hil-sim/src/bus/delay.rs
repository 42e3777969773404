//! Network delays: constant, random, or recorded.

use std::path::{Path, PathBuf};

use super::random::Random;
use super::time::{NS_PER_S, seconds_to_ns};

/// Standard deviations above the mean for the upper bound of a gamma distribution.
const DEVIATIONS: f64 = 6.0;
/// Maximum delay, `s`.
const LONGEST_S: f64 = 3600.0;

/// Delay distribution; times in `s`.
#[derive(Debug, Clone, PartialEq)]
pub enum Delay {
    /// Constant.
    Constant(f64),
    /// Uniform from `min_s`, of width `width_s`.
    Uniform {
        /// Minimum.
        min_s: f64,
        /// Maximum minus minimum.
        width_s: f64,
    },
    /// `min_s` plus a gamma-distributed queueing time.
    Gamma {
        /// Minimum.
        min_s: f64,
        /// Mean queueing time, > 0.
        mean_s: f64,
        /// Shape, > 0: 1 is exponential, large values are bell-shaped.
        shape: f64,
    },
    /// Recorded sequence, repeated; `None` is a lost datagram.
    Recorded(Vec<Option<f64>>),
}

/// Invalid delays file.
#[derive(Debug, thiserror::Error)]
pub enum DelayFileError {
    /// The file cannot be read.
    #[error("{}: cannot read the delays ({reason}); set udp.delays_file to the path of a CSV file", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Reason.
        reason: String,
    },
    /// Invalid row.
    #[error(
        "{}:{line}: invalid delay `{value}`: the first column must be 0 s to 3600 s, or `lost`",
        path.display()
    )]
    NotADelay {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: u64,
        /// Text of the row.
        value: String,
    },
    /// No rows.
    #[error("{}: no delays found: write one per row, in seconds", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
}

impl Delay {
    /// Reads recorded delays: first column of a CSV file, in seconds, or `lost`. A header row and lines starting with
    /// `#` are skipped.
    ///
    /// # Errors
    /// [`DelayFileError`] with the line.
    pub fn read(path: &Path) -> Result<Self, DelayFileError> {
        let unreadable = |error: csv::Error| DelayFileError::Unreadable {
            path: path.to_owned(),
            reason: error.to_string(),
        };
        let reader =
            csv::ReaderBuilder::new().has_headers(false).comment(Some(b'#')).flexible(true).from_path(path);
        let mut delays = Vec::new();
        for (row, record) in reader.map_err(unreadable)?.records().enumerate() {
            let record = record.map_err(unreadable)?;
            let text = record.get(0).unwrap_or_default().trim();
            match text.parse::<f64>() {
                Ok(delay_s) if (0.0..=LONGEST_S).contains(&delay_s) => delays.push(Some(delay_s)),
                _ if text == "lost" => delays.push(None),
                Err(_) if row == 0 => {}
                _ => {
                    let line = record.position().map_or(0, csv::Position::line);
                    return Err(DelayFileError::NotADelay {
                        path: path.to_owned(),
                        line,
                        value: text.to_owned(),
                    });
                }
            }
        }
        if delays.is_empty() {
            Err(DelayFileError::Empty { path: path.to_owned() })
        } else {
            Ok(Self::Recorded(delays))
        }
    }

    /// Returns the maximum delay, or an upper bound for a gamma distribution, `s`.
    #[must_use]
    pub fn upper_s(&self) -> f64 {
        match self {
            Self::Constant(delay_s) => *delay_s,
            Self::Uniform { min_s, width_s } => min_s + width_s,
            Self::Gamma { min_s, mean_s, shape } => min_s + mean_s * (1.0 + DEVIATIONS / libm::sqrt(*shape)),
            Self::Recorded(delays) => delays.iter().flatten().copied().fold(0.0, f64::max),
        }
    }
}

/// Generates delays.
#[derive(Debug)]
pub(super) struct Delays {
    delay: Delay,
    drawn: usize,
}

impl Delays {
    pub(super) fn new(delay: Delay) -> Self {
        Self { delay, drawn: 0 }
    }

    /// Returns the next delay, `ns`; `None` for a recorded loss.
    pub(super) fn next_ns(&mut self, random: &mut Random) -> Option<u64> {
        let delay_s = match &self.delay {
            Delay::Constant(delay_s) => *delay_s,
            Delay::Uniform { min_s, width_s } => min_s + width_s * random.uniform(),
            Delay::Gamma { min_s, mean_s, shape } => min_s + mean_s / shape * random.gamma(*shape),
            Delay::Recorded(delays) => {
                let place = self.drawn % delays.len().max(1);
                self.drawn += 1;
                (*delays.get(place)?)?
            }
        };
        Some(seconds_to_ns(delay_s).min(3600 * NS_PER_S))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DRAWS: u32 = 20_000;

    fn draw(delay: Delay, seed: u64) -> Vec<f64> {
        let (mut delays, mut random) = (Delays::new(delay), Random::new(seed));
        let mut drawn: Vec<f64> =
            (0..DRAWS).map(|_| delays.next_ns(&mut random).unwrap() as f64 * 1e-9).collect();
        drawn.sort_by(f64::total_cmp);
        drawn
    }

    /// Kolmogorov and Smirnov: the largest distance from the distribution function, below its value for a chance of
    /// one in a thousand, and mean and variance within four standard errors.
    fn assert_distributed(
        drawn: &[f64],
        mean_s: f64,
        deviation_s: f64,
        kurtosis: f64,
        below: impl Fn(f64) -> f64,
    ) {
        let count = f64::from(DRAWS);
        let distance = (0..).zip(drawn).map(|(rank, value)| {
            let (rank, expected) = (f64::from(rank), below(*value));
            (expected - rank / count).max((rank + 1.0) / count - expected)
        });
        let distance = distance.fold(0.0, f64::max);
        assert!(distance < 1.95 / count.sqrt(), "distance {distance}");
        let mean = drawn.iter().sum::<f64>() / count;
        assert!((mean - mean_s).abs() < 4.0 * deviation_s / count.sqrt(), "mean {mean} for {mean_s}");
        let variance = drawn.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count;
        let error = deviation_s.powi(2) * ((kurtosis - 1.0) / count).sqrt();
        assert!((variance - deviation_s.powi(2)).abs() < 4.0 * error, "variance {variance}");
    }

    #[test]
    fn delays_are_distributed_as_their_closed_forms_say() {
        let drawn = draw(Delay::Uniform { min_s: 0.01, width_s: 0.005 }, 11);
        let below = |delay_s: f64| (delay_s - 0.01) / 0.005;
        assert_distributed(&drawn, 0.0125, 0.005 / 12.0_f64.sqrt(), 1.8, below);
        // A gamma distribution of whole shape is Erlang's: 1 - exp(-x) (1 + x + ... + x^(k-1)/(k-1)!).
        for shape in [1_u32, 2, 5] {
            let k = f64::from(shape);
            let drawn = draw(Delay::Gamma { min_s: 0.01, mean_s: 0.004, shape: k }, u64::from(shape));
            let below = |delay_s: f64| {
                let x = (delay_s - 0.01) * k / 0.004;
                let terms = (0..shape).scan(1.0, |term, n| {
                    let this = *term;
                    *term *= x / f64::from(n + 1);
                    Some(this)
                });
                1.0 - (-x).exp() * terms.sum::<f64>()
            };
            assert_distributed(&drawn, 0.014, 0.004 / k.sqrt(), 3.0 + 6.0 / k, below);
        }
        assert!(draw(Delay::Constant(0.02), 1).iter().all(|delay_s| (delay_s - 0.02).abs() < 1e-12));
    }

    #[test]
    fn the_upper_estimate_is_hardly_ever_exceeded() {
        for shape in [0.5, 1.0, 4.0] {
            let delay = Delay::Gamma { min_s: 0.01, mean_s: 0.004, shape };
            let upper_s = delay.upper_s();
            let beyond = draw(delay, 3).iter().filter(|delay_s| **delay_s > upper_s).count();
            // At shape 0.5, the widest: erfc(sqrt(0.5 + 6 sqrt(0.5))), 2.1 in 1000 draws.
            assert!(beyond < 60, "shape {shape}: {beyond}");
        }
    }

    #[test]
    fn recorded_delays_come_in_their_order_and_say_what_is_wrong_with_them() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("delays.csv");
        let read = |text: &str| {
            std::fs::write(&path, text).unwrap();
            Delay::read(&path)
        };
        let delay = read("delay_s,when\n# of Tuesday\n0.01,1\nlost,2\n0.02,3\n").unwrap();
        assert_eq!(delay, Delay::Recorded(vec![Some(0.01), None, Some(0.02)]));
        let (mut delays, mut random) = (Delays::new(delay), Random::new(1));
        let drawn: Vec<_> = (0..4).map(|_| delays.next_ns(&mut random)).collect();
        assert_eq!(drawn, [Some(10_000_000), None, Some(20_000_000), Some(10_000_000)]);
        let wrong = read("0.01\n-1\n").unwrap_err().to_string();
        assert!(wrong.contains("delays.csv:2: invalid delay `-1`"), "{wrong}");
        assert!(read("delay_s\n").unwrap_err().to_string().contains("no delays found"));
        let missing = Delay::read(&folder.path().join("none.csv")).unwrap_err().to_string();
        assert!(missing.contains("cannot read the delays"), "{missing}");
    }
}
