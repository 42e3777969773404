//! Comparisons with a reference: deviations above the tolerance fail the test; all results are stored for
//! `cargo xtask step oracle`.

use std::path::Path;

use serde::{Deserialize, Serialize};

/// Maximum number of stored points of a curve.
const POINTS: usize = 1000;

/// Reads a file of the reference runs.
pub(crate) fn read<T: for<'a> Deserialize<'a>>(path: &Path) -> T {
    let text = std::fs::read_to_string(path).unwrap_or_else(|error| {
        panic!("{}: {error}; make the reference runs with `cargo xtask test`", path.display())
    });
    serde_json::from_str(&text).unwrap()
}

/// Reads the header and rows of a table.
pub(crate) fn table(path: &Path) -> (Vec<String>, Vec<Vec<f64>>) {
    let mut reader =
        csv::Reader::from_path(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let names = reader.headers().unwrap().iter().map(str::to_owned).collect();
    (names, reader.deserialize().map(Result::unwrap).collect())
}

/// Returns a column of a table.
pub(crate) fn column(rows: &[Vec<f64>], place: usize) -> Vec<f64> {
    rows.iter().map(|row| row[place]).collect()
}

/// The comparisons of a test.
pub(crate) struct Evidence {
    test: &'static str,
    rows: Vec<Row>,
    wrong: Vec<String>,
}

/// A comparison of a signal or quantity.
#[derive(Default)]
pub(crate) struct Compared<'a> {
    /// The module or the plant.
    pub(crate) subject: &'a str,
    /// The compared quantity.
    pub(crate) name: String,
    /// The reference implementation.
    pub(crate) oracle: &'a str,
    pub(crate) expected: &'a [f64],
    pub(crate) found: &'a [f64],
    /// The error is relative to this value; `None` for the maximum magnitude of the expected values.
    pub(crate) scale: Option<f64>,
    /// The permitted relative error.
    pub(crate) tolerance: f64,
    /// The reason for a tolerance other than 1e-5.
    pub(crate) why: &'a str,
    /// Time between two values, `s`; `None` if it is not a curve.
    pub(crate) period_s: Option<f64>,
}

impl<'a> Compared<'a> {
    /// A comparison of curves with scipy's integration.
    pub(crate) fn with_scipy(subject: &'a str, name: &str, tolerance: f64, period_s: f64) -> Self {
        Self {
            subject,
            name: name.to_owned(),
            oracle: "scipy",
            tolerance,
            period_s: Some(period_s),
            ..Self::default()
        }
    }
}

#[derive(Serialize)]
struct Row {
    subject: String,
    name: String,
    oracle: String,
    samples: usize,
    largest_error: f64,
    tolerance: f64,
    why: String,
    curve: Option<Curve>,
}

/// Expected and actual values, decimated.
#[derive(Serialize)]
struct Curve {
    time_s: Vec<f64>,
    expected: Vec<f64>,
    found: Vec<f64>,
}

impl Evidence {
    pub(crate) fn new(test: &'static str) -> Self {
        Self { test, rows: Vec::new(), wrong: Vec::new() }
    }

    /// Adds a comparison and whether it fails the test.
    pub(crate) fn judge(&mut self, of: &Compared<'_>) {
        let Compared { subject, name, expected, found, tolerance, .. } = of;
        assert_eq!(expected.len(), found.len(), "{subject}, {name}");
        assert!(!expected.is_empty(), "{subject}, {name}: nothing was compared");
        let errors = expected.iter().zip(*found).map(|(expected, found)| (expected - found).abs());
        // Unlike `max`, treats NaN as the worst error.
        let worst = errors.fold(0.0_f64, |worst, error| if error <= worst { worst } else { error });
        let peak = expected.iter().fold(0.0_f64, |peak, value| peak.max(value.abs()));
        let scale = of.scale.unwrap_or(peak);
        let share = if scale > 0.0 { worst / scale } else { worst };
        println!("{subject}, {name}: {share:.1e} of {scale:.1e}, {tolerance:.0e} allowed");
        if share.is_nan() || share > *tolerance {
            self.wrong.push(format!("{subject}, {name}: off by {share:.1e} of {scale:.1e}"));
        }
        self.rows.push(Row {
            subject: (*subject).to_owned(),
            name: name.clone(),
            oracle: of.oracle.to_owned(),
            samples: expected.len(),
            largest_error: share,
            tolerance: *tolerance,
            why: of.why.to_owned(),
            curve: of.period_s.map(|period_s| Curve::of(period_s, expected, found)),
        });
    }

    /// Compares each column with those at the end of the reference's table, for one case.
    pub(crate) fn judge_columns(
        &mut self,
        case: &Compared<'_>,
        (names, expected): &(Vec<String>, Vec<Vec<f64>>),
        found: &[Vec<f64>],
    ) {
        let first = names.len() - found[0].len();
        for (place, name) in names.iter().skip(first).enumerate() {
            self.judge(&Compared {
                name: format!("{}, {name}", case.name),
                expected: &column(expected, first + place),
                found: &column(found, place),
                ..*case
            });
        }
    }

    /// Writes the comparisons next to the reference runs.
    ///
    /// # Panics
    /// If a deviation exceeds its tolerance, or there is no comparison.
    pub(crate) fn end(self) {
        let folder = test_requirements::reference_runs("an oracle").unwrap().join("found");
        std::fs::create_dir_all(&folder).unwrap();
        let text = serde_json::to_string(&self.rows).unwrap();
        std::fs::write(folder.join(self.test).with_extension("json"), text).unwrap();
        assert!(!self.rows.is_empty(), "nothing was compared");
        assert!(self.wrong.is_empty(), "{:#?}", self.wrong);
    }
}

impl Curve {
    fn of(period_s: f64, expected: &[f64], found: &[f64]) -> Self {
        let step = expected.len().div_ceil(POINTS);
        let thin = |signal: &[f64]| signal.iter().step_by(step).copied().collect();
        #[expect(clippy::cast_precision_loss, reason = "ticks of a test")]
        let time_s = (0..expected.len()).step_by(step).map(|tick| tick as f64 * period_s).collect();
        Self { time_s, expected: thin(expected), found: thin(found) }
    }
}
