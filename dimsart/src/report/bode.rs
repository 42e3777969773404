//! Bode plot: gain and phase over frequency, grey where the coherence is low.

use plotters::element::PathElement;
use plotters::prelude::FontStyle;
use plotters::style::Color;
use plotters::style::text_anchor::HPos;

use super::plot::{
    Area, BLACK, Drawn, GREY, GRID, LIGHT_GREY, Picture, color, fitting, font, label, px, width,
};
use hil_sim::identify::FrequencyPoint;

/// A frequency response to draw.
#[derive(Debug, Clone, PartialEq)]
pub struct Bode {
    /// Title.
    pub title: String,
    /// Unit of the output divided by the unit of the input.
    pub unit: String,
    /// Points by increasing frequency.
    pub points: Vec<FrequencyPoint>,
}

/// Lengths in displayed pixels.
const WIDTH: f64 = 900.0;
const LEFT: f64 = 84.0;
const RIGHT: f64 = 870.0;
/// Top and bottom of gain and phase.
const PANELS: [(f64, f64); 2] = [(84.0, 324.0), (354.0, 594.0)];
const HEIGHT: u32 = 650;
/// Coherence below which a point is grey.
const COHERENT: f64 = 0.9;

/// A panel: values and spacing of its grid lines.
struct Panel {
    name: String,
    values: Vec<f64>,
    step: f64,
}

impl Bode {
    fn panels(&self) -> [Panel; 2] {
        let decibels = |point: &FrequencyPoint| 20.0 * libm::log10(point.gain.max(1e-12));
        let mut phases = Vec::new();
        for point in &self.points {
            // Unwrapped phase.
            let last = phases.last().copied().unwrap_or(0.0);
            let phase = point.phase_rad.to_degrees();
            phases.push(phase - 360.0 * libm::round((phase - last) / 360.0));
        }
        [
            Panel {
                name: format!("gain (dB of 1 {})", self.unit),
                values: self.points.iter().map(decibels).collect(),
                step: 20.0,
            },
            Panel { name: "phase (degrees)".to_owned(), values: phases, step: 90.0 },
        ]
    }

    /// Returns the frequency range, extended to whole decades.
    fn decades(&self) -> (f64, f64) {
        let log = |point: Option<&FrequencyPoint>| point.map_or(0.0, |point| libm::log10(point.frequency_hz));
        let (first, last) = (log(self.points.first()), log(self.points.last()));
        (first, last.max(first + 0.1))
    }

    fn draw_panel(&self, area: &Area<'_>, panel: &Panel, (top, bottom): (f64, f64)) -> Drawn {
        let (first, last) = self.decades();
        let x =
            |frequency_hz: f64| LEFT + (RIGHT - LEFT) * (libm::log10(frequency_hz) - first) / (last - first);
        let least = panel.values.iter().copied().fold(f64::INFINITY, f64::min);
        let most = panel.values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let (low, high) = (libm::floor(least / panel.step), libm::floor(most / panel.step) + 1.0);
        let y = |value: f64| bottom - (bottom - top) * (value / panel.step - low) / (high - low);
        let words = font(14.0, FontStyle::Normal, GREY);
        let mut line = low;
        while line <= high {
            let level = y(line * panel.step);
            let ends = [(px(LEFT), px(level)), (px(RIGHT), px(level))];
            area.draw(&PathElement::new(ends, GRID.stroke_width(width(1.0))))?;
            label(area, &format!("{:.0}", line * panel.step), (LEFT - 8.0, level), HPos::Right, &words)?;
            line += 1.0;
        }
        let mut decade = libm::ceil(first);
        while decade <= last {
            let at = x(libm::pow(10.0, decade));
            let ends = [(px(at), px(top)), (px(at), px(bottom))];
            area.draw(&PathElement::new(ends, GRID.stroke_width(width(1.0))))?;
            let text = format!("{} Hz", libm::pow(10.0, decade));
            label(area, &text, (at, bottom + 14.0), HPos::Center, &words)?;
            decade += 1.0;
        }
        label(area, &panel.name, (LEFT, top - 12.0), HPos::Left, &font(15.0, FontStyle::Normal, BLACK))?;
        let places = self.points.iter().zip(&panel.values);
        let places: Vec<_> = places
            .map(|(point, value)| (point.coherence, (px(x(point.frequency_hz)), px(y(*value)))))
            .collect();
        for pair in places.windows(2) {
            let [(one_coherence, one), (other_coherence, other)] = pair else { continue };
            let is_sure = one_coherence.min(*other_coherence) >= COHERENT;
            let stroke = if is_sure { color(0) } else { LIGHT_GREY };
            area.draw(&PathElement::new([*one, *other], stroke.stroke_width(width(2.0))))?;
        }
        Ok(())
    }
}

impl Picture for Bode {
    fn size(&self) -> (u32, u32) {
        (900, HEIGHT)
    }

    fn draw(&self, area: &Area<'_>) -> Drawn {
        let title = fitting(&self.title, WIDTH - 60.0, 20.0, FontStyle::Bold, BLACK);
        label(area, &self.title, (30.0, 26.0), HPos::Left, &title)?;
        let remark = "grey: coherence below 0.9";
        label(area, remark, (30.0, 50.0), HPos::Left, &font(14.0, FontStyle::Normal, GREY))?;
        for (panel, edges) in self.panels().iter().zip(PANELS) {
            self.draw_panel(area, panel, edges)?;
        }
        Ok(())
    }
}
