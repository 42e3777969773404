//! The timeline of a bus: transmissions of each node over a few ticks.
//!
//! Time runs from left to right, one row per sender; a thin line marks each tick. Lost frames are red.

use plotters::element::{PathElement, Rectangle};
use plotters::prelude::{FontStyle, RGBColor};
use plotters::style::Color;
use plotters::style::text_anchor::HPos;

use super::plot::{
    Area, BLACK, Drawn, GREY, GRID, LIGHT_GREY, Picture, WHITE, color, fitting, font, label, px, text_width,
    width,
};
use hil_sim::bus::MediumReport;
use hil_sim::bus::time::{NS_PER_S, ns_to_seconds};

/// Number of shown ticks.
const TICKS_SHOWN: u64 = 4;

/// Timeline of one or more buses.
#[derive(Debug, Clone, PartialEq)]
pub struct BusTimeline {
    /// Title above the rows.
    pub title: String,
    /// Rows from top to bottom.
    pub rows: Vec<BusRow>,
    /// Start and end of the shown time, `ns` of virtual time.
    pub span_ns: (u64, u64),
    /// Sample period, `ns`.
    pub period_ns: u64,
}

/// Transmissions of one sender.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BusRow {
    /// Name.
    pub name: String,
    /// Its transmissions, in order.
    pub transmissions: Vec<Transmission>,
}

/// A transmission.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Transmission {
    /// Start and end, `ns`.
    pub span_ns: (u64, u64),
    /// Content; may be empty.
    pub label: String,
    /// Whether it was lost.
    pub is_error: bool,
}

impl BusTimeline {
    /// Shows the last recorded ticks; `None` without transmissions.
    #[must_use]
    pub fn of(media: &[MediumReport], period_ns: u64) -> Option<Self> {
        let all = media.iter().flat_map(|medium| medium.timeline.busy_intervals());
        // Omit a trailing tick without transmissions.
        let last_ns = all.map(|occupation| occupation.start_ns).max()?;
        let end_ns = (last_ns / period_ns.max(1) + 1) * period_ns;
        Self::between(media, period_ns, (end_ns.saturating_sub(TICKS_SHOWN * period_ns), end_ns))
    }

    /// Shows a time span; `None` without transmissions.
    #[must_use]
    pub fn between(media: &[MediumReport], period_ns: u64, span_ns: (u64, u64)) -> Option<Self> {
        let (start_ns, end_ns) = span_ns;
        let rows = media.iter().flat_map(|medium| {
            medium.senders.iter().enumerate().map(|(sender, name)| {
                let own =
                    medium.timeline.busy_intervals().filter(move |occupation| occupation.sender == sender);
                let shown =
                    own.filter(|occupation| occupation.end_ns > start_ns && occupation.start_ns < end_ns);
                let transmissions = shown.map(|occupation| Transmission {
                    span_ns: (occupation.start_ns.max(start_ns), occupation.end_ns.min(end_ns)),
                    label: occupation.label.clone(),
                    is_error: occupation.is_error,
                });
                BusRow { name: name.clone(), transmissions: transmissions.collect() }
            })
        });
        let rows: Vec<BusRow> = rows.collect();
        let media: Vec<&str> = media.iter().map(|medium| medium.traffic.medium.as_str()).collect();
        let title = format!("Bus timeline ({})", media.join("; "));
        let is_empty = rows.iter().all(|row| row.transmissions.is_empty());
        (!is_empty).then_some(Self { title, rows, span_ns, period_ns: period_ns.max(1) })
    }

    /// Returns the alternative text of the picture.
    pub(super) fn description(&self) -> String {
        let rows = self.rows.iter().map(|row| {
            let taken_ns: u64 =
                row.transmissions.iter().map(|stretch| stretch.span_ns.1 - stretch.span_ns.0).sum();
            let lost = row.transmissions.iter().filter(|stretch| stretch.is_error).count();
            format!(
                "{}: {} frames, {:.3} ms, {lost} lost",
                row.name,
                row.transmissions.len(),
                1e3 * ns_to_seconds(taken_ns)
            )
        });
        format!("{}. {}.", self.title, rows.collect::<Vec<_>>().join("; "))
    }
}

/// Lengths in displayed pixels.
const WIDTH: u32 = 1400;
const HEAD_HEIGHT: f64 = 96.0;
const ROW_HEIGHT: f64 = 34.0;
const AXIS_HEIGHT: f64 = 46.0;
const MARGIN: f64 = 28.0;
/// Right margin, for half of the last time label.
const RIGHT_MARGIN: f64 = 44.0;
const NAME_WIDTH: f64 = 200.0;
const BOX_MARGIN: f64 = 5.0;

/// Colour of lost frames.
const LOST: RGBColor = RGBColor(0xc4, 0x1e, 0x3a);
const BAND: RGBColor = RGBColor(0xf6, 0xf8, 0xfa);

impl BusTimeline {
    fn x(&self, time_ns: u64) -> f64 {
        let (start_ns, end_ns) = self.span_ns;
        let share =
            ns_to_seconds(time_ns.saturating_sub(start_ns)) / ns_to_seconds((end_ns - start_ns).max(1));
        let left = MARGIN + NAME_WIDTH;
        left + share * (f64::from(WIDTH) - RIGHT_MARGIN - left)
    }

    fn bottom(&self) -> f64 {
        HEAD_HEIGHT + ROW_HEIGHT * f64::from(u32::try_from(self.rows.len()).unwrap_or(u32::MAX))
    }

    fn draw_ticks(&self, area: &Area<'_>) -> Drawn {
        let (start_ns, end_ns) = self.span_ns;
        let first = start_ns.div_ceil(self.period_ns);
        let digits = if self.period_ns.is_multiple_of(NS_PER_S / 1000) { 0 } else { 3 };
        for tick_ns in (first..=end_ns / self.period_ns).map(|tick| tick * self.period_ns) {
            let x = px(self.x(tick_ns));
            let ends = [(x, px(HEAD_HEIGHT - 6.0)), (x, px(self.bottom() + 6.0))];
            area.draw(&PathElement::new(ends, LIGHT_GREY.stroke_width(width(1.0))))?;
            let text = format!("{:.digits$} ms", 1e3 * ns_to_seconds(tick_ns));
            let style = font(13.0, FontStyle::Normal, GREY);
            // Keep the last label inside the picture.
            let most = f64::from(WIDTH) - 0.5 * text_width(&text, &style) - 4.0;
            let at = (self.x(tick_ns).min(most), self.bottom() + 20.0);
            label(area, &text, at, HPos::Center, &style)?;
        }
        Ok(())
    }

    fn draw_row(&self, area: &Area<'_>, row: &BusRow, (index, top): (usize, f64)) -> Drawn {
        let right = f64::from(WIDTH) - RIGHT_MARGIN;
        if index % 2 == 0 {
            let band = [(px(MARGIN), px(top)), (px(right), px(top + ROW_HEIGHT))];
            area.draw(&Rectangle::new(band, BAND.filled()))?;
        }
        let middle = top + ROW_HEIGHT / 2.0;
        let name = fitting(&row.name, NAME_WIDTH - 14.0, 15.0, FontStyle::Normal, BLACK);
        label(area, &row.name, (MARGIN + 4.0, middle), HPos::Left, &name)?;
        let rule = [(px(MARGIN + NAME_WIDTH), px(middle)), (px(right), px(middle))];
        area.draw(&PathElement::new(rule, GRID.stroke_width(width(0.7))))?;
        for stretch in &row.transmissions {
            let ink = if stretch.is_error { LOST } else { color(index) };
            let (left, right) = (self.x(stretch.span_ns.0), self.x(stretch.span_ns.1));
            let corners = [(px(left), px(top + BOX_MARGIN)), (px(right), px(top + ROW_HEIGHT - BOX_MARGIN))];
            area.draw(&Rectangle::new(corners, ink.filled()))?;
            // Keep a gap between neighbours.
            let edge = [(px(right), px(top + BOX_MARGIN)), (px(right), px(top + ROW_HEIGHT - BOX_MARGIN))];
            area.draw(&PathElement::new(edge, WHITE.stroke_width(width(0.7))))?;
            let style = font(11.0, FontStyle::Normal, WHITE);
            if text_width(&stretch.label, &style) + 6.0 <= right - left {
                label(area, &stretch.label, (0.5 * (left + right), middle), HPos::Center, &style)?;
            }
        }
        Ok(())
    }
}

impl Picture for BusTimeline {
    fn size(&self) -> (u32, u32) {
        let high = self.bottom() + AXIS_HEIGHT;
        (WIDTH, (0..).find(|pixels| f64::from(*pixels) >= high).unwrap_or(WIDTH))
    }

    fn draw(&self, area: &Area<'_>) -> Drawn {
        let title = fitting(&self.title, f64::from(WIDTH) - 2.0 * MARGIN, 24.0, FontStyle::Bold, BLACK);
        label(area, &self.title, (MARGIN, 32.0), HPos::Left, &title)?;
        let words = font(15.0, FontStyle::Normal, BLACK);
        let mut x = MARGIN;
        for (ink, text) in [(color(0), "frame, in the colour of its sender"), (LOST, "lost frame")] {
            area.draw(&Rectangle::new([(px(x), px(62.0)), (px(x + 22.0), px(76.0))], ink.filled()))?;
            label(area, text, (x + 30.0, 69.0), HPos::Left, &words)?;
            x += 30.0 + text_width(text, &words) + 30.0;
        }
        let remark = "a grey line marks each tick";
        let right = f64::from(WIDTH) - MARGIN;
        label(area, remark, (right, 69.0), HPos::Right, &font(15.0, FontStyle::Normal, GREY))?;
        let mut top = HEAD_HEIGHT;
        for (index, row) in self.rows.iter().enumerate() {
            self.draw_row(area, row, (index, top))?;
            top += ROW_HEIGHT;
        }
        self.draw_ticks(area)
    }
}

#[cfg(test)]
mod tests {
    use super::super::plot::svg;
    use super::*;
    use hil_sim::bus::{BusyInterval, Timeline, Traffic};

    fn media(is_error: bool) -> Vec<MediumReport> {
        let mut timeline = Timeline::default();
        for tick in 0..10 {
            let start_ns = tick * 1_000_000;
            let label = "0x101".to_owned();
            timeline.add(BusyInterval { start_ns, end_ns: start_ns + 300_000, sender: 1, label, is_error });
        }
        let traffic = Traffic {
            medium: "CAN bus".into(),
            load: 0.3,
            packets: 10,
            dropped: 0,
            errors: 0,
            bus_offs: 0,
            longest_s: 3e-4,
        };
        let senders = vec!["master".to_owned(), "slave".to_owned()];
        vec![MediumReport { traffic, senders, timeline, faults: vec![] }]
    }

    #[test]
    fn the_last_ticks_are_shown_with_senders_and_identifiers() {
        let timeline = BusTimeline::of(&media(false), 1_000_000).unwrap();
        assert_eq!(timeline.span_ns, (6_000_000, 10_000_000));
        assert_eq!(timeline.rows.iter().map(|row| row.transmissions.len()).collect::<Vec<_>>(), [0, 4]);
        let text = svg(&timeline).unwrap();
        let document = roxmltree::Document::parse(&text).unwrap();
        let labels: Vec<&str> =
            document.descendants().filter_map(|node| node.text()).map(str::trim).collect();
        for expected in ["master", "slave", "0x101", "6 ms", "10 ms"] {
            assert!(labels.contains(&expected), "`{expected}` is missing from {labels:?}");
        }
        assert!(timeline.description().contains("slave: 4 frames, 1.200 ms, 0 lost"));
    }

    #[test]
    fn a_frame_that_lasts_into_the_next_tick_shows_no_idle_tick() {
        let mut media = media(false);
        let late = BusyInterval {
            start_ns: 9_900_000,
            end_ns: 10_050_000,
            sender: 0,
            label: String::new(),
            is_error: false,
        };
        media[0].timeline.add(late);
        let timeline = BusTimeline::of(&media, 1_000_000).unwrap();
        assert_eq!(timeline.span_ns, (6_000_000, 10_000_000));
        assert_eq!(timeline.rows[0].transmissions[0].span_ns, (9_900_000, 10_000_000));
    }

    #[test]
    fn what_did_not_get_through_is_seen() {
        let red = |is_error| {
            let text = svg(&BusTimeline::of(&media(is_error), 1_000_000).unwrap()).unwrap();
            text.matches("#C41E3A").count()
        };
        assert_eq!((red(false), red(true)), (1, 5), "the legend, and four frames");
    }

    #[test]
    fn an_idle_medium_has_no_picture() {
        assert_eq!(BusTimeline::of(&[], 1_000_000), None);
        assert_eq!(BusTimeline::between(&media(false), 1_000_000, (20_000_000, 30_000_000)), None);
    }
}
