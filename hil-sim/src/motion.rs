//! Waveforms of signals over time.

use std::path::{Path, PathBuf};

use crate::plant::minimum_jerk;
use crate::rig_file::{Chirp, MinimumJerk, MoveSection, Prbs, Ramp, Sine, Step};

/// A move that can be evaluated at any time.
#[derive(Debug)]
pub(crate) enum Motion {
    Step(Step),
    Ramp(Ramp),
    MinimumJerk(MinimumJerk),
    Sine(Sine),
    Chirp(Chirp),
    Prbs { section: Prbs, bits: Vec<bool> },
    Samples { at_s: f64, rows: Vec<(f64, f64)> },
}

/// Invalid samples file.
#[derive(Debug, thiserror::Error)]
#[error("samples file {}: {reason}", path.display())]
pub struct SamplesError {
    /// The file.
    pub path: PathBuf,
    /// Reason, with the row.
    pub reason: String,
}

/// Sums all moves.
pub(crate) fn sum_at(motions: &[Motion], time_s: f64) -> f64 {
    motions.iter().map(|motion| motion.at(time_s)).sum()
}

impl Motion {
    /// Creates the move of a section; paths are relative to `folder`. A section without a waveform has no effect.
    ///
    /// # Errors
    /// [`SamplesError`] if the file is missing or a row is invalid.
    pub(crate) fn new(section: &MoveSection, folder: &Path) -> Result<Option<Self>, SamplesError> {
        let MoveSection { step, ramp, minimum_jerk, sine, chirp, prbs, samples, .. } = section.clone();
        let of_samples = samples.map(|samples| {
            let rows = read_samples(&folder.join(&samples.file))?;
            Ok(Self::Samples { at_s: samples.at_s, rows })
        });
        let of_prbs = prbs.map(|section| {
            let bits = bits((section.until_s - section.at_s) / section.bit_s);
            Self::Prbs { section, bits }
        });
        let others = [
            step.map(Self::Step),
            ramp.map(Self::Ramp),
            minimum_jerk.map(Self::MinimumJerk),
            sine.map(Self::Sine),
            chirp.map(Self::Chirp),
            of_prbs,
        ];
        match others.into_iter().flatten().next() {
            Some(motion) => Ok(Some(motion)),
            None => of_samples.transpose(),
        }
    }

    /// Returns its value at a time, `s`, in the unit of its signal.
    pub(crate) fn at(&self, time_s: f64) -> f64 {
        match self {
            Self::Step(Step { at_s, amplitude }) => {
                if time_s >= *at_s - LATE_S {
                    *amplitude
                } else {
                    0.0
                }
            }
            Self::Ramp(Ramp { at_s, until_s, amplitude }) => amplitude * share(time_s, *at_s, *until_s),
            Self::MinimumJerk(MinimumJerk { at_s, until_s, amplitude }) => {
                amplitude * minimum_jerk(share(time_s, *at_s, *until_s))
            }
            Self::Sine(Sine { at_s, until_s, amplitude, frequency_hz }) => {
                let is_on = (*at_s..*until_s).contains(&time_s);
                let angle = std::f64::consts::TAU * frequency_hz * (time_s - at_s);
                if is_on { amplitude * libm::sin(angle) } else { 0.0 }
            }
            Self::Chirp(Chirp { at_s, until_s, amplitude, from_hz, to_hz }) => {
                let is_on = (*at_s..*until_s).contains(&time_s);
                let t = time_s - at_s;
                let hz_per_s = (to_hz - from_hz) / (until_s - at_s);
                let angle = std::f64::consts::TAU * (from_hz + 0.5 * hz_per_s * t) * t;
                if is_on { amplitude * libm::sin(angle) } else { 0.0 }
            }
            Self::Prbs { section, bits } => {
                let place = (time_s - section.at_s + LATE_S) / section.bit_s;
                #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "not below 0")]
                let bit = (place >= 0.0).then(|| bits.get(place as usize)).flatten();
                bit.map_or(0.0, |bit| if *bit { section.amplitude } else { -section.amplitude })
            }
            Self::Samples { at_s, rows } => interpolate(rows, time_s - at_s),
        }
    }

    /// Whether its value is constant from `start_s` to `end_s` (exclusive).
    pub(crate) fn is_still(&self, start_s: f64, end_s: f64) -> bool {
        self.start_s() >= end_s - LATE_S || self.end_s() <= start_s + LATE_S
    }

    /// Returns its start time, `s`.
    pub(crate) fn start_s(&self) -> f64 {
        match self {
            Self::Step(Step { at_s, .. })
            | Self::Ramp(Ramp { at_s, .. })
            | Self::MinimumJerk(MinimumJerk { at_s, .. })
            | Self::Sine(Sine { at_s, .. })
            | Self::Chirp(Chirp { at_s, .. })
            | Self::Samples { at_s, .. } => *at_s,
            Self::Prbs { section, .. } => section.at_s,
        }
    }

    /// Returns the time after which its value is constant, `s`.
    pub(crate) fn end_s(&self) -> f64 {
        match self {
            Self::Step(Step { at_s, .. }) => *at_s,
            Self::Ramp(Ramp { until_s, .. })
            | Self::MinimumJerk(MinimumJerk { until_s, .. })
            | Self::Sine(Sine { until_s, .. })
            | Self::Chirp(Chirp { until_s, .. }) => *until_s,
            Self::Prbs { section, .. } => section.until_s,
            Self::Samples { at_s, rows } => at_s + rows.last().map_or(0.0, |(time_s, _)| *time_s),
        }
    }
}

/// Tolerance for rounding of tick times, `s`.
pub(crate) const LATE_S: f64 = 1e-9;

/// Progress from `at_s` to `until_s`, 0 to 1.
fn share(time_s: f64, at_s: f64, until_s: f64) -> f64 {
    ((time_s - at_s) / (until_s - at_s)).clamp(0.0, 1.0)
}

/// First bits of the maximum-length sequence of `x¹⁵ + x¹⁴ + 1`.
fn bits(count: f64) -> Vec<bool> {
    let mut register: u16 = 0x7FFF;
    let next = || {
        let bit = ((register >> 14) ^ (register >> 13)) & 1;
        register = ((register << 1) | bit) & 0x7FFF;
        bit == 1
    };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the file's check bounds it")]
    let count = count.ceil() as usize;
    std::iter::repeat_with(next).take(count).collect()
}

fn interpolate(rows: &[(f64, f64)], time_s: f64) -> f64 {
    let after = rows.partition_point(|(row_s, _)| *row_s <= time_s);
    let before = after.checked_sub(1).and_then(|place| rows.get(place));
    match (before, rows.get(after)) {
        (Some((from_s, from)), Some((to_s, to))) => from + (to - from) * share(time_s, *from_s, *to_s),
        (Some((_, value)), None) | (None, Some((_, value))) => *value,
        (None, None) => 0.0,
    }
}

fn read_samples(path: &Path) -> Result<Vec<(f64, f64)>, SamplesError> {
    let refuse = |reason: String| SamplesError { path: path.to_owned(), reason };
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .trim(csv::Trim::All)
        .from_path(path)
        .map_err(|error| refuse(error.to_string()))?;
    let mut rows: Vec<(f64, f64)> = Vec::new();
    for (place, record) in reader.records().enumerate() {
        let record = record.map_err(|error| refuse(error.to_string()))?;
        let number = |column: usize| {
            record.get(column).and_then(|cell| cell.parse().ok()).filter(|number: &f64| number.is_finite())
        };
        match number(0).zip(number(1)) {
            Some((time_s, _)) if rows.last().is_some_and(|(last_s, _)| *last_s >= time_s) => {
                return Err(refuse(format!(
                    "the time of row {}, {time_s} s, is not after the row above: sort by time",
                    place + 1
                )));
            }
            Some(row) => rows.push(row),
            None if place == 0 => {}
            None => {
                return Err(refuse(format!(
                    "row {} is invalid: write two finite numbers, the time in s and the value",
                    place + 1
                )));
            }
        }
    }
    if rows.is_empty() { Err(refuse("no samples: write rows of time, value".to_owned())) } else { Ok(rows) }
}

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "exact by construction")]
mod tests {
    use super::*;

    #[test]
    fn a_least_jerk_move_is_at_rest_at_both_ends_and_fastest_in_the_middle() {
        let motion = Motion::MinimumJerk(MinimumJerk { at_s: 1.0, until_s: 3.0, amplitude: 2.0 });
        let speed = |time_s: f64| (motion.at(time_s + 1e-6) - motion.at(time_s - 1e-6)) / 2e-6;
        assert_eq!([motion.at(0.0), motion.at(2.0), motion.at(5.0)], [0.0, 1.0, 2.0]);
        assert!(speed(1.0).abs() < 1e-4 && speed(3.0).abs() < 1e-4);
        assert!((speed(2.0) - 1.875 * 2.0 / 2.0).abs() < 1e-4, "{}", speed(2.0));
    }

    #[test]
    fn a_chirp_has_the_frequencies_at_its_ends() {
        let motion =
            Motion::Chirp(Chirp { at_s: 0.0, until_s: 10.0, amplitude: 1.0, from_hz: 1.0, to_hz: 20.0 });
        let crossings = |from_s: f64, to_s: f64| {
            let samples = (0..100_000).map(|n| motion.at(from_s + (to_s - from_s) * f64::from(n) / 1e5));
            let signs: Vec<bool> = samples.map(|value| value >= 0.0).collect();
            signs.windows(2).filter(|pair| pair[0] != pair[1]).count()
        };
        // Zero crossings of the first and last 0.1 s give twice the mean frequency.
        assert!((18..=20).contains(&crossings(9.5, 10.0)), "{}", crossings(9.5, 10.0));
        assert_eq!(crossings(0.0, 0.9), 3);
    }

    #[test]
    fn a_pseudo_random_sequence_has_the_longest_period_and_is_balanced() {
        let once = bits(32_767.0);
        let twice = bits(2.0 * 32_767.0);
        assert_eq!(once, twice[32_767..]);
        assert_eq!(once.iter().filter(|bit| **bit).count(), 16_384);
        let shorter =
            [31, 151, 217, 1057, 4681].iter().any(|period| once[..100] == once[*period..*period + 100]);
        assert!(!shorter);
    }

    #[test]
    fn samples_go_along_lines_and_stay_at_their_ends() {
        let rows = [(0.0, 1.0), (1.0, 3.0), (2.0, -1.0)];
        let values = [-1.0, 0.0, 0.5, 1.0, 1.5, 2.0, 9.0].map(|time_s| interpolate(&rows, time_s));
        assert_eq!(values, [1.0, 1.0, 2.0, 3.0, 1.0, -1.0, -1.0]);
    }

    #[test]
    fn a_file_of_samples_that_goes_back_in_time_is_refused_with_its_row() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("path.csv");
        std::fs::write(&path, "time (s), value\n0, 1\n1, 2\n0.5, 3\n").unwrap();
        let error = read_samples(&path).unwrap_err().to_string();
        assert!(error.contains("the time of row 4, 0.5 s, is not after the row above"), "{error}");
    }
}
