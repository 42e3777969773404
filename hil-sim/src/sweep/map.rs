//! The map of a sweep over two keys: a field for each point, by what came of it.

use crate::report::{Field, FieldMap};

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
    let field = |low: &String, high: &String| {
        let row = table.rows.iter().find(|row| {
            row.first() == Some(high)
                && row.get(1) == Some(low)
                && first.iter().all(|(key, value)| of(key, row).as_deref() == Some(*value))
        });
        match row.and_then(|row| row.get(column)).map(String::as_str) {
            Some("true") => Field::Yes,
            Some("false") => Field::No,
            Some(text) => text.parse().map_or(Field::Nothing, Field::Number),
            None => Field::Nothing,
        }
    };
    let fields = down.values.iter().map(|high| right.values.iter().map(|low| field(low, high)).collect());
    let rest: String = first.iter().map(|(key, value)| format!(", {key} = {value}")).collect();
    Some(FieldMap {
        title: format!("{figure}{rest}"),
        down: (down.key.clone(), down.values.clone()),
        right: (right.key.clone(), right.values.clone()),
        fields: fields.collect(),
    })
}
