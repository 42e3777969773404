//! Map of a sweep over two keys, one field per point.

use crate::report::{Boundary, CellValue, SweepMap, contour};

use super::Grid;
use super::file::SweepTable;

/// A theoretical border, where one figure of a run equals another.
struct Theory {
    figure: &'static str,
    limit: &'static str,
    /// Labels with a border, and without one for maps on either side of it.
    line: &'static str,
    all_within: &'static str,
    all_beyond: &'static str,
}

const THEORIES: [Theory; 2] = [
    Theory {
        figure: "theory.round_trip_ticks",
        limit: "theory.delay_margin_ticks",
        line: "theory: round trip = delay margin",
        all_within: "theory: all round trips below the delay margin",
        all_beyond: "theory: all round trips beyond the delay margin",
    },
    Theory {
        figure: "theory.needed_damping",
        limit: "theory.damping",
        line: "theory: b = K h/2; passive with more damping",
        all_within: "theory: passive in all fields, b >= K h/2",
        all_beyond: "theory: not passive in any field, b < K h/2",
    },
];

/// Creates the map of `figure` over the first two keys; `None` with fewer keys or an unknown figure.
///
/// Further keys have their first value.
#[must_use]
pub fn map(grid: &Grid, table: &SweepTable, figure: &str) -> Option<SweepMap> {
    let [down, right] = grid.axes().get(..2)? else { return None };
    let column = table.header.iter().position(|name| name == figure)?;
    let of = |name: &str, row: &Vec<String>| {
        let column = table.header.iter().position(|known| known == name)?;
        row.get(column).cloned()
    };
    let first: Vec<(&str, &str)> = grid
        .axes()
        .iter()
        .skip(2)
        .filter_map(|axis| Some((axis.key.as_str(), axis.values.first()?.as_str())))
        .collect();
    let row = |low: &String, high: &String| {
        table.rows.iter().find(|row| {
            row.first() == Some(high)
                && row.get(1) == Some(low)
                && first.iter().all(|(key, value)| of(key, row).as_deref() == Some(*value))
        })
    };
    let field = |low: &String, high: &String| match row(low, high)
        .and_then(|row| row.get(column))
        .map(String::as_str)
    {
        Some("true") => CellValue::Yes,
        Some("false") => CellValue::No,
        Some(text) => text.parse().map_or(CellValue::Nothing, CellValue::Number),
        None => CellValue::Nothing,
    };
    let fields = down.values.iter().map(|high| right.values.iter().map(|low| field(low, high)).collect());
    let number = |row: &Vec<String>, column: usize| row.get(column)?.parse::<f64>().ok();
    // NaN without a figure: no border next to it.
    let excesses = |excess: &dyn Fn(&Vec<String>) -> Option<f64>| -> Vec<Vec<f64>> {
        let of_field = |low: &String, high: &String| row(low, high).and_then(excess).unwrap_or(f64::NAN);
        down.values.iter().map(|high| right.values.iter().map(|low| of_field(low, high)).collect()).collect()
    };
    let growths: Vec<usize> =
        table.header.iter().enumerate().filter(|(_, name)| is_growth(name)).map(|(at, _)| at).collect();
    let growth = excesses(&|row| {
        growths.iter().filter_map(|column| number(row, *column)).reduce(f64::max).map(|growth| growth - 1.0)
    });
    let growing =
        Boundary { label: "largest eigenvalue 1: unstable beyond".to_owned(), pieces: contour(&growth) };
    let by_theory = THEORIES.iter().filter_map(|theory| {
        let place = |name: &str| table.header.iter().position(|known| known == name);
        let (figure, limit) = (place(theory.figure)?, place(theory.limit)?);
        // Without a limit, no value exceeds it.
        let excess =
            |row: &Vec<String>| Some(number(row, figure)? - number(row, limit).unwrap_or(f64::INFINITY));
        let excesses = excesses(&excess);
        let pieces = contour(&excesses);
        let all = |is_so: fn(f64) -> bool| excesses.iter().flatten().all(|excess| is_so(*excess));
        let label = match pieces.is_empty() {
            false => theory.line,
            true if all(|excess| excess <= 0.0) => theory.all_within,
            true if all(|excess| excess > 0.0) => theory.all_beyond,
            // A single row, or fields without a theoretical value.
            true => return None,
        };
        Some(Boundary { label: label.to_owned(), pieces })
    });
    let borders = Some(growing).filter(|growing| !growing.pieces.is_empty()).into_iter().chain(by_theory);
    let rest: String = first.iter().map(|(key, value)| format!(", {key} = {value}")).collect();
    Some(SweepMap {
        title: format!("{figure}{rest}"),
        y_axis: (down.key.clone(), down.values.clone()),
        x_axis: (right.key.clone(), right.values.clone()),
        cells: fields.collect(),
        borders: borders.collect(),
    })
}

fn is_growth(name: &str) -> bool {
    let is_contact = name.starts_with("axes.") && name.ends_with(".contact_growth_per_tick");
    let is_of_loop = ["loops.", "axes."].iter().any(|of| name.starts_with(of));
    is_contact || is_of_loop && name.ends_with(".growth_per_tick")
}
