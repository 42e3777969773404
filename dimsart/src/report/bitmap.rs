//! Bitmap backend with clean strokes and smooth edges, and PNG output.
//!
//! Plotters outlines a thick line as one polygon, which has spikes where a noisy signal reverses.
//! [`Bitmap`] draws each segment separately and joins them with discs. Averaging squares of `fineness` by `fineness`
//! pixels gives smooth edges.

use plotters::prelude::{BitMapBackend, DrawingBackend};
use plotters_backend::{BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingErrorKind};

/// Vertical offset of text relative to an SVG, as a share of its size.
const TEXT_RISE: f64 = 0.12;

/// [`BitMapBackend`] with its own strokes.
pub(super) struct Bitmap<'a>(BitMapBackend<'a>);

impl<'a> Bitmap<'a> {
    /// Draws into `canvas`, whose length is [`byte_count`] of `size`.
    pub(super) fn new(canvas: &'a mut [u8], size: (u32, u32)) -> Self {
        Self(BitMapBackend::with_buffer(canvas, size))
    }
}

/// Result of drawing on a bitmap.
type Drawn<'a> = Result<(), DrawingErrorKind<<BitMapBackend<'a> as DrawingBackend>::ErrorType>>;

impl<'a> DrawingBackend for Bitmap<'a> {
    type ErrorType = <BitMapBackend<'a> as DrawingBackend>::ErrorType;

    fn get_size(&self) -> (u32, u32) {
        self.0.get_size()
    }

    fn ensure_prepared(&mut self) -> Drawn<'a> {
        self.0.ensure_prepared()
    }

    fn present(&mut self) -> Drawn<'a> {
        self.0.present()
    }

    fn draw_pixel(&mut self, point: BackendCoord, color: BackendColor) -> Drawn<'a> {
        self.0.draw_pixel(point, color)
    }

    fn draw_rect<S: BackendStyle>(
        &mut self,
        upper_left: BackendCoord,
        bottom_right: BackendCoord,
        style: &S,
        fill: bool,
    ) -> Drawn<'a> {
        self.0.draw_rect(upper_left, bottom_right, style, fill)
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Drawn<'a> {
        if style.color().alpha <= 0.0 {
            return Ok(());
        }
        let radius = style.stroke_width() / 2;
        let mut before: Option<BackendCoord> = None;
        for point in path {
            if let Some(before) = before {
                self.fill_polygon(stretch(before, point, style.stroke_width()), style)?;
                self.draw_circle(before, radius, style, true)?;
            }
            before = Some(point);
        }
        Ok(())
    }

    fn draw_text<S: BackendTextStyle>(&mut self, text: &str, style: &S, (x, y): BackendCoord) -> Drawn<'a> {
        let (right, down) = style.transform().transform(0, rounded(TEXT_RISE * style.size()));
        self.0.draw_text(text, style, (x + right, y + down))
    }
}

/// Returns the corners of a straight line from `start` to `end`.
fn stretch(start: BackendCoord, end: BackendCoord, stroke_width: u32) -> [BackendCoord; 4] {
    let (along, down) = (f64::from(end.0 - start.0), f64::from(end.1 - start.1));
    let scale = f64::from(stroke_width) / (2.0 * along.hypot(down).max(1.0));
    let (right, below) = (-down * scale, along * scale);
    [(start, 1.0), (end, 1.0), (end, -1.0), (start, -1.0)]
        .map(|((x, y), side)| (rounded(f64::from(x) + side * right), rounded(f64::from(y) + side * below)))
}

#[expect(clippy::cast_possible_truncation, reason = "pictures are far smaller than i32; a cast saturates")]
fn rounded(length: f64) -> i32 {
    length.round() as i32
}

/// Returns the number of bytes of an RGB picture of `wide` by `high` pixels.
pub(super) fn byte_count((wide, high): (u32, u32)) -> usize {
    wide as usize * high as usize * 3
}

/// Encodes a PNG file of `size` from a canvas that is `fineness` times larger.
///
/// # Errors
/// An error of the encoder.
pub(super) fn encode(canvas: &[u8], size: (u32, u32), fineness: u32) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, size.0, size.1);
    encoder.set_color(png::ColorType::Rgb);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&shrink(canvas, size, fineness))?;
    writer.finish()?;
    Ok(bytes)
}

/// Averages each square of `fineness` by `fineness` RGB pixels into one.
fn shrink(canvas: &[u8], size: (u32, u32), fineness: u32) -> Vec<u8> {
    let square_bytes = 3 * fineness as usize;
    let row_bytes = size.0 as usize * square_bytes;
    let mut small = Vec::with_capacity(byte_count(size));
    for rows in canvas.chunks_exact(row_bytes * fineness as usize) {
        let mut rows: Vec<_> =
            rows.chunks_exact(row_bytes).map(|row| row.chunks(SPAN * square_bytes)).collect();
        loop {
            let spans: Vec<&[u8]> = rows.iter_mut().filter_map(Iterator::next).collect();
            let Some(first) = spans.first() else { break };
            match one_colour(&spans) {
                Some(colour) => small.extend_from_slice(&colour.repeat(first.len() / square_bytes)),
                None => average(&spans, fineness, &mut small),
            }
        }
    }
    small
}

/// Number of squares that are compared together: most of a picture has one colour.
const SPAN: usize = 8;

/// Returns the common colour of all pixels; `None` if they differ.
fn one_colour<'a>(spans: &[&'a [u8]]) -> Option<&'a [u8]> {
    let first = spans.first()?;
    let colour = first.get(..3)?;
    let is_even = first.get(3..) == first.get(..first.len() - 3) && spans.iter().all(|span| span == first);
    is_even.then_some(colour)
}

/// Appends the averages of squares, given by their rows.
fn average(rows: &[&[u8]], fineness: u32, small: &mut Vec<u8>) {
    let square_bytes = 3 * fineness as usize;
    let weight = fineness * fineness;
    let mut sums = vec![0_u32; rows.first().map_or(0, |row| row.len() / fineness as usize)];
    for row in rows {
        for (sum, square) in sums.chunks_exact_mut(3).zip(row.chunks_exact(square_bytes)) {
            for pixel in square.chunks_exact(3) {
                for (channel, byte) in sum.iter_mut().zip(pixel) {
                    *channel += u32::from(*byte);
                }
            }
        }
    }
    small.extend(sums.iter().map(|sum| u8::try_from((sum + weight / 2) / weight).unwrap_or(u8::MAX)));
}

#[cfg(test)]
mod tests {
    use super::*;
    use plotters::style::{Color, RGBColor, ShapeStyle};

    #[test]
    fn shrinking_averages_squares() {
        // Two pixels wide, one high: the left square black, the right one third white.
        let row: Vec<u8> = [0, 0, 0, 255, 0, 0].iter().flat_map(|level| [*level; 3]).collect();
        assert_eq!(shrink(&row.repeat(3), (2, 1), 3), [0, 0, 0, 85, 85, 85]);
    }

    #[test]
    fn spans_of_one_colour_shrink_as_others_do() {
        // Wider than two spans; a red background, and a black pixel in the last square of the last row of one span.
        let (wide, fineness) = (2 * SPAN + 5, 2);
        let mut canvas = [200, 10, 10].repeat(wide * 2 * 2);
        let black = 3 * (2 * wide + 2 * SPAN - 1);
        canvas[black..black + 3].fill(0);
        let mut expected = [200, 10, 10].repeat(wide);
        expected[3 * (SPAN - 1)..3 * SPAN].copy_from_slice(&[150, 8, 8]);
        assert_eq!(shrink(&canvas, (wide.try_into().unwrap(), 1), fineness), expected);
    }

    #[test]
    fn a_line_that_turns_back_stays_within_its_width() {
        let size = (60, 60);
        let mut canvas = vec![0; byte_count(size)];
        let zigzag = [(20, 15), (21, 45), (22, 15), (22, 45), (23, 15)];
        let pen = ShapeStyle { color: RGBColor(255, 255, 255).to_rgba(), filled: false, stroke_width: 6 };
        Bitmap::new(&mut canvas, size).draw_path(zigzag, &pen).unwrap();
        let row_bytes = 3 * 60;
        let inked: Vec<usize> = (0..).zip(&canvas).filter(|(_, byte)| **byte > 0).map(|(at, _)| at).collect();
        assert!(inked.len() > 3 * 30 * 6, "the line itself is drawn");
        for at in inked {
            let (x, y) = (at % row_bytes / 3, at / row_bytes);
            assert!((16..=27).contains(&x) && (11..=49).contains(&y), "ink at ({x}, {y})");
        }
    }
}
