//! Plots over time: stacked panels with a common time axis and shaded phases.

use std::ops::Range;

use plotters::chart::ChartBuilder;
use plotters::element::{Circle, EmptyElement, PathElement, Rectangle, Text};
use plotters::prelude::{FontStyle, RGBColor};
use plotters::series::DashedLineSeries;
use plotters::style::Color;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::decimate::{Point, decimate};
use super::plot::{
    Area, BLACK, Drawn, GREY, GRID, LIGHT_GREY, Picture, color, fitting, font, label, px, upright_label,
    width,
};
use super::plots::{Level, PageCurve, PagePanel, PagePlot, Span};
use super::simplify::simplify;
use hil_sim::recording::Recording;

/// A picture of recorded signals over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// File name without extension (`positions`).
    pub file_stem: String,
    /// Title above the panels.
    pub title: String,
    /// Panels from top to bottom.
    pub panels: Vec<Panel>,
    /// Phases of the run, shaded in every panel.
    pub spans: Vec<Span>,
}

/// One pair of axes of a [`Figure`].
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// Title above the axes.
    pub title: String,
    /// Quantity and unit of the vertical axis: `position (m)`.
    pub y_label: String,
    /// Curves, each thinner than the previous ones, so that all stay visible.
    pub curves: Vec<Curve>,
    /// Reference levels, drawn if they are within the range of the signals.
    pub levels: Vec<Level>,
}

/// One recorded signal in a [`Panel`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Curve {
    /// Name in the legend.
    pub label: String,
    /// Column in the recording; a missing column is an empty curve.
    pub column: usize,
    /// Column to subtract, for a difference.
    pub subtracted_column: Option<usize>,
}

impl Figure {
    /// Returns the alternative text of the figure.
    pub(super) fn description(&self) -> String {
        let panels = self.panels.iter().map(|panel| {
            let labels: Vec<&str> = panel.curves.iter().map(|curve| curve.label.as_str()).collect();
            format!("{}, {}: {}", panel.title, panel.y_label, labels.join(", "))
        });
        format!("{} over time. {}", self.title, panels.collect::<Vec<_>>().join(". "))
    }
}

const WIDTH: u32 = 1400;
/// Minimum height; more panels make a figure higher.
const MIN_HEIGHT: u32 = 900;
const MIN_PANEL_HEIGHT: u32 = 180;
/// The following sizes are in displayed pixels.
const TITLE_HEIGHT: f64 = 62.0;
const PANEL_TITLE_HEIGHT: f64 = 34.0;
const TIME_AXIS_HEIGHT: f64 = 52.0;
const VALUE_AXIS_WIDTH: f64 = 104.0;
const LEGEND_WIDTH: f64 = 200.0;
const PLOT_WIDTH: f64 = 1400.0 - LEGEND_WIDTH - VALUE_AXIS_WIDTH;

/// Shades of consecutive phases, in turn.
const SHADES: [RGBColor; 3] =
    [RGBColor(0xf0, 0xf4, 0xf8), RGBColor(0xfd, 0xf4, 0xe3), RGBColor(0xee, 0xf6, 0xef)];

/// Limit of drawn values: a diverging run must not overflow the axes.
const LARGEST_DRAWN: f64 = 1e30;

/// Invisible share of a panel's height, even at fivefold magnification.
const UNSEEN: f64 = 2e-4;

/// A [`Figure`] with its points.
pub(super) struct FigurePicture<'a> {
    figure: &'a Figure,
    time_s: Range<f64>,
    panels: Vec<PanelData<'a>>,
}

struct PanelData<'a> {
    panel: &'a Panel,
    values: Range<f64>,
    /// Continuous segments of each curve.
    lines: Vec<Vec<Vec<Point>>>,
}

impl<'a> FigurePicture<'a> {
    pub(super) fn new(figure: &'a Figure, recording: &Recording) -> Self {
        let time_s = time_range(recording.time_s());
        let panels = figure.panels.iter().map(|panel| PanelData::new(panel, recording, &time_s)).collect();
        Self { figure, time_s, panels }
    }

    /// Converts the figure for the page.
    pub(super) fn plot(&self) -> PagePlot {
        let panels = self.panels.iter().map(|data| PagePanel {
            title: data.panel.title.clone(),
            y_label: data.panel.y_label.clone(),
            curves: data.panel.curves.iter().zip(&data.lines).map(page_curve).collect(),
            levels: data.panel.levels.clone(),
        });
        PagePlot {
            stem: self.figure.file_stem.clone(),
            panels: panels.collect(),
            spans: self.figure.spans.clone(),
        }
    }

    /// Draws shaded phases, axes and curves of one panel on `part`.
    fn draw_chart(&self, part: &Area<'_>, data: &PanelData<'_>, below: f64) -> Drawn {
        let mut chart = ChartBuilder::on(part)
            .margin_top(px(PANEL_TITLE_HEIGHT))
            .margin_right(px(LEGEND_WIDTH))
            .y_label_area_size(px(VALUE_AXIS_WIDTH))
            .x_label_area_size(px(below))
            .build_cartesian_2d(self.time_s.clone(), data.values.clone())?;
        chart.draw_series(self.figure.spans.iter().zip(SHADES.iter().cycle()).map(|(span, shade)| {
            let [start, end] =
                [span.start_s, span.end_s].map(|t| t.clamp(self.time_s.start, self.time_s.end));
            Rectangle::new([(start, data.values.start), (end, data.values.end)], shade.filled())
        }))?;
        chart
            .configure_mesh()
            .x_labels(14)
            .y_labels(6)
            .bold_line_style(GRID.stroke_width(width(1.0)))
            .light_line_style(GRID.mix(0.0))
            .axis_style(GREY.stroke_width(width(1.0)))
            .set_all_tick_mark_size(px(5.0))
            .label_style(font(14.0, FontStyle::Normal, GREY))
            .x_label_formatter(&|value| tick_text(*value, &self.time_s))
            .y_label_formatter(&|value| tick_text(*value, &data.values))
            .draw()?;
        if data.values.contains(&0.0) {
            let zero = [(self.time_s.start, 0.0), (self.time_s.end, 0.0)];
            chart.draw_series([PathElement::new(zero, LIGHT_GREY.stroke_width(width(1.0)))])?;
        }
        let is_near = |level: &&Level| data.values.contains(&level.value);
        for level in data.panel.levels.iter().filter(is_near) {
            let ends = [(self.time_s.start, level.value), (self.time_s.end, level.value)];
            let stroke = GREY.stroke_width(width(1.2));
            chart.draw_series(DashedLineSeries::new(
                ends,
                px(7.0).unsigned_abs(),
                px(5.0).unsigned_abs(),
                stroke,
            ))?;
            let style = font(13.0, FontStyle::Normal, GREY).pos(Pos::new(HPos::Left, VPos::Bottom));
            let above =
                EmptyElement::at(ends[0]) + Text::new(level.label.clone(), (px(6.0), px(-3.0)), style);
            chart.draw_series([above])?;
        }
        for (index, segments) in data.lines.iter().enumerate() {
            let stroke = color(index).stroke_width(width(thickness(index, data.lines.len())));
            chart.draw_series(segments.iter().map(|points| PathElement::new(points.as_slice(), stroke)))?;
            let lone = segments.iter().filter(|points| points.len() == 1).flatten();
            chart.draw_series(lone.map(|point| Circle::new(*point, px(2.0), color(index).filled())))?;
        }
        Ok(())
    }

    /// Labels the axes of one panel of this height.
    fn draw_names(part: &Area<'_>, panel: &Panel, height: f64, is_last: bool) -> Drawn {
        let title_style = font(16.0, FontStyle::Bold, BLACK);
        label(part, &panel.title, (VALUE_AXIS_WIDTH, 18.0), HPos::Left, &title_style)?;
        let axis_style = font(15.0, FontStyle::Normal, BLACK);
        upright_label(part, &panel.y_label, (24.0, PANEL_TITLE_HEIGHT + height / 2.0), &axis_style)?;
        if is_last {
            let below = (VALUE_AXIS_WIDTH + PLOT_WIDTH / 2.0, PANEL_TITLE_HEIGHT + height + 40.0);
            label(part, "time (s)", below, HPos::Center, &axis_style)?;
        }
        Ok(())
    }

    fn draw_legend(part: &Area<'_>, panel: &Panel) -> Drawn {
        let left = f64::from(WIDTH) - LEGEND_WIDTH + 16.0;
        let mut middle = PANEL_TITLE_HEIGHT + 10.0;
        for (index, line) in panel.curves.iter().enumerate() {
            let stroke = color(index).stroke_width(width(thickness(index, panel.curves.len())));
            part.draw(&PathElement::new([(px(left), px(middle)), (px(left + 22.0), px(middle))], stroke))?;
            let room = LEGEND_WIDTH - 56.0;
            let style = fitting(&line.label, room, 15.0, FontStyle::Normal, BLACK);
            label(part, &line.label, (left + 30.0, middle), HPos::Left, &style)?;
            middle += 23.0;
        }
        Ok(())
    }

    /// Labels the phases above the first panel, with text that fits each phase.
    fn draw_span_labels(&self, part: &Area<'_>) -> Drawn {
        let position = |time_s: f64| {
            let share = (time_s - self.time_s.start) / (self.time_s.end - self.time_s.start);
            VALUE_AXIS_WIDTH + PLOT_WIDTH * share.clamp(0.0, 1.0)
        };
        for span in &self.figure.spans {
            let (left, right) = (position(span.start_s), position(span.end_s));
            let style = fitting(&span.label, right - left - 6.0, 14.0, FontStyle::Normal, GREY);
            label(
                part,
                &span.label,
                (f64::midpoint(left, right), PANEL_TITLE_HEIGHT + 12.0),
                HPos::Center,
                &style,
            )?;
        }
        Ok(())
    }
}

impl Picture for FigurePicture<'_> {
    fn size(&self) -> (u32, u32) {
        let panels = u32::try_from(self.panels.len()).unwrap_or(1);
        (WIDTH, MIN_HEIGHT.max(panels.saturating_mul(MIN_PANEL_HEIGHT) + 130))
    }

    fn draw(&self, area: &Area<'_>) -> Drawn {
        let title_style = font(24.0, FontStyle::Bold, BLACK);
        label(area, &self.figure.title, (VALUE_AXIS_WIDTH, 32.0), HPos::Left, &title_style)?;
        let count = u32::try_from(self.panels.len()).unwrap_or(u32::MAX).max(1);
        let free = f64::from(self.size().1) - TITLE_HEIGHT - TIME_AXIS_HEIGHT - 8.0;
        let panel_height = free / f64::from(count);
        let mut top = TITLE_HEIGHT;
        for (number, data) in self.panels.iter().enumerate() {
            let is_last = number + 1 == self.panels.len();
            let below = if is_last { TIME_AXIS_HEIGHT } else { 0.0 };
            let size = (px(f64::from(WIDTH)), px(panel_height + below));
            let part = area.clone().shrink((0, px(top)), size);
            self.draw_chart(&part, data, below)?;
            Self::draw_names(&part, data.panel, panel_height - PANEL_TITLE_HEIGHT, is_last)?;
            Self::draw_legend(&part, data.panel)?;
            if number == 0 {
                self.draw_span_labels(&part)?;
            }
            top += panel_height;
        }
        Ok(())
    }
}

impl<'a> PanelData<'a> {
    fn new(panel: &'a Panel, recording: &Recording, time_s: &Range<f64>) -> Self {
        let lines: Vec<Vec<Vec<Point>>> = panel
            .curves
            .iter()
            .map(|line| {
                let value = |row: &[f64], column: usize| row.get(column).copied();
                let of_row = |row: &[f64]| {
                    let subtrahend = line.subtracted_column.map_or(Some(0.0), |column| value(row, column))?;
                    Some(value(row, line.column)? - subtrahend)
                };
                let values = recording.rows().filter_map(of_row).map(|value| {
                    if value.is_finite() { value.clamp(-LARGEST_DRAWN, LARGEST_DRAWN) } else { value }
                });
                decimate(recording.time_s().iter().copied().zip(values), time_s, WIDTH)
            })
            .collect();
        let values = value_range(lines.iter().flatten().flatten().map(|point| point.1));
        let tolerance = (values.end - values.start) * UNSEEN;
        let lines = lines.iter().map(|line| line.iter().map(|points| simplify(points, tolerance)).collect());
        Self { panel, lines: lines.collect(), values }
    }
}

/// Joins the segments of a curve, with a missing value between two of them.
fn page_curve((curve, stretches): (&Curve, &Vec<Vec<Point>>)) -> PageCurve {
    let mut found = PageCurve { label: curve.label.clone(), time_s: Vec::new(), values: Vec::new() };
    for stretch in stretches {
        if let (Some(last), Some(first)) = (found.time_s.last().copied(), stretch.first()) {
            found.time_s.push(f64::midpoint(last, first.0));
            found.values.push(None);
        }
        for (time_s, value) in stretch {
            found.time_s.push(rounded(*time_s));
            found.values.push(Some(rounded(*value)));
        }
    }
    found
}

/// Rounds to seven digits, which suffice for a page.
fn rounded(value: f64) -> f64 {
    format!("{value:.6e}").parse().unwrap_or(value)
}

/// Returns the width of curve `index` of `count`: earlier curves are wider, so that they stay visible under later ones.
fn thickness(index: usize, count: usize) -> f64 {
    let over_it = u32::try_from(count.saturating_sub(index + 1)).unwrap_or(0);
    (1.7 + 1.2 * f64::from(over_it)).min(8.0)
}

/// Returns the time range, never empty.
fn time_range(time_s: &[f64]) -> Range<f64> {
    let start = time_s.first().copied().unwrap_or(0.0);
    let end = time_s.last().copied().unwrap_or(1.0);
    if end - start > 1e-9 { start..end } else { start..start + 1.0 }
}

/// Returns the value range with a margin, wide enough for distinct tick labels.
fn value_range(values: impl Iterator<Item = f64>) -> Range<f64> {
    let (low, high) = values
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    if low > high {
        return 0.0..1.0;
    }
    let narrowest = (1e-6 * low.abs().max(high.abs())).max(1e-12);
    let air = 0.06 * (high - low).max(narrowest);
    // The larger margin at the top is for the phase labels.
    low - air..high + 2.0 * air
}

/// Formats a tick value with enough digits to distinguish neighbours in `range`.
fn tick_text(value: f64, range: &Range<f64>) -> String {
    let span = range.end - range.start;
    if value.abs() < 1e-9 * span {
        return "0".to_owned();
    }
    if !(1e-4..1e6).contains(&span) || value.abs() >= 1e7 {
        let text = format!("{value:.3e}");
        return match text.split_once('e') {
            Some((digits, power)) if digits.contains('.') => {
                format!("{}e{power}", digits.trim_end_matches('0').trim_end_matches('.'))
            }
            _ => text,
        };
    }
    let mut decimals = 1_usize;
    let mut resolution = 10.0;
    while resolution > span && decimals < 8 {
        resolution /= 10.0;
        decimals += 1;
    }
    format!("{value:.decimals$}").trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::super::plot::svg;
    use super::*;
    use hil_sim::recording::Column;

    fn recording(values: &[f64]) -> Recording {
        let column = Column {
            source: "world".into(),
            signal: "force".into(),
            indices: Vec::new(),
            unit: "N".into(),
            format: None,
        };
        let mut recording = Recording::new(vec![column]);
        for (time_s, value) in (0..).map(f64::from).zip(values) {
            recording.add_row(time_s).fill(*value);
        }
        recording
    }

    fn figure() -> Figure {
        let line = |label: &str, column| Curve { label: label.into(), column, subtracted_column: None };
        Figure {
            file_stem: "forces".into(),
            title: "Forces <at> the wall & hand".into(),
            panels: vec![Panel {
                title: "Axis 0".into(),
                y_label: "force (N)".into(),
                curves: vec![line("hand", 0), line("missing column", 17)],
                levels: vec![
                    Level { label: "limit".into(), value: 4.0 },
                    Level { label: "far away".into(), value: 4e3 },
                ],
            }],
            spans: vec![Span { start_s: 0.0, end_s: 2.0, label: "contact".into() }],
        }
    }

    #[test]
    fn the_svg_is_well_formed_and_names_everything() {
        let figure = figure();
        let text = svg(&FigurePicture::new(&figure, &recording(&[0.0, 1.0, 5.0, 2.0]))).unwrap();
        let document = roxmltree::Document::parse(&text).unwrap();
        let labels: Vec<&str> =
            document.descendants().filter_map(|node| node.text()).map(str::trim).collect();
        for expected in [
            "Forces <at> the wall & hand",
            "Axis 0",
            "force (N)",
            "time (s)",
            "hand",
            "missing column",
            "contact",
            "limit",
        ] {
            assert!(labels.contains(&expected), "`{expected}` is missing from {labels:?}");
        }
        assert!(!labels.contains(&"far away"), "a level beyond the signals squeezes nothing");
        assert_eq!(document.root_element().attribute("width"), Some("1400"));
    }

    #[test]
    fn what_a_broken_run_leaves_can_be_drawn() {
        let figure = figure();
        for values in [
            [].as_slice(),
            &[3.0],
            &[f64::NAN; 4],
            &[1e-300, -1e-300],
            &[1e300, f64::INFINITY, -1e300],
            &[1e6, 1e6, 1e6],
        ] {
            svg(&FigurePicture::new(&figure, &recording(values))).unwrap();
        }
    }

    #[test]
    fn ticks_are_short_and_tell_neighbours_apart() {
        for (value, range, text) in [
            (0.30000000000000004, 0.0..1.0, "0.3"),
            (-1e-17, -1.0..1.0, "0"),
            (0.0125, 0.0..0.02, "0.0125"),
            (1500.0, 0.0..2000.0, "1500"),
            (2.5e-6, 0.0..1e-5, "2.5e-6"),
            (3e29, 0.0..1e30, "3e29"),
        ] {
            assert_eq!(tick_text(value, &range), text);
        }
    }
}
