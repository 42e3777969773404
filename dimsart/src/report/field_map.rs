//! A map of results over two settings, one coloured field per combination.

use plotters::element::{PathElement, Rectangle};
use plotters::prelude::{FontStyle, RGBColor};
use plotters::style::Color;
use plotters::style::text_anchor::HPos;

use super::contour::ContourSegment;
use super::plot::{
    Area, BLACK, Drawn, GREY, LIGHT_GREY, Picture, color, fitting, font, label, px, upright_label, width,
};

/// Result of one combination.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CellValue {
    /// Not run, or without this figure.
    Nothing,
    /// True.
    Yes,
    /// False.
    No,
    /// A number.
    Number(f64),
}

/// A map of two settings.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepMap {
    /// Title.
    pub title: String,
    /// Name and values from bottom to top.
    pub y_axis: (String, Vec<String>),
    /// Name and values from left to right.
    pub x_axis: (String, Vec<String>),
    /// Results, by `down`, then by `right`.
    pub cells: Vec<Vec<CellValue>>,
    /// Borders between fields.
    pub borders: Vec<Boundary>,
}

/// A line across a map.
#[derive(Debug, Clone, PartialEq)]
pub struct Boundary {
    /// Meaning of the line, or why there is no line.
    pub label: String,
    /// Segments; empty without a line.
    pub pieces: Vec<ContourSegment>,
}

/// Lengths in displayed pixels.
const WIDTH: u32 = 1100;
const HEIGHT: u32 = 800;
const LEFT: f64 = 130.0;
const TOP: f64 = 110.0;
const RIGHT: f64 = 40.0;
const BOTTOM: f64 = 90.0;
/// Maximum number of values at an axis.
const MAX_LABELS: usize = 12;
/// Colours of the first and the second border.
const BORDER_COLORS: [RGBColor; 2] = [BLACK, RGBColor(0xff, 0xe1, 0x4d)];
/// Colours from minimum to maximum.
const MIN_COLOR: RGBColor = RGBColor(0xf3, 0xf6, 0xf9);
const MAX_COLOR: RGBColor = RGBColor(0x00, 0x4a, 0x75);

impl SweepMap {
    /// Returns the minimum and maximum number.
    fn range(&self) -> Option<(f64, f64)> {
        let numbers = self.cells.iter().flatten().filter_map(|field| match field {
            CellValue::Number(number) if number.is_finite() => Some((*number, *number)),
            _ => None,
        });
        numbers.reduce(|(least, most), (a, b)| (least.min(a), most.max(b)))
    }

    fn color(&self, field: CellValue) -> RGBColor {
        match field {
            CellValue::Nothing => LIGHT_GREY,
            CellValue::Yes => color(0),
            CellValue::No => color(1),
            CellValue::Number(number) => {
                let (least, most) = self.range().unwrap_or_default();
                let share = ((number - least) / (most - least).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
                let mix = |from: u8, to: u8| {
                    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 255")]
                    let mixed = (f64::from(from) + share * (f64::from(to) - f64::from(from))) as u8;
                    mixed
                };
                RGBColor(
                    mix(MIN_COLOR.0, MAX_COLOR.0),
                    mix(MIN_COLOR.1, MAX_COLOR.1),
                    mix(MIN_COLOR.2, MAX_COLOR.2),
                )
            }
        }
    }

    /// Returns the legend.
    fn legend(&self) -> Vec<(RGBColor, String)> {
        let has = |wanted: CellValue| self.cells.iter().flatten().any(|field| *field == wanted);
        let mut legend = Vec::new();
        legend.extend(has(CellValue::Yes).then(|| (color(0), "yes".to_owned())));
        legend.extend(has(CellValue::No).then(|| (color(1), "no".to_owned())));
        if let Some((least, most)) = self.range() {
            legend.push((MIN_COLOR, format!("{least:.4}")));
            legend.push((MAX_COLOR, format!("{most:.4}")));
        }
        legend.extend(has(CellValue::Nothing).then(|| (LIGHT_GREY, "no result".to_owned())));
        legend
    }
}

#[expect(clippy::cast_precision_loss, reason = "few fields")]
fn share(place: usize, count: usize) -> f64 {
    place as f64 / count.max(1) as f64
}

impl Picture for SweepMap {
    fn size(&self) -> (u32, u32) {
        (WIDTH, HEIGHT)
    }

    fn draw(&self, area: &Area<'_>) -> Drawn {
        let (wide, high) = (f64::from(WIDTH) - LEFT - RIGHT, f64::from(HEIGHT) - TOP - BOTTOM);
        let title = fitting(&self.title, f64::from(WIDTH) - LEFT - RIGHT, 22.0, FontStyle::Bold, BLACK);
        label(area, &self.title, (LEFT, 34.0), HPos::Left, &title)?;
        let words = font(14.0, FontStyle::Normal, BLACK);
        let mut x = LEFT;
        for (color, text) in self.legend() {
            let corners = [(px(x), px(66.0)), (px(x + 22.0), px(82.0))];
            area.draw(&Rectangle::new(corners, color.filled()))?;
            label(area, &text, (x + 30.0, 74.0), HPos::Left, &words)?;
            x += 150.0;
        }
        let (rows, columns) = (self.y_axis.1.len(), self.x_axis.1.len());
        for (row, fields) in self.cells.iter().enumerate() {
            for (column, field) in fields.iter().enumerate() {
                let bottom = TOP + high * (1.0 - share(row, rows));
                let left = LEFT + wide * share(column, columns);
                let corners = [
                    (px(left), px(bottom - high * share(1, rows))),
                    (px(left + wide * share(1, columns)), px(bottom)),
                ];
                area.draw(&Rectangle::new(corners, self.color(*field).filled()))?;
            }
        }
        let middle = |(to_right, up): (f64, f64)| {
            (
                px(LEFT + wide * (to_right + 0.5) * share(1, columns)),
                px(TOP + high * (1.0 - (up + 0.5) * share(1, rows))),
            )
        };
        let mut y = 74.0;
        for (Boundary { label: what, pieces }, ink) in self.borders.iter().zip(BORDER_COLORS) {
            for piece in pieces {
                area.draw(&PathElement::new(piece.map(middle), ink.stroke_width(width(3.0))))?;
            }
            if !pieces.is_empty() {
                area.draw(&PathElement::new(
                    [(px(x), px(y)), (px(x + 22.0), px(y))],
                    ink.stroke_width(width(3.0)),
                ))?;
            }
            label(area, what, (x + 30.0, y), HPos::Left, &words)?;
            y += 22.0;
        }
        let text = font(13.0, FontStyle::Normal, GREY);
        for (row, value) in self.y_axis.1.iter().enumerate().step_by(rows.div_ceil(MAX_LABELS).max(1)) {
            let y = TOP + high * (1.0 - share(row, rows) - 0.5 * share(1, rows));
            label(area, value, (LEFT - 10.0, y), HPos::Right, &text)?;
        }
        for (column, value) in self.x_axis.1.iter().enumerate().step_by(columns.div_ceil(MAX_LABELS).max(1)) {
            let x = LEFT + wide * (share(column, columns) + 0.5 * share(1, columns));
            label(area, value, (x, TOP + high + 18.0), HPos::Center, &text)?;
        }
        label(area, &self.x_axis.0, (LEFT + 0.5 * wide, TOP + high + 52.0), HPos::Center, &words)?;
        upright_label(area, &self.y_axis.0, (28.0, TOP + 0.5 * high), &words)
    }
}
