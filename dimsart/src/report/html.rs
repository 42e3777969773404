//! The page of a run: `page.html` filled in, everything escaped, no network. Its scripts and the figures' points are in it.

use minijinja::value::{Serde, Value};
use minijinja::{AutoEscape, Environment, Error, ErrorKind, UndefinedBehavior};
use serde::Serialize;

use super::plots::{self, PagePlot};
use super::{Fact, Report, Table};
use crate::recorder_files::RecorderFile;

const UPLOT_JS: &str = include_str!("../page/assets/uPlot.iife.min.js");
const UPLOT_CSS: &str = include_str!("../page/assets/uPlot.min.css");
const PLOTS_JS: &str = include_str!("plots.js");
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
    /// Whether the page draws it itself, where it may run a script.
    pub(super) is_plot: bool,
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
    /// Safe as they are: made by this program.
    plots: Option<Value>,
    uplot_js: Value,
    uplot_css: Value,
    plots_js: Value,
}

/// The page as HTML text; the signals' file and the pictures lie beside it.
///
/// # Errors
/// A mistake in the template, with its line.
pub(super) fn page(report: &Report<'_>, images: &[PageImage], plots: &[PagePlot]) -> Result<String, Error> {
    let json =
        plots::json(plots).map_err(|error| Error::new(ErrorKind::BadSerialization, error.to_string()))?;
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
            plots: (!plots.is_empty()).then(|| Value::from_safe_string(json)),
            uplot_js: Value::from_safe_string(UPLOT_JS.to_owned()),
            uplot_css: Value::from_safe_string(UPLOT_CSS.to_owned()),
            plots_js: Value::from_safe_string(PLOTS_JS.to_owned()),
        }),
    )
}
