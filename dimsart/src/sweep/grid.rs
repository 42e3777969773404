//! Grid of a sweep: all combinations of the values of a few keys.

use std::str::FromStr;

/// A key and its values, as for `--set`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GridAxis {
    /// Key, or several keys joined by `+` with the same value.
    pub key: String,
    /// Values in order.
    pub values: Vec<String>,
}

/// Invalid keys or values.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{text}: {reason}")]
pub struct GridError {
    /// The invalid text.
    pub text: String,
    /// Error and correct form.
    pub reason: String,
}

/// Maximum number of points of a grid.
const MAX_POINTS: usize = 10_000_000;

impl FromStr for GridAxis {
    type Err = GridError;

    /// Parses `key=1,2,5`, `key=0:100:10` (from, to, step), or `key=log:1:1000:7` (from, to, count on a logarithmic scale).
    fn from_str(text: &str) -> Result<Self, GridError> {
        let refuse = |reason: &str| GridError { text: text.to_owned(), reason: reason.to_owned() };
        let usage = "expected KEY=A,B,C or KEY=FROM:TO:STEP or KEY=log:FROM:TO:COUNT";
        let (key, values) = text.split_once('=').ok_or_else(|| refuse(usage))?;
        let numbers = |parts: &str| parts.split(':').map(f64::from_str).collect::<Result<Vec<_>, _>>();
        let values = if let Some(parts) = values.strip_prefix("log:") {
            let Ok([from, to, count]) = <[f64; 3]>::try_from(numbers(parts).map_err(|_| refuse(usage))?)
            else {
                return Err(refuse(usage));
            };
            if !(from > 0.0 && to > 0.0 && (2.0..=1e5).contains(&count)) {
                return Err(refuse(
                    "a logarithmic scale needs FROM and TO above 0, and COUNT from 2 to 100000",
                ));
            }
            let at = |n: f64| from * libm::pow(to / from, n / (count - 1.0));
            steps(count).map(|n| number(at(n))).collect()
        } else if values.contains(':') {
            let Ok([from, to, step]) = <[f64; 3]>::try_from(numbers(values).map_err(|_| refuse(usage))?)
            else {
                return Err(refuse(usage));
            };
            let count = ((to - from) / step + 1e-9).floor() + 1.0;
            if !(1.0..=1e5).contains(&count) {
                return Err(refuse("STEP does not lead from FROM to TO within 100000 steps"));
            }
            steps(count).map(|n| number(from + n * step)).collect()
        } else {
            values.split(',').map(|value| value.trim().to_owned()).collect::<Vec<_>>()
        };
        let is_good = !key.is_empty() && values.iter().all(|value| !value.is_empty());
        if is_good { Ok(Self { key: key.to_owned(), values }) } else { Err(refuse(usage)) }
    }
}

fn steps(count: f64) -> impl Iterator<Item = f64> {
    (0..).map(f64::from).take_while(move |n: &f64| *n < count)
}

/// Formats a number as short as possible with nine digits, which hides rounding errors of sums.
fn number(value: f64) -> String {
    let rounded = format!("{value:.9e}").parse::<f64>().unwrap_or(value);
    format!("{rounded}")
}

/// Every combination of values; the last key changes fastest.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Grid {
    axes: Vec<GridAxis>,
}

impl Grid {
    /// Creates the grid of these keys.
    ///
    /// # Errors
    /// [`GridError`] for no keys, for a duplicate key, or for more than 10 million points.
    pub fn new(axes: Vec<GridAxis>) -> Result<Self, GridError> {
        let refuse =
            |text: &str, reason: &str| Err(GridError { text: text.to_owned(), reason: reason.to_owned() });
        if axes.is_empty() {
            return refuse("--vary", "specify at least one key with values");
        }
        for (place, axis) in axes.iter().enumerate() {
            if axes.iter().take(place).any(|other| other.key == axis.key) {
                return refuse(&axis.key, "duplicate key: give all values of a key in one --vary");
            }
        }
        let count = axes.iter().try_fold(1_usize, |count, axis| count.checked_mul(axis.values.len()));
        match count.filter(|count| *count <= MAX_POINTS) {
            Some(_) => Ok(Self { axes }),
            None => refuse("--vary", "the grid has more than 10 million points: use fewer values"),
        }
    }

    /// Returns the keys with their values.
    #[must_use]
    pub fn axes(&self) -> &[GridAxis] {
        &self.axes
    }

    /// Returns the number of points.
    #[must_use]
    pub fn points(&self) -> usize {
        self.axes.iter().map(|axis| axis.values.len()).product()
    }

    /// Returns the values of a point, in the order of the keys.
    #[must_use]
    pub fn values(&self, point: usize) -> Vec<String> {
        let mut rest = point;
        let mut values: Vec<String> = Vec::new();
        for axis in self.axes.iter().rev() {
            values.extend(axis.values.get(rest % axis.values.len()).cloned());
            rest /= axis.values.len();
        }
        values.reverse();
        values
    }

    /// Returns points with each value of each key once, combined with the first values of the other keys.
    pub fn samples(&self) -> impl Iterator<Item = usize> {
        let mut step = 1;
        self.axes.iter().rev().flat_map(move |axis| {
            let points = (0..axis.values.len()).map({
                let step = step;
                move |place| place * step
            });
            step *= axis.values.len();
            points
        })
    }

    /// Returns the settings of a point, as for `--set`.
    #[must_use]
    pub fn settings(&self, point: usize) -> Vec<String> {
        let pairs = self.axes.iter().zip(self.values(point));
        let settings = |(axis, value): (&GridAxis, String)| {
            axis.key.split('+').map(move |key| format!("{key}={value}")).collect::<Vec<_>>()
        };
        pairs.flat_map(settings).collect()
    }
}

/// A part of a grid: every Nth point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Number of the shard, from 1.
    pub number: usize,
    /// Number of shards.
    pub of: usize,
}

impl Shard {
    /// The whole grid.
    pub const WHOLE: Self = Self { number: 1, of: 1 };

    /// Returns its points. Neighbours are in different shards, as slow points are often adjacent.
    pub fn points(self, grid: &Grid) -> impl Iterator<Item = usize> + use<> {
        (self.number - 1..grid.points()).step_by(self.of)
    }
}

impl FromStr for Shard {
    type Err = GridError;

    fn from_str(text: &str) -> Result<Self, GridError> {
        let parts =
            text.split_once('/').and_then(|(number, of)| Some((number.parse().ok()?, of.parse().ok()?)));
        let reason = "expected NUMBER/COUNT, for example 1/16 to 16/16";
        match parts {
            Some((number, of)) if (1..=of).contains(&number) => Ok(Self { number, of }),
            _ => Err(GridError { text: text.to_owned(), reason: reason.to_owned() }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(text: &str) -> Vec<String> {
        text.parse::<GridAxis>().unwrap().values
    }

    #[test]
    fn values_are_a_list_a_range_or_a_logarithmic_one() {
        assert_eq!(values("wave.form=split, implicit"), ["split", "implicit"]);
        assert_eq!(values("k=0:1:0.25"), ["0", "0.25", "0.5", "0.75", "1"]);
        assert_eq!(values("k=0.1:0.3:0.1"), ["0.1", "0.2", "0.3"]);
        assert_eq!(values("k=log:1:1000:4"), ["1", "10", "100", "1000"]);
        for wrong in ["k", "=1", "k=", "k=1,,2", "k=1:2", "k=0:1:-1", "k=log:0:1:3", "k=a:b:c"] {
            assert!(wrong.parse::<GridAxis>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn shards_have_every_point_once() {
        let grid = Grid::new(vec!["a=1,2,3".parse().unwrap(), "b=1:7:1".parse().unwrap()]).unwrap();
        let both = Grid::new(vec!["a+b=1,2".parse().unwrap()]).unwrap();
        assert_eq!(both.settings(1), ["a=2", "b=2"]);
        assert_eq!(grid.points(), 21);
        assert_eq!(grid.settings(8), ["a=2", "b=2"]);
        let mut all: Vec<usize> = (1..=4).flat_map(|number| Shard { number, of: 4 }.points(&grid)).collect();
        all.sort_unstable();
        assert_eq!(all, (0..21).collect::<Vec<_>>());
        assert!("0/4".parse::<Shard>().is_err() && "5/4".parse::<Shard>().is_err());
    }
}
