//! The page of a run: `page.html` filled in, everything escaped, no script, no network.

use minijinja::value::Serde;
use minijinja::{AutoEscape, Environment, UndefinedBehavior};
use serde::Serialize;

use super::{Fact, Report, Table};
use crate::recorder_files::RecorderFile;

const TEMPLATE: &str = include_str!("page.html");

/// A picture as the page names it.
#[derive(Debug, Serialize)]
pub(super) struct PageImage {
    /// Name of its files, without extension.
    pub(super) stem: String,
    /// Caption below it.
    pub(super) title: String,
    /// What somebody who cannot see it is told.
    pub(super) alt: String,
}

/// What the template reads.
#[derive(Serialize)]
struct Page<'a> {
    title: &'a str,
    summary: &'a [Fact],
    axes: &'a Table,
    faults: &'a [String],
    images: &'a [PageImage],
    settings_toml: &'a str,
    signals_file: &'a str,
    recorders: &'a [RecorderFile],
    rows: usize,
    columns: usize,
}

/// The page as HTML text; the signals' file and the pictures lie beside it.
///
/// # Errors
/// A mistake in the template, with its line.
pub(super) fn page(report: &Report<'_>, images: &[PageImage]) -> Result<String, minijinja::Error> {
    let mut environment = Environment::new();
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    environment.set_undefined_behavior(UndefinedBehavior::Strict);
    environment.render_named_str(
        "page.html",
        TEMPLATE,
        Serde(Page {
            title: &report.title,
            summary: &report.summary,
            axes: &report.axes,
            faults: &report.faults,
            images,
            settings_toml: &report.settings_toml,
            signals_file: report.signals.file_name(),
            recorders: &report.recorders,
            rows: report.recording.time_s().len(),
            columns: report.recording.columns().len() + 1,
        }),
    )
}
