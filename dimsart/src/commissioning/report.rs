//! What is sent back: every check with its figure, and what was checked.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::{Check, Histogram, Verdict};

/// Everything that was found of a board.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// The board that it should be.
    pub board: String,
    /// Whether nothing failed.
    pub is_well: bool,
    /// Whether an emulated chip was in the board's place.
    pub is_emulated: bool,
    /// Names and versions of what was used.
    pub facts: Vec<(String, String)>,
    /// The checks, in their order.
    pub checks: Vec<Check>,
    /// Of what was measured many times.
    pub histograms: Vec<Histogram>,
    /// Pictures beside the report.
    pub pictures: Vec<String>,
}

impl Report {
    /// Of a board, with what is known of it so far.
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

    /// Writes `report.md` and `report.json` into a folder, made if missing; gives their paths.
    ///
    /// # Errors
    /// What the system says.
    pub fn write(&self, folder: &Path) -> std::io::Result<[PathBuf; 2]> {
        fs::create_dir_all(folder)?;
        let paths = [folder.join("report.md"), folder.join("report.json")];
        let [markdown, json] = &paths;
        fs::write(markdown, self.markdown())?;
        fs::write(json, serde_json::to_string_pretty(self)? + "\n")?;
        Ok(paths)
    }

    fn markdown(&self) -> String {
        let verdict = if self.is_well { "nothing failed" } else { "NOT WELL" };
        let mut text = format!("# {}: {verdict}\n\n", self.board);
        if self.is_emulated {
            text += "An emulated chip was in the board's place: nothing here has run on silicon.\n\n";
        }
        text += "| | |\n|---|---|\n";
        for (name, value) in &self.facts {
            let _ = writeln!(text, "| {} | {} |", cell(name), cell(value));
        }
        text += "\n| Check | | Found | Expected | Next step |\n|---|---|---|---|---|\n";
        for Check { name, verdict, found, expected, next_step } in &self.checks {
            let [name, found, expected, next_step] =
                [name, found, expected, next_step].map(|text| cell(text));
            let _ = writeln!(text, "| {name} | {verdict} | {found} | {expected} | {next_step} |");
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
