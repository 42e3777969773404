//! The figures as the page draws them: to be zoomed, read off, and laid over another run's.

use serde::Serialize;

/// A constant to compare a signal with.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Level {
    /// Its name, written on it: `wall`.
    pub label: String,
    /// Its value, in the unit of the panel.
    pub value: f64,
}

/// A named stretch of time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Span {
    /// Where it begins, `s`.
    pub start_s: f64,
    /// Where it ends, `s`.
    pub end_s: f64,
    /// Its name: `free motion`.
    pub label: String,
}

/// A figure, in the page's own words.
#[derive(Debug, Serialize)]
pub(super) struct PagePlot {
    /// Name of its files, without extension.
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

/// Points of a curve, as many as show; no value ends a stretch.
#[derive(Debug, Serialize)]
pub(super) struct PageCurve {
    pub(super) label: String,
    pub(super) time_s: Vec<f64>,
    pub(super) values: Vec<Option<f64>>,
}

/// JSON that can stand in a script element: nothing in it ends that.
///
/// # Errors
/// None that numbers and text can bring.
pub(super) fn json(plots: &[PagePlot]) -> serde_json::Result<String> {
    Ok(serde_json::to_string(plots)?.replace('<', "\\u003c"))
}
