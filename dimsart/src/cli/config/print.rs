//! Differences as tables.

use std::io::{self, Write};

use super::super::output::text_table;
use crate::config::{ChangeKind, Deviation, Difference, UnknownRow};

/// Prints the differences from the defaults.
pub(super) fn print_deviations(
    out: &mut impl Write,
    name: &str,
    deviations: &[Deviation],
    unknown: &[UnknownRow],
) -> io::Result<()> {
    if deviations.is_empty() && unknown.is_empty() {
        return writeln!(out, "{name}: no modules");
    }
    let mut table = text_table();
    table.set_header(["", "module", "parameter", "value", "default"]);
    let mut last = "";
    for Deviation { place, module, parameter, value, default, unit } in deviations {
        let is_first = last != module;
        last = module;
        let place = match place {
            _ if !is_first => String::new(),
            Some(place) => place.to_string(),
            None => "-".to_owned(),
        };
        let parameter = parameter.as_deref().unwrap_or("all defaults");
        table.add_row([
            place,
            if is_first { module.clone() } else { String::new() },
            parameter.to_owned(),
            with_unit(value.as_deref().unwrap_or_default(), unit),
            with_unit(default.as_deref().unwrap_or_default(), unit),
        ]);
    }
    if !deviations.is_empty() {
        writeln!(out, "{table}")?;
    }
    print_unknown(out, name, unknown)
}

/// Prints the differences between two configurations.
pub(super) fn print_difference(
    out: &mut (impl Write + ?Sized),
    [from, to]: [&str; 2],
    difference: &Difference,
) -> io::Result<()> {
    if difference.is_empty() {
        return writeln!(out, "{from} and {to} are equal");
    }
    let mut table = text_table();
    table.set_header(["", "module", "parameter", from, to]);
    for change in &difference.changes {
        let is_place = change.change == ChangeKind::Moved;
        let place =
            |text: &String| if is_place { format!("position {text}") } else { with_unit(text, &change.unit) };
        table.add_row([
            change.change.name().to_owned(),
            change.module.clone(),
            change.parameter.clone().unwrap_or_default(),
            place(&change.from),
            place(&change.to),
        ]);
    }
    if !difference.changes.is_empty() {
        writeln!(out, "{table}")?;
    }
    print_unknown(out, from, &difference.unknown_removed)?;
    print_unknown(out, to, &difference.unknown_added)
}

/// Prints rows that this program does not know.
fn print_unknown(out: &mut (impl Write + ?Sized), name: &str, unknown: &[UnknownRow]) -> io::Result<()> {
    unknown.iter().try_for_each(|UnknownRow { line, column, row, reason }| {
        writeln!(out, "{name}:{line}:{column}: unknown row: {row}: {reason}")
    })
}

fn with_unit(value: &str, unit: &str) -> String {
    match (value, unit) {
        ("", _) | (_, "") => value.to_owned(),
        _ => format!("{value} {unit}"),
    }
}
