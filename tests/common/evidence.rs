//! What a comparison with an oracle found, kept for `cargo xtask oracle` to show.
#![expect(clippy::unwrap_used, reason = "in helpers of tests as in tests")]

use std::path::PathBuf;

use serde::Serialize;

/// Most points that are kept of a curve.
const POINTS: usize = 1000;

/// A row of the report.
#[derive(Serialize)]
pub(crate) struct Evidence {
    /// The module or the plant.
    pub subject: String,
    /// What was compared.
    pub name: String,
    /// What says what is right.
    pub oracle: String,
    /// Values that were compared.
    pub samples: usize,
    /// As a share of full scale.
    pub largest_error: f64,
    /// The same that is allowed.
    pub tolerance: f64,
    /// Why it is not 1e-5.
    pub why: String,
    /// The first axis.
    pub curve: Option<Curve>,
}

/// What was expected and what was found, laid over each other.
#[derive(Serialize)]
pub(crate) struct Curve {
    time_s: Vec<f64>,
    expected: Vec<f64>,
    found: Vec<f64>,
}

impl Curve {
    /// Of the first axis, thinned out.
    pub(crate) fn of(period_s: f64, expected: &[Vec<f64>], found: &[Vec<f64>]) -> Self {
        let step = expected.len().div_ceil(POINTS);
        let thin = |signal: &[Vec<f64>]| {
            signal.iter().step_by(step).filter_map(|row| row.first().copied()).collect()
        };
        #[expect(clippy::cast_precision_loss, reason = "ticks of a test")]
        let time_s = (0..expected.len()).step_by(step).map(|tick| tick as f64 * period_s).collect();
        Self { time_s, expected: thin(expected), found: thin(found) }
    }
}

/// Writes the rows of a test to where the oracle's files are; nowhere without one.
pub(crate) fn write(test: &str, rows: &[Evidence]) {
    let Some(folder) = std::env::var_os("DIMSART_ORACLE") else { return };
    let folder = PathBuf::from(folder).join("found");
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join(test).with_extension("json"), serde_json::to_string(rows).unwrap()).unwrap();
}
