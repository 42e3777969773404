//! Runs a grid of settings on all cores: one row of figures per point, in a CSV file that can be continued.
//!
//! ```text
//! Grid (keys × values) ──▶ points of a shard ──▶ workers: one run each ──▶ rows ──▶ sweep.csv ──▶ map
//! ```
//! Every point is independent and reproducible on any machine: shards of a grid can run on different machines, and their
//! files can be merged.

mod file;
mod grid;
mod map;

use std::error::Error;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc;

pub use file::{SweepFile, SweepFileError, SweepTable};
pub use grid::{Grid, GridAxis, GridError, Shard};
pub use map::map;

use hil_sim::experiment::Experiment;
use hil_sim::rig_file::{RigFile, RigFileError};

/// Figures of a point, by name: a number, `true` or `false`, the reason of an unsettled figure, or empty.
pub type Figures = Vec<(String, String)>;

/// Reads the rig of a sweep with additional settings.
pub trait ReadRig: Fn(&[String]) -> Result<RigFile, RigFileError> + Sync {}

impl<F: Fn(&[String]) -> Result<RigFile, RigFileError> + Sync> ReadRig for F {}

/// Checks that a rig accepts every value of the grid.
///
/// # Errors
/// As `rig`; [`GridError`] when a key or value of the grid is wrong.
pub fn check(rig: impl ReadRig, grid: &Grid) -> Result<(), Box<dyn Error>> {
    for point in grid.samples() {
        let settings = grid.settings(point);
        if let Err(error) = rig(&settings) {
            rig(&[])?;
            let text = format!("--vary, at {}", settings.join(" "));
            return Err(GridError { text, reason: error.to_string() }.into());
        }
    }
    Ok(())
}

/// Runs the rig with these settings.
fn run(rig: impl ReadRig, settings: &[String]) -> Result<Figures, String> {
    let file = rig(settings).map_err(|error| error.to_string())?;
    let experiment = Experiment::new(&file).map_err(|error| error.to_string())?;
    let outcome = experiment.without_recording().run(&AtomicBool::new(false), |_| ()).outcome;
    let outcome = serde_json::to_value(outcome).map_err(|error| error.to_string())?;
    let mut figures = Vec::new();
    flatten("", &outcome, &mut figures);
    Ok(figures)
}

/// Omitted top-level figures: they depend on this machine or repeat other figures.
const LEFT_OUT: [&str; 5] =
    ["wall_s", "realtime_factor", "k_perceived_n_per_m", "k_predicted_n_per_m", "real_time"];

/// Texts that are kept: limits of a figure's validity.
const KEPT_TEXTS: [&str; 1] = ["unsettled"];

/// Collects numbers and booleans by path: `axes.0.rise_time_s`. A list of texts becomes its length.
fn flatten(name: &str, value: &serde_json::Value, figures: &mut Figures) {
    use serde_json::Value;
    let below = |key: &str| if name.is_empty() { key.to_owned() } else { format!("{name}.{key}") };
    match value {
        Value::Object(entries) => {
            let is_kept = |key: &str| !(name.is_empty() && LEFT_OUT.contains(&key));
            for (key, value) in entries.iter().filter(|(key, _)| is_kept(key)) {
                flatten(&below(key), value, figures);
            }
        }
        Value::Array(_)
            if ["faults", "limit_cycles", "media", "received", "saturated", "undecided", "warnings"]
                .contains(&name) =>
        {
            let count = value.as_array().map_or(0, Vec::len);
            figures.push((name.to_owned(), count.to_string()));
        }
        Value::Array(entries) => {
            for (place, value) in entries.iter().enumerate() {
                flatten(&below(&place.to_string()), value, figures);
            }
        }
        Value::Null => figures.push((name.to_owned(), String::new())),
        Value::Bool(_) | Value::Number(_) => figures.push((name.to_owned(), value.to_string())),
        Value::String(text) if KEPT_TEXTS.iter().any(|kept| name.rsplit('.').next() == Some(*kept)) => {
            figures.push((name.to_owned(), text.clone()));
        }
        Value::String(_) => {}
    }
}

/// Runs every point of the shard that is missing in `file`, with one thread per core, until `stop` is set. Calls `progress`
/// after each point.
///
/// # Errors
/// A write error, or settings and error of the first point that cannot run. Finished points are in the file.
pub fn sweep(
    rig: impl ReadRig,
    grid: &Grid,
    shard: Shard,
    file: &mut SweepFile,
    stop: &AtomicBool,
    mut progress: impl FnMut(),
) -> Result<(), String> {
    let todo: Vec<usize> = shard.points(grid).filter(|point| !file.has(&grid.values(*point))).collect();
    let next = AtomicUsize::new(0);
    let threads = std::thread::available_parallelism().map_or(1, usize::from).min(todo.len().max(1));
    std::thread::scope(|scope| {
        let (sender, receiver) = mpsc::channel();
        for _ in 0..threads {
            let (sender, next, todo, rig) = (sender.clone(), &next, &todo, &rig);
            scope.spawn(move || {
                while !stop.load(Ordering::Relaxed) {
                    let Some(point) = todo.get(next.fetch_add(1, Ordering::Relaxed)) else { break };
                    if sender.send((*point, run(rig, &grid.settings(*point)))).is_err() {
                        break;
                    }
                }
            });
        }
        drop(sender);
        // The loop ends with the last worker; an error ends all workers.
        for (point, figures) in receiver {
            let at = || grid.settings(point).join(" ");
            let written = figures.map_err(|error| format!("{}: {error}", at())).and_then(|figures| {
                file.add(&grid.values(point), &figures).map_err(|error| error.to_string())
            });
            if written.is_err() {
                stop.store(true, Ordering::Relaxed);
            }
            written?;
            progress();
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn why_a_figure_is_not_settled_is_a_figure_and_other_texts_are_none() {
        let figures = |unsettled: serde_json::Value| {
            let felt = serde_json::json!({ "device": "arm", "stiffness": 2.5, "unsettled": unsettled });
            let mut figures = Vec::new();
            flatten("", &serde_json::json!({ "stable": true, "perceived": [felt] }), &mut figures);
            figures
        };
        let expected = |unsettled: &str| {
            let rows =
                [("perceived.0.stiffness", "2.5"), ("perceived.0.unsettled", unsettled), ("stable", "true")];
            rows.map(|(name, value)| (name.to_owned(), value.to_owned())).to_vec()
        };
        assert_eq!(figures(serde_json::json!("it moves by 3 mm")), expected("it moves by 3 mm"));
        assert_eq!(figures(serde_json::Value::Null), expected(""));
    }
}
