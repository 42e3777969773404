//! Output of the sub-commands, as text or JSON.

use std::fmt::{self, Display};
use std::fs::File;
use std::io::{self, Write};
use std::path::Path;

use clap::Args;
use serde::Serialize;

use super::live;
use crate::connect::{KeyReport, LiveReport, RecorderRows, SendOutcome, SignalReport};

#[derive(Debug, Args)]
pub(super) struct Json {
    /// Print only JSON to standard output, one line per answer.
    #[arg(long, global = true)]
    pub(super) json: bool,
}

impl Json {
    pub(super) fn print(&self, out: &mut impl Write, report: &(impl Display + Serialize)) -> io::Result<()> {
        if self.json {
            writeln!(out, "{}", serde_json::to_string(report)?)
        } else {
            writeln!(out, "{report}")
        }
    }
}

/// A scheme that was sent, with its file.
#[derive(Serialize)]
pub(super) struct SentFile {
    pub(super) file: String,
    pub(super) side: &'static str,
    #[serde(flatten)]
    pub(super) sent: SendOutcome,
}

impl Display for SentFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { file, side, sent } = self;
        write!(f, "{file}: sent {} rows for the {side}; {}", sent.rows, sent.state)
    }
}

/// The scheme of a device.
#[derive(Serialize)]
pub(super) struct SchemeRows {
    pub(super) rows: String,
}

impl Display for SchemeRows {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.rows.trim_end())
    }
}

/// State of a device's key, as a JSON object.
#[derive(Serialize)]
pub(super) struct KeyState {
    pub(super) key: KeyReport,
}

impl Display for KeyState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.key.fmt(f)
    }
}

/// Signals, with the device's state for `watch`.
#[derive(Serialize)]
pub(super) struct Look {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) live: Option<LiveReport>,
    pub(super) signals: Vec<SignalReport>,
}

impl Display for Look {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(live) = &self.live {
            writeln!(f, "{live}")?;
        }
        f.write_str(&live::lines(&self.signals))
    }
}

/// Rows written to a file, as JSON.
#[derive(Serialize)]
struct WrittenRows<'a> {
    file: &'a Path,
    recorder: &'a str,
    signal: &'a str,
    rows: usize,
    overwritten: u32,
}

/// Writes the rows of a recorder to a file or to `out`; notes go to the other output.
pub(super) fn write_recorded(
    recorded: &RecorderRows,
    file: Option<&Path>,
    json: &Json,
    out: &mut impl Write,
) -> io::Result<()> {
    let Some(path) = file else {
        if json.json {
            return writeln!(out, "{}", serde_json::to_string(recorded)?);
        }
        eprintln!("dimsart: note: {recorded}");
        return recorded.write_csv(out);
    };
    let written = File::create(path).and_then(|file| recorded.write_csv(file));
    written.map_err(|error| io::Error::other(format!("cannot write {}: {error}", path.display())))?;
    if json.json {
        let RecorderRows { recorder, signal, rows, overwritten, .. } = recorded;
        let written =
            WrittenRows { file: path, recorder, signal, rows: rows.len(), overwritten: *overwritten };
        return writeln!(out, "{}", serde_json::to_string(&written)?);
    }
    writeln!(out, "{}: {recorded}", path.display())
}
