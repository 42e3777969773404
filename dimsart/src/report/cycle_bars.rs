//! Cycles of a tick and its parts as bars, relative to the sample period.

use plotters::element::{PathElement, Rectangle};
use plotters::prelude::FontStyle;
use plotters::style::Color;
use plotters::style::text_anchor::HPos;

use super::plot::{
    Area, BLACK, Drawn, GREY, LIGHT_GREY, Picture, color, fitting, font, label, px, text_width, width,
};

/// The parts of a tick.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CycleBars {
    /// Title.
    pub title: String,
    /// Unit of the counts.
    pub unit: &'static str,
    /// The whole tick.
    pub tick: CycleBar,
    /// Parts of the tick, from top to bottom.
    pub parts: Vec<CycleBar>,
    /// Cycles of a sample period.
    pub budget: u64,
}

/// Cycles of one part.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CycleBar {
    /// Name.
    pub name: String,
    /// Observed maximum.
    pub max_cycles: u64,
    /// WCET bound, if known.
    pub bound: Option<u64>,
}

impl CycleBar {
    /// Returns its total length.
    fn length(&self) -> u64 {
        self.max_cycles.max(self.bound.unwrap_or(0))
    }

    fn text(&self, budget: u64) -> String {
        let most = self.max_cycles;
        let percent = 100.0 * as_float(self.length()) / as_float(budget.max(1));
        match self.bound {
            Some(bound) => format!("{most}, bound {bound} ({percent:.2} % of a tick)"),
            None => format!("{most} ({percent:.2} % of a tick)"),
        }
    }
}

#[expect(clippy::cast_precision_loss, reason = "far fewer than 2^53")]
fn as_float(cycles: u64) -> f64 {
    cycles as f64
}

/// Lengths in displayed pixels.
const WIDTH: u32 = 1000;
const HEAD_HEIGHT: f64 = 96.0;
const ROW_HEIGHT: f64 = 34.0;
const FOOT_HEIGHT: f64 = 20.0;
const MARGIN: f64 = 28.0;
const NAME_WIDTH: f64 = 190.0;
const TEXT_WIDTH: f64 = 300.0;
const BAR_MARGIN: f64 = 7.0;

impl CycleBars {
    fn bottom(&self) -> f64 {
        HEAD_HEIGHT + ROW_HEIGHT * f64::from(u32::try_from(self.parts.len() + 1).unwrap_or(u32::MAX))
    }

    /// Draws a row: the observed maximum is filled, the bound is an outline.
    fn draw_row(&self, area: &Area<'_>, (index, top): (usize, f64), bar: &CycleBar, full: u64) -> Drawn {
        let middle = top + ROW_HEIGHT / 2.0;
        let name = fitting(&bar.name, NAME_WIDTH - 14.0, 15.0, FontStyle::Normal, BLACK);
        label(area, &bar.name, (MARGIN, middle), HPos::Left, &name)?;
        let left = MARGIN + NAME_WIDTH;
        let room = f64::from(WIDTH) - MARGIN - TEXT_WIDTH - left;
        let right = |cycles: u64| left + room * as_float(cycles) / as_float(full.max(1));
        let corners =
            |end: f64| [(px(left), px(top + BAR_MARGIN)), (px(end), px(top + ROW_HEIGHT - BAR_MARGIN))];
        area.draw(&Rectangle::new(corners(right(bar.max_cycles)), color(index).filled()))?;
        if let Some(bound) = bar.bound {
            area.draw(&Rectangle::new(corners(right(bound)), color(index).stroke_width(width(1.2))))?;
        }
        let text = bar.text(self.budget);
        let style = fitting(&text, TEXT_WIDTH - 10.0, 14.0, FontStyle::Normal, BLACK);
        label(area, &text, (right(bar.length().min(full)) + 10.0, middle), HPos::Left, &style)
    }
}

impl Picture for CycleBars {
    fn size(&self) -> (u32, u32) {
        let high = self.bottom() + FOOT_HEIGHT;
        (WIDTH, (0..).find(|pixels| f64::from(*pixels) >= high).unwrap_or(WIDTH))
    }

    fn draw(&self, area: &Area<'_>) -> Drawn {
        let title = fitting(&self.title, f64::from(WIDTH) - 2.0 * MARGIN, 22.0, FontStyle::Bold, BLACK);
        label(area, &self.title, (MARGIN, 32.0), HPos::Left, &title)?;
        let words = font(15.0, FontStyle::Normal, BLACK);
        let mut x = MARGIN;
        for (is_filled, text) in [(true, "observed maximum (emulated)"), (false, "bound")] {
            let style = if is_filled { color(0).filled() } else { color(0).stroke_width(width(1.2)) };
            area.draw(&Rectangle::new([(px(x), px(62.0)), (px(x + 22.0), px(76.0))], style))?;
            label(area, text, (x + 30.0, 69.0), HPos::Left, &words)?;
            x += 30.0 + text_width(text, &words) + 30.0;
        }
        let remark = format!("{}; sample period: {}", self.unit, self.budget);
        let right = f64::from(WIDTH) - MARGIN;
        label(area, &remark, (right, 69.0), HPos::Right, &font(15.0, FontStyle::Normal, GREY))?;
        let longest = self.tick.length();
        let bars = std::iter::once(&self.tick).chain(&self.parts);
        let mut top = HEAD_HEIGHT;
        for (index, bar) in bars.enumerate() {
            self.draw_row(area, (index, top), bar, longest)?;
            top += ROW_HEIGHT;
        }
        let x = px(MARGIN + NAME_WIDTH);
        let axis = [(x, px(HEAD_HEIGHT)), (x, px(self.bottom()))];
        area.draw(&PathElement::new(axis, LIGHT_GREY.stroke_width(width(1.0))))
    }
}

#[cfg(test)]
mod tests {
    use super::super::plot::svg;
    use super::*;

    #[test]
    fn every_part_has_its_name_and_its_numbers() {
        let bar = |name: &str, max_cycles, bound| CycleBar { name: name.to_owned(), max_cycles, bound };
        let bars = CycleBars {
            title: "Cycles of a tick".to_owned(),
            unit: "cycles",
            tick: bar("tick", 900, Some(1000)),
            parts: vec![bar("PDCTRL_MOD", 300, Some(310)), bar("SUM_MOD", 90, None)],
            budget: 10_000,
        };
        let text = svg(&bars).unwrap();
        let document = roxmltree::Document::parse(&text).unwrap();
        let labels: Vec<&str> =
            document.descendants().filter_map(|node| node.text()).map(str::trim).collect();
        for expected in [
            "900, bound 1000 (10.00 % of a tick)",
            "PDCTRL_MOD",
            "300, bound 310 (3.10 % of a tick)",
            "90 (0.90 % of a tick)",
        ] {
            assert!(labels.contains(&expected), "`{expected}` is missing from {labels:?}");
        }
    }
}
