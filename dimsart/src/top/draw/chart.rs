//! Chart of the selected signal.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Color, Style};
use ratatui::symbols::Marker;
use ratatui::widgets::{Axis, Block, Chart, Dataset, GraphType, Paragraph};

use super::paint;
use crate::report::decimate;
use crate::top::live::SHOWN_S;
use crate::top::screen::Screen;
use crate::top::text::{moving, with_unit};

/// Horizontal points per braille character.
const POINTS: u16 = 2;
/// Margin above and below the line, relative to its range.
const MARGIN: f64 = 0.05;

pub(super) fn draw(frame: &mut Frame<'_>, screen: &Screen, block: Block<'_>, area: Rect) {
    let Some((seen, line)) = screen.seen().zip(screen.signal()) else {
        return frame.render_widget(Paragraph::new("no signal").block(block), area);
    };
    let block =
        block.title(format!("{} {}", line.name(), with_unit(&seen.signal_value(line), &line.signal.unit)));
    let points = seen.live.points(&line.signal.name, line.place);
    let stretches = decimate(points.into_iter(), &(-SHOWN_S..0.0), u32::from(area.width.max(1) * POINTS));
    let values = || stretches.iter().flatten().map(|(_, value)| *value);
    let (low, high) = (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
    if low > high {
        let text = "no telemetry of this signal";
        return frame.render_widget(Paragraph::new(text).block(block), area);
    }
    let margin = match (high - low) * MARGIN {
        none if none <= f64::EPSILON * high.abs() => (high.abs() * MARGIN).max(MARGIN),
        margin => margin,
    };
    let bounds = [low - margin, high + margin];
    let style = paint(screen, Color::Cyan);
    let lines = stretches.iter().map(|stretch| {
        Dataset::default().marker(Marker::Braille).graph_type(GraphType::Line).style(style).data(stretch)
    });
    let unit = &line.signal.unit;
    let chart = Chart::new(lines.collect())
        .block(block)
        .x_axis(axis([-SHOWN_S, 0.0], [format!("-{SHOWN_S} s"), "0 s".to_owned()]))
        .y_axis(axis(bounds, bounds.map(|bound| with_unit(&moving(bound), unit))));
    frame.render_widget(chart, area);
}

fn axis(bounds: [f64; 2], labels: [String; 2]) -> Axis<'static> {
    Axis::default().bounds(bounds).labels(labels).style(Style::new())
}
