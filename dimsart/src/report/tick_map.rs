//! The Data Base timeline: writers and readers of each type in one tick.
//!
//! Time runs from left to right, one column per step of the tick, one row per Data Base type. A filled mark is a write, an
//! open mark is a read. A type that is read before it is written wraps around: its reader gets the value of the previous tick.

use plotters::element::{Circle, PathElement, Polygon, Rectangle};
use plotters::prelude::{FontStyle, RGBColor};
use plotters::style::text_anchor::HPos;
use plotters::style::{Color, ShapeStyle};

use super::plot::{
    Area, BLACK, Drawn, GREY, GRID, Picture, WHITE, color, fitting, font, label, px, text_width, width,
};

/// Data flow of one controller in one tick.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TickMap {
    /// Name of the controller: `master`.
    pub title: String,
    /// Steps in order: `frame writes`, the modules in plug-in order, `frame reads`.
    pub steps: Vec<String>,
    /// Types of the Data Base, in any order; they are drawn in the order of their writes.
    pub types: Vec<TypeRow>,
}

/// One Data Base type in a [`TickMap`]; steps are indices in [`TickMap::steps`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TypeRow {
    /// Name: `POSITION`.
    pub name: String,
    /// SI unit; empty for a pure number.
    pub unit: String,
    /// The step that writes it; `None` for a constant type without a writer.
    pub writer: Option<usize>,
    /// Steps that read the value of this tick.
    pub readers: Vec<usize>,
    /// Steps that read the value of the previous tick.
    pub delayed_readers: Vec<usize>,
}

/// Returns the alternative text of the maps.
pub(super) fn description(maps: &[TickMap]) -> String {
    let sentences = maps.iter().map(|map| {
        let delayed = map.types.iter().filter(|row| !row.delayed_readers.is_empty());
        let delayed: Vec<&str> = delayed.map(|row| row.name.as_str()).collect();
        let delayed = if delayed.is_empty() { "none".to_owned() } else { delayed.join(", ") };
        format!("{}: {}. Read one tick late: {delayed}.", map.title, map.steps.join(", then "))
    });
    format!(
        "Writes and reads of each Data Base type in one tick. {}",
        sentences.collect::<Vec<_>>().join(" ")
    )
}

/// Lengths in displayed pixels.
const WIDTH: u32 = 1400;
const TITLE_HEIGHT: f64 = 96.0;
const MAP_TITLE_HEIGHT: f64 = 34.0;
const STEP_HEIGHT: f64 = 58.0;
const ROW_HEIGHT: f64 = 30.0;
const MAP_GAP: f64 = 26.0;
const MARGIN: f64 = 28.0;
const NAME_WIDTH: f64 = 262.0;
/// Margin at both sides for lines from and to another tick.
const WRAP_WIDTH: f64 = 44.0;
const MARK_RADIUS: f64 = 7.0;

/// Colour of a value that is one tick old.
const DELAYED: RGBColor = RGBColor(0xc4, 0x1e, 0x3a);
const BAND: RGBColor = RGBColor(0xf6, 0xf8, 0xfa);

/// All maps of a run, stacked vertically.
pub(super) struct TimelinePicture<'a> {
    pub(super) maps: &'a [TickMap],
}

/// Positions of the columns of a map.
#[derive(Clone, Copy)]
struct Columns {
    left: f64,
    step: f64,
    right: f64,
}

impl Columns {
    fn new(map: &TickMap) -> Self {
        let left = MARGIN + NAME_WIDTH + WRAP_WIDTH;
        let right = f64::from(WIDTH) - MARGIN - WRAP_WIDTH;
        Self { left, step: (right - left) / lossless(map.steps.len().max(1)), right }
    }

    fn middle(&self, step: usize) -> f64 {
        self.left + (lossless(step) + 0.5) * self.step
    }
}

impl Picture for TimelinePicture<'_> {
    fn size(&self) -> (u32, u32) {
        let high: f64 = TITLE_HEIGHT + self.maps.iter().map(|map| map_height(map) + MAP_GAP).sum::<f64>();
        (WIDTH, (0..).find(|pixels| f64::from(*pixels) >= high).unwrap_or(WIDTH))
    }

    fn draw(&self, area: &Area<'_>) -> Drawn {
        let title_style = font(24.0, FontStyle::Bold, BLACK);
        label(
            area,
            "Data Base timeline: what happens inside one tick",
            (MARGIN, 32.0),
            HPos::Left,
            &title_style,
        )?;
        draw_legend(area, 70.0)?;
        let mut top = TITLE_HEIGHT;
        for map in self.maps {
            draw_map(area, map, top)?;
            top += map_height(map) + MAP_GAP;
        }
        Ok(())
    }
}

fn map_height(map: &TickMap) -> f64 {
    MAP_TITLE_HEIGHT + STEP_HEIGHT + ROW_HEIGHT * lossless(map.types.len()) + 6.0
}

/// Converts a small count to a length.
fn lossless(count: usize) -> f64 {
    u32::try_from(count).map_or(f64::from(u32::MAX), f64::from)
}

fn draw_legend(area: &Area<'_>, y: f64) -> Drawn {
    let style = font(15.0, FontStyle::Normal, BLACK);
    let shade = color(0);
    let mut x = MARGIN;
    for (dash, ink, filled, words) in [
        (0.0, shade, true, "written"),
        (0.0, shade, false, "read, value of this tick"),
        (38.0, DELAYED, false, "read before it is written: value of the previous tick (one tick late)"),
    ] {
        dashes(area, (x, x + dash), y)?;
        x += dash + MARK_RADIUS;
        mark(area, (x, y), MARK_RADIUS, ink, filled)?;
        x += MARK_RADIUS + 8.0;
        label(area, words, (x, y), HPos::Left, &style)?;
        x += text_width(words, &style) + 30.0;
    }
    let right = f64::from(WIDTH) - MARGIN;
    label(area, "one tick, from left to right", (right, y), HPos::Right, &font(15.0, FontStyle::Normal, GREY))
}

fn draw_map(area: &Area<'_>, map: &TickMap, top: f64) -> Drawn {
    let columns = Columns::new(map);
    let rows_top = top + MAP_TITLE_HEIGHT + STEP_HEIGHT;
    let bottom = rows_top + ROW_HEIGHT * lossless(map.types.len()) + 6.0;
    label(area, &map.title, (MARGIN, top + 16.0), HPos::Left, &font(19.0, FontStyle::Bold, BLACK))?;
    for (step, name) in map.steps.iter().enumerate() {
        let left = columns.middle(step) - columns.step / 2.0;
        if step % 2 == 0 {
            let band = [(px(left), px(rows_top)), (px(left + columns.step), px(bottom))];
            area.draw(&Rectangle::new(band, BAND.filled()))?;
        }
        draw_step(area, name, (left, top + MAP_TITLE_HEIGHT), columns.step, color(step))?;
    }
    let mut types: Vec<&TypeRow> = map.types.iter().collect();
    types.sort_by_key(|row| row.writer.unwrap_or(usize::MAX));
    let mut y = rows_top + ROW_HEIGHT / 2.0 + 3.0;
    for row in types {
        draw_row(area, row, &columns, y)?;
        y += ROW_HEIGHT;
    }
    Ok(())
}

/// Draws the head of a column.
fn draw_step(area: &Area<'_>, name: &str, (left, top): (f64, f64), wide: f64, shade: RGBColor) -> Drawn {
    let (gap, high) = (3.0, STEP_HEIGHT - 6.0);
    let corners = [(px(left + gap), px(top)), (px(left + wide - gap), px(top + high))];
    area.draw(&Rectangle::new(corners, shade.filled()))?;
    let normal = font(14.0, FontStyle::Bold, WHITE);
    let room = wide - 2.0 * gap - 6.0;
    let lines = wrap(name, |text| text_width(text, &normal) <= room);
    let longest = lines.iter().map(|line| text_width(line, &normal)).fold(1.0, f64::max);
    let lowest = 14.0 * 2.8 / lossless(lines.len().max(1));
    let size = (14.0 * room / longest).min(lowest).clamp(7.0, 14.0);
    let style = font(size, FontStyle::Bold, WHITE);
    let mut y = top + high / 2.0 - (size + 3.0) * (lossless(lines.len()) - 1.0) / 2.0;
    for line in lines {
        label(area, &line, (left + wide / 2.0, y), HPos::Center, &style)?;
        y += size + 3.0;
    }
    Ok(())
}

/// Breaks `name` at every space, and after an underscore where the rest does not fit.
fn wrap(name: &str, fits: impl Fn(&str) -> bool) -> Vec<String> {
    let mut lines = Vec::new();
    for word in name.split_whitespace() {
        let mut line = String::new();
        for part in word.split_inclusive('_') {
            let longer = format!("{line}{part}");
            if line.is_empty() || fits(&longer) {
                line = longer;
            } else {
                lines.push(std::mem::replace(&mut line, part.to_owned()));
            }
        }
        lines.push(line);
    }
    lines
}

fn draw_row(area: &Area<'_>, row: &TypeRow, columns: &Columns, y: f64) -> Drawn {
    let shade = row.writer.map_or(GREY, color);
    let rule =
        [(px(MARGIN), px(y + ROW_HEIGHT / 2.0)), (px(f64::from(WIDTH) - MARGIN), px(y + ROW_HEIGHT / 2.0))];
    area.draw(&PathElement::new(rule, GRID.stroke_width(width(0.7))))?;
    let unit = if row.unit.is_empty() { String::new() } else { format!("({})", row.unit) };
    let unit_style = font(14.0, FontStyle::Normal, GREY);
    let room = NAME_WIDTH - text_width(&unit, &unit_style) - 16.0;
    let name_style = fitting(&row.name, room, 15.0, FontStyle::Normal, BLACK);
    label(area, &row.name, (MARGIN, y), HPos::Left, &name_style)?;
    let after_name = MARGIN + text_width(&row.name, &name_style) + 8.0;
    label(area, &unit, (after_name, y), HPos::Left, &unit_style)?;

    let far = row.readers.iter().copied().max();
    let start = row.writer.map_or(columns.left, |step| columns.middle(step));
    let end = far.map_or(start, |step| columns.middle(step).max(start));
    area.draw(&PathElement::new([(px(start), px(y)), (px(end), px(y))], shade.stroke_width(width(3.0))))?;
    if let Some(late) = row.delayed_readers.iter().copied().max() {
        dashes(area, (end + MARK_RADIUS, columns.right + WRAP_WIDTH - 8.0), y)?;
        arrow(area, (columns.right + WRAP_WIDTH - 2.0, y))?;
        dashes(area, (columns.left - WRAP_WIDTH + 4.0, columns.middle(late)), y)?;
        arrow(area, (columns.left - WRAP_WIDTH + 22.0, y))?;
    }
    for step in &row.delayed_readers {
        // A step that reads its own previous value has a ring around its write mark.
        let radius = if row.writer == Some(*step) { MARK_RADIUS + 4.4 } else { MARK_RADIUS };
        mark(area, (columns.middle(*step), y), radius, DELAYED, false)?;
    }
    for step in &row.readers {
        mark(area, (columns.middle(*step), y), MARK_RADIUS, shade, false)?;
    }
    let remark = font(13.0, FontStyle::Normal, GREY);
    let Some(step) = row.writer else {
        return label(area, "constant", (columns.left - 6.0, y), HPos::Right, &remark);
    };
    if row.readers.is_empty() && row.delayed_readers.is_empty() {
        label(area, "not read", (columns.middle(step) + MARK_RADIUS + 6.0, y), HPos::Left, &remark)?;
    }
    mark(area, (columns.middle(step), y), MARK_RADIUS, shade, true)
}

/// Draws a disc for a write, a ring for a read.
fn mark(area: &Area<'_>, (x, y): (f64, f64), radius: f64, shade: RGBColor, filled: bool) -> Drawn {
    let at = (px(x), px(y));
    area.draw(&Circle::new(at, px(radius), shade.filled()))?;
    if filled { Ok(()) } else { area.draw(&Circle::new(at, px(radius - 2.4), WHITE.filled())) }
}

fn dashes(area: &Area<'_>, (start, end): (f64, f64), y: f64) -> Drawn {
    let stroke: ShapeStyle = DELAYED.stroke_width(width(2.4));
    let mut x = start;
    while x < end {
        area.draw(&PathElement::new([(px(x), px(y)), (px((x + 7.0).min(end)), px(y))], stroke))?;
        x += 12.0;
    }
    Ok(())
}

/// Draws an arrow head with its tip at `(x, y)`, pointing to later steps.
fn arrow(area: &Area<'_>, (x, y): (f64, f64)) -> Drawn {
    let corners = [(x, y), (x - 10.0, y - 5.5), (x - 10.0, y + 5.5)].map(|(x, y)| (px(x), px(y)));
    area.draw(&Polygon::new(corners, DELAYED.filled()))
}

#[cfg(test)]
mod tests {
    use super::super::plot::svg;
    use super::*;

    fn map(delayed_readers: Vec<usize>) -> TickMap {
        let position = TypeRow {
            name: "POSITION".into(),
            unit: "m".into(),
            writer: Some(0),
            readers: vec![1],
            delayed_readers,
        };
        TickMap {
            title: "master".into(),
            steps: vec!["frame writes".into(), "PDCTRL_MOD".into()],
            types: vec![position],
        }
    }

    fn drawn(map: TickMap) -> String {
        svg(&TimelinePicture { maps: &[map] }).unwrap()
    }

    #[test]
    fn steps_types_and_units_are_named() {
        let text = drawn(map(vec![]));
        let document = roxmltree::Document::parse(&text).unwrap();
        let labels: Vec<&str> =
            document.descendants().filter_map(|node| node.text()).map(str::trim).collect();
        for expected in ["master", "frame", "writes", "PDCTRL_MOD", "POSITION", "(m)"] {
            assert!(labels.contains(&expected), "`{expected}` is missing from {labels:?}");
        }
    }

    #[test]
    fn a_delayed_read_is_seen() {
        let red = |text: &str| text.matches("#C41E3A").count();
        let [without, with] = [vec![], vec![0]].map(|late| red(&drawn(map(late))));
        assert!(without > 0, "the legend explains the colour");
        assert!(with > without + 10, "dashes, arrows and a ring are drawn: {without} -> {with}");
    }

    #[test]
    fn a_long_name_breaks_where_it_can() {
        assert_eq!(wrap("VIRTUAL_WALL_MOD", |text| text.len() < 14), ["VIRTUAL_WALL_", "MOD"]);
        assert_eq!(wrap("WTRANSF_MOD decode", |text| text.len() < 14), ["WTRANSF_MOD", "decode"]);
        assert_eq!(wrap("UNBREAKABLE", |_| false), ["UNBREAKABLE"]);
    }

    #[test]
    fn an_empty_map_can_be_drawn() {
        drawn(TickMap { title: "nothing".into(), steps: vec![], types: vec![] });
    }
}
