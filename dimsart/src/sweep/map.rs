//! The map of a sweep over two keys: a field for each point, by what came of it.

use crate::report::{Field, FieldMap, contour};

use super::Grid;
use super::file::SweepTable;

/// The map of `figure` over the first two keys; none when there are not two, or no such figure.
///
/// Where there are more keys, it is of the first value of each other one.
#[must_use]
pub fn map(grid: &Grid, table: &SweepTable, figure: &str) -> Option<FieldMap> {
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
        Some("true") => Field::Yes,
        Some("false") => Field::No,
        Some(text) => text.parse().map_or(Field::Nothing, Field::Number),
        None => Field::Nothing,
    };
    let fields = down.values.iter().map(|high| right.values.iter().map(|low| field(low, high)).collect());
    let is_growth = |name: &String| {
        let is_contact = name.starts_with("axes.") && name.ends_with(".contact_growth_per_tick");
        is_contact
            || ["loops.", "axes."].iter().any(|of| name.starts_with(of)) && name.ends_with(".growth_per_tick")
    };
    let growths: Vec<usize> =
        table.header.iter().enumerate().filter(|(_, name)| is_growth(name)).map(|(at, _)| at).collect();
    // NaN where no loop has a growth: there is no border beside it.
    let growth = |row: &Vec<String>| {
        let known = growths.iter().filter_map(|column| row.get(*column)?.parse::<f64>().ok());
        known.fold(f64::NAN, f64::max) - 1.0
    };
    let growing = down.values.iter().map(|high| {
        right.values.iter().map(|low| row(low, high).map_or(f64::NAN, growth)).collect::<Vec<_>>()
    });
    let border = contour(&growing.collect::<Vec<_>>());
    let rest: String = first.iter().map(|(key, value)| format!(", {key} = {value}")).collect();
    Some(FieldMap {
        title: format!("{figure}{rest}"),
        down: (down.key.clone(), down.values.clone()),
        right: (right.key.clone(), right.values.clone()),
        fields: fields.collect(),
        border: ("largest eigenvalue 1: beyond it a loop grows".to_owned(), border),
    })
}
