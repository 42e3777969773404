//! Recordings of joints from CSV files.

use std::path::Path;

use hil_sim::identify::ForceTiming;
use hil_sim::untrusted_text::escape_line;

use super::{Identify, Joint, Truth};
use crate::cli::UsageError;

impl Identify {
    /// Reads a recording of `dimsart run`, or of a board.
    pub(super) fn read(&self, path: &Path) -> Result<Vec<Joint>, Box<dyn std::error::Error>> {
        let wrong = |reason: String| UsageError(format!("{}: {reason}", path.display()));
        if path.extension().is_none_or(|extension| extension != "csv") {
            let reason = "neither a rig nor a CSV recording: record with `dimsart run --signals csv` or \
                          `dimsart record --signals csv`";
            return Err(wrong(reason.to_owned()).into());
        }
        let mut reader = csv::Reader::from_path(path)
            .map_err(|error| format!("cannot read {}: {error}", path.display()))?;
        let headers = reader.headers()?.clone();
        let rows: Vec<csv::StringRecord> = reader.records().collect::<Result<_, _>>()?;
        let place = |signal: &str, axis: usize| {
            let end = format!(".{signal}[{axis}] ");
            let is_it = |header: &str| {
                let of_controller =
                    self.controller.as_ref().is_none_or(|name| header.starts_with(&format!("{name}.")));
                of_controller && header.contains(&end)
            };
            headers.iter().position(is_it)
        };
        let column = |place: usize| -> Result<Vec<f64>, UsageError> {
            let header = headers.get(place).unwrap_or_default();
            let scale = scale(header).map_err(wrong)?;
            let value = |(row, record): (usize, &csv::StringRecord)| {
                let text = record.get(place).unwrap_or_default();
                let value: Option<f64> = text.trim().parse().ok().filter(|value: &f64| value.is_finite());
                let problem = || {
                    let (text, header, row) = (escape_line(text), escape_line(header), row + 2);
                    format!(
                        "row {row}, column {header}: '{text}' is not a finite number: correct the value, or delete a first \
                         or last row"
                    )
                };
                value.map(|value| scale * value).ok_or_else(|| wrong(problem()))
            };
            rows.iter().enumerate().map(value).collect()
        };
        let positions: Vec<usize> = (0..).map_while(|axis| place("POSITION", axis)).collect();
        let coupled: Option<Vec<Vec<f64>>> =
            self.coupled.then(|| positions.iter().map(|place| column(*place)).collect()).transpose()?;
        let time = headers.iter().position(|header| header.trim_start().starts_with("time"));
        let time = time.ok_or_else(|| wrong("no time column: name the time column `time (s)`".to_owned()))?;
        let period_s = period_s(&column(time)?).map_err(wrong)?;
        let joint = |axis: usize| -> Result<Joint, Box<dyn std::error::Error>> {
            let missing = |signal: &str| {
                wrong(format!("no column {signal} of axis {axis}: record the signal, or correct --axis"))
            };
            let position = *positions.get(axis).ok_or_else(|| missing("POSITION"))?;
            let (force, is_measured) = match (place("FORCE", axis), place("DES_FORCE", axis)) {
                (Some(measured), _) => (measured, true),
                (None, Some(commanded)) => (commanded, false),
                (None, None) => return Err(missing("FORCE or DES_FORCE").into()),
            };
            let header = headers.get(position).unwrap_or_default();
            let delay_ticks = self.delay_ticks;
            Ok(Joint {
                name: format!("{}, axis {axis}", escape_line(header.split('.').next().unwrap_or_default())),
                period_s,
                position: column(position)?,
                force: column(force)?,
                force_timing: if is_measured {
                    ForceTiming::Measured
                } else {
                    ForceTiming::Held { delay_ticks }
                },
                turns: !LENGTHS.contains(&column_unit(header)),
                coupled: coupled.clone().map(|positions| (axis, positions)),
                truth: Truth::Unknown,
            })
        };
        self.axes(self.coupled.then_some(positions.len())).map(joint).collect()
    }
}

/// The unit of a column: `deg` of `arm.POSITION[0] (deg)`, `s` of `time_s`.
fn column_unit(header: &str) -> &str {
    let in_brackets = header.rsplit_once('(').and_then(|(_, rest)| rest.trim_end().strip_suffix(')'));
    in_brackets.or_else(|| header.strip_prefix("time_")).unwrap_or_default().trim()
}

/// Units of length.
const LENGTHS: [&str; 2] = ["m", "mm"];

/// Factor that converts a column to s, rad, m, N m or N.
fn scale(header: &str) -> Result<f64, String> {
    match column_unit(header) {
        "s" | "rad" | "m" | "N·m" | "N m" | "Nm" | "N" => Ok(1.0),
        "ms" | "mm" | "mN·m" | "mN m" | "mNm" | "mN" => Ok(1e-3),
        "us" | "µs" => Ok(1e-6),
        "deg" | "°" => Ok(std::f64::consts::PI / 180.0),
        unit => Err(format!(
            "unknown unit '{}' of column {}: use s, ms, us, rad, deg, m, mm, N·m, mN·m, N or mN, in parentheses after the name",
            escape_line(unit),
            escape_line(header)
        )),
    }
}

/// Time between two rows, which must be constant within 1 %.
pub(super) fn period_s(times_s: &[f64]) -> Result<f64, String> {
    let (Some(first), Some(last @ 1..)) = (times_s.first(), times_s.len().checked_sub(1)) else {
        return Err("fewer than two rows: record longer".to_owned());
    };
    let rows =
        i32::try_from(last).map_err(|error| format!("too many rows ({error}): shorten the recording"))?;
    let period_s = (times_s.last().unwrap_or(first) - first) / f64::from(rows);
    let is_uneven = |pair: &[f64]| !matches!(pair, [one, other] if period_s > 0.0 && ((other - one) / period_s - 1.0).abs() < 0.01);
    match times_s.windows(2).position(is_uneven) {
        None => Ok(period_s),
        Some(row) => {
            let apart_s =
                times_s.get(row + 1).zip(times_s.get(row)).map_or(f64::NAN, |(other, one)| other - one);
            Err(format!(
                "row {} is {:.4} ms after the previous row, the mean interval is {:.4} ms: rows must be evenly spaced; resample the \
                 file, for example with `numpy.interp`",
                row + 3,
                1e3 * apart_s,
                1e3 * period_s
            ))
        }
    }
}
