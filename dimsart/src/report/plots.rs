//! Figures as data for the interactive plots of the page.

use serde::Serialize;

/// A constant to compare a signal with.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Level {
    /// Label: `wall`.
    pub label: String,
    /// Value, in the unit of the panel.
    pub value: f64,
}

/// A named time span.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Span {
    /// Start, `s`.
    pub start_s: f64,
    /// End, `s`.
    pub end_s: f64,
    /// Label: `free motion`.
    pub label: String,
}

/// A figure for the page.
#[derive(Debug, Serialize)]
pub(super) struct PagePlot {
    /// File name without extension.
    pub(super) stem: String,
    pub(super) panels: Vec<PagePanel>,
    pub(super) spans: Vec<Span>,
}

#[derive(Debug, Serialize)]
pub(super) struct PagePanel {
    pub(super) title: String,
    pub(super) y_label: String,
    pub(super) curves: Vec<PageCurve>,
    pub(super) levels: Vec<Level>,
}

/// Visible points of a curve; a missing value is a gap.
#[derive(Debug, Serialize)]
pub(super) struct PageCurve {
    pub(super) label: String,
    pub(super) time_s: Vec<f64>,
    pub(super) values: Vec<Option<f64>>,
}

/// Encodes plots as JSON that is safe in a script element.
///
/// # Errors
/// Never fails for numbers and text.
pub(super) fn json(plots: &[PagePlot]) -> serde_json::Result<String> {
    Ok(serde_json::to_string(plots)?.replace('<', "\\u003c"))
}
