//! How sub-commands print: tables as wide as the terminal, and JSON alone where a program reads.

use std::env;
use std::io::{self, Write};

use comfy_table::{ContentArrangement, Table, presets};

/// Columns where there is no terminal to ask.
const WIDTH: u16 = 120;

/// A table without rows that fits the terminal that it is printed to, or what the variable `COLUMNS` says.
pub(super) fn text_table() -> Table {
    let said = env::var("COLUMNS").ok().and_then(|columns| columns.parse().ok()).filter(|width| *width > 0);
    // Not of standard input: a program or test that reads the table may have been started from a terminal.
    let of_output = || terminal_size::terminal_size_of(io::stdout());
    let asked =
        || of_output().or_else(|| terminal_size::terminal_size_of(io::stderr())).map(|(width, _)| width.0);
    let mut table = Table::new();
    table.load_style(presets::UTF8_FULL_CONDENSED);
    table.set_content_arrangement(ContentArrangement::Dynamic);
    table.set_width(said.or_else(asked).unwrap_or(WIDTH));
    table
}

/// Writes what people read: to standard error where standard output is for JSON alone.
pub(super) fn say<E>(
    is_json: bool,
    out: &mut impl Write,
    text: impl FnOnce(&mut dyn Write) -> Result<(), E>,
) -> Result<(), E> {
    if is_json { text(&mut io::stderr().lock()) } else { text(out) }
}
