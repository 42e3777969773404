//! Output of sub-commands: tables as wide as the terminal, or JSON only.

use std::env;
use std::io::{self, Write};

use comfy_table::{ContentArrangement, Table, presets};

/// Default width without a terminal, columns.
const WIDTH: u16 = 120;

/// Creates an empty table as wide as the terminal, or as the variable `COLUMNS`.
pub(super) fn text_table() -> Table {
    let said = env::var("COLUMNS").ok().and_then(|columns| columns.parse().ok()).filter(|width| *width > 0);
    // Not standard input: a program that reads the table may run in a terminal.
    let of_output = || terminal_size::terminal_size_of(io::stdout());
    let asked =
        || of_output().or_else(|| terminal_size::terminal_size_of(io::stderr())).map(|(width, _)| width.0);
    let mut table = Table::new();
    table.load_style(presets::UTF8_FULL_CONDENSED);
    table.set_content_arrangement(ContentArrangement::Dynamic);
    table.set_width(said.or_else(asked).unwrap_or(WIDTH));
    table
}

/// Writes text for people: to standard error if standard output is for JSON.
pub(super) fn say<E>(
    is_json: bool,
    out: &mut impl Write,
    text: impl FnOnce(&mut dyn Write) -> Result<(), E>,
) -> Result<(), E> {
    if is_json { text(&mut io::stderr().lock()) } else { text(out) }
}
