//! The report: facts and checks, as Markdown and JSON.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::{Check, Histogram, Verdict};

/// Results of all checks of a board.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Expected board.
    pub board: String,
    /// Whether no check failed.
    pub is_well: bool,
    /// Whether the board was an emulated chip.
    pub is_emulated: bool,
    /// Names and versions of hardware and software.
    pub facts: Vec<(String, String)>,
    /// The checks, in order.
    pub checks: Vec<Check>,
    /// Histograms of measurements.
    pub histograms: Vec<Histogram>,
    /// File names of pictures.
    pub pictures: Vec<String>,
}

impl Report {
    /// Creates a report with the results so far.
    #[must_use]
    pub fn new(board: &str, is_emulated: bool, facts: Vec<(String, String)>, checks: Vec<Check>) -> Self {
        let mut report = Self {
            board: board.to_owned(),
            is_well: true,
            is_emulated,
            facts,
            checks: Vec::new(),
            histograms: Vec::new(),
            pictures: Vec::new(),
        };
        report.add(checks);
        report
    }

    /// Adds checks.
    pub fn add(&mut self, checks: impl IntoIterator<Item = Check>) {
        for check in checks {
            self.is_well &= check.verdict != Verdict::Failed;
            self.checks.push(check);
        }
    }

    /// Writes `report.md` and `report.json` to a folder, created if missing, and returns their paths.
    ///
    /// # Errors
    /// The folder or a file cannot be written.
    pub fn write(&self, folder: &Path) -> std::io::Result<[PathBuf; 2]> {
        fs::create_dir_all(folder)?;
        let paths = [folder.join("report.md"), folder.join("report.json")];
        let [markdown, json] = &paths;
        fs::write(markdown, self.markdown())?;
        fs::write(json, serde_json::to_string_pretty(self)? + "\n")?;
        Ok(paths)
    }

    fn markdown(&self) -> String {
        let verdict = if self.is_well { "all checks passed" } else { "FAILED" };
        let mut text = format!("# {}: {verdict}\n\n", self.board);
        if self.is_emulated {
            text += "The checks ran on an emulated chip, not on a real board.\n\n";
        }
        text += "| | |\n|---|---|\n";
        for (name, value) in &self.facts {
            let _ = writeln!(text, "| {} | {} |", cell(name), cell(value));
        }
        text += "\n| Check | | Found | Expected | Next step |\n|---|---|---|---|---|\n";
        for Check { name, verdict, found, expected, remedy } in &self.checks {
            let [name, found, expected, remedy] = [name, found, expected, remedy].map(|text| cell(text));
            let _ = writeln!(text, "| {name} | {verdict} | {found} | {expected} | {remedy} |");
        }
        for histogram in &self.histograms {
            let _ = write!(text, "\n{}:\n\n```text\n{}```\n", histogram.title, histogram.text());
        }
        for picture in &self.pictures {
            let _ = write!(text, "\n![{picture}]({picture})\n");
        }
        text
    }
}

fn cell(text: &str) -> String {
    text.replace('|', "\\|").replace('\n', " ")
}
