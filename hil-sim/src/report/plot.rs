//! Turns a picture into SVG text and PNG bytes, with the font it carries along.
//!
//! Plotters places everything on whole pixels, so a picture is drawn [`FINENESS`] times larger than it is shown:
//! the SVG gets sub-pixel coordinates from its view box, the PNG smooth edges from averaging.

use std::sync::Once;

use plotters::coord::Shift;
use plotters::drawing::DrawingAreaErrorKind;
use plotters::prelude::{
    BitMapBackend, DrawingArea, DrawingBackend, FontStyle, IntoDrawingArea, IntoFont, RGBColor, SVGBackend,
    TextStyle,
};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, register_font};

/// Canvas units per pixel shown.
const FINENESS: u32 = 3;

/// `DejaVu Sans` is the one drawn into a PNG; an SVG falls back to what its viewer has of the same width.
const FONT: &str = "DejaVu Sans, Verdana, sans-serif";

pub(super) const BLACK: RGBColor = RGBColor(0x1f, 0x25, 0x2b);
pub(super) const GREY: RGBColor = RGBColor(0x6b, 0x75, 0x80);
pub(super) const GRID: RGBColor = RGBColor(0xe3, 0xe7, 0xeb);
pub(super) const WHITE: RGBColor = RGBColor(0xff, 0xff, 0xff);

/// Colours that stay apart for every kind of colour vision (Okabe and Ito, 2008), darkest first.
const PALETTE: [RGBColor; 6] = [
    RGBColor(0x00, 0x72, 0xb2),
    RGBColor(0xd5, 0x5e, 0x00),
    RGBColor(0x00, 0x9e, 0x73),
    RGBColor(0xb4, 0x5c, 0x96),
    RGBColor(0xd6, 0x90, 0x00),
    RGBColor(0x3f, 0xa3, 0xdc),
];

/// The `index`-th colour of the palette, over and over.
pub(super) fn color(index: usize) -> RGBColor {
    PALETTE.get(index % PALETTE.len()).copied().unwrap_or(BLACK)
}

/// Where a picture is drawn.
pub(super) type Area<B> = DrawingArea<B, Shift>;

/// What drawing on `B` returns.
pub(super) type Drawn<B> = Result<(), DrawingAreaErrorKind<<B as DrawingBackend>::ErrorType>>;

/// Something that can be drawn, on any backend.
pub(super) trait Picture {
    /// Width and height as shown, pixels.
    fn size(&self) -> (u32, u32);

    /// Draws on `area`, which is white and as large as [`size`](Self::size) says; lengths go through [`px`].
    fn draw<B: DrawingBackend>(&self, area: &Area<B>) -> Drawn<B>;
}

/// Canvas units of a length in shown pixels.
#[expect(clippy::cast_possible_truncation, reason = "pictures are far smaller than i32; a cast saturates")]
pub(super) fn px(length: f64) -> i32 {
    (length * f64::from(FINENESS)).round() as i32
}

/// Shown pixels of a length in canvas units.
pub(super) fn shown(length: i32) -> f64 {
    f64::from(length) / f64::from(FINENESS)
}

/// [`px`] for widths, which have no sign.
pub(super) fn width(length: f64) -> u32 {
    px(length).unsigned_abs()
}

/// Text of `size` shown pixels.
pub(super) fn font(size: f64, style: FontStyle, color: RGBColor) -> TextStyle<'static> {
    let font = (FONT, f64::from(px(size))).into_font().style(style);
    TextStyle { color: color.to_backend_color(), ..TextStyle::from(font) }
}

/// Text placed by its `horizontal` edge and its vertical middle.
pub(super) fn label<B: DrawingBackend>(
    area: &Area<B>,
    text: &str,
    (x, y): (f64, f64),
    horizontal: HPos,
    style: &TextStyle<'static>,
) -> Drawn<B> {
    area.draw_text(text, &style.pos(Pos::new(horizontal, VPos::Center)), (px(x), px(y)))
}

/// Width of `text`, shown pixels.
pub(super) fn text_width(text: &str, style: &TextStyle<'static>) -> f64 {
    style.font.layout_box(text).map_or(0.0, |((left, _), (right, _))| shown(right - left))
}

/// The picture as SVG text.
///
/// # Errors
/// What the drawing backend reports, as text.
pub(super) fn svg(picture: &impl Picture) -> Result<String, String> {
    let (wide, high) = picture.size();
    let fine = (wide * FINENESS, high * FINENESS);
    let mut text = String::new();
    draw_on(SVGBackend::with_string(&mut text, fine), picture)?;
    let [drawn, shown] = [fine, (wide, high)].map(|(w, h)| format!("width=\"{w}\" height=\"{h}\""));
    Ok(text.replacen(&drawn, &shown, 1))
}

/// The picture as the bytes of a PNG file.
///
/// # Errors
/// What the drawing backend or the encoder reports, as text.
pub(super) fn png(picture: &impl Picture) -> Result<Vec<u8>, String> {
    let (wide, high) = picture.size();
    let fine = (wide * FINENESS, high * FINENESS);
    let mut canvas = vec![0_u8; bytes_of(fine)];
    draw_on(BitMapBackend::with_buffer(&mut canvas, fine), picture)?;
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, wide, high);
    encoder.set_color(png::ColorType::Rgb);
    let mut writer = encoder.write_header().map_err(|error| error.to_string())?;
    writer.write_image_data(&shrink(&canvas, (wide, high))).map_err(|error| error.to_string())?;
    writer.finish().map_err(|error| error.to_string())?;
    Ok(bytes)
}

fn bytes_of((wide, high): (u32, u32)) -> usize {
    wide as usize * high as usize * 3
}

fn draw_on<B: DrawingBackend>(backend: B, picture: &impl Picture) -> Result<(), String> {
    static FONTS: Once = Once::new();
    FONTS.call_once(|| {
        for (style, bytes) in
            [(FontStyle::Normal, dejavu::sans::regular()), (FontStyle::Bold, dejavu::sans::bold())]
        {
            // A font that does not load shows up as an error of the first text drawn with it.
            let _ = register_font(FONT, style, bytes);
        }
    });
    let area = backend.into_drawing_area();
    area.fill(&WHITE.to_rgba())
        .and_then(|()| picture.draw(&area))
        .and_then(|()| area.present())
        .map_err(|error| error.to_string())
}

/// Averages each square of `FINENESS` by `FINENESS` RGB pixels into one.
fn shrink(canvas: &[u8], (wide, high): (u32, u32)) -> Vec<u8> {
    let fineness = FINENESS as usize;
    let row_bytes = wide as usize * fineness * 3;
    let mut sums = vec![0_u32; wide as usize * 3];
    let mut small = Vec::with_capacity(bytes_of((wide, high)));
    for rows in canvas.chunks_exact(row_bytes * fineness) {
        sums.fill(0);
        for row in rows.chunks_exact(row_bytes) {
            for (sum, square) in sums.chunks_exact_mut(3).zip(row.chunks_exact(3 * fineness)) {
                for pixel in square.chunks_exact(3) {
                    for (channel, byte) in sum.iter_mut().zip(pixel) {
                        *channel += u32::from(*byte);
                    }
                }
            }
        }
        let weight = FINENESS * FINENESS;
        small.extend(sums.iter().map(|sum| u8::try_from((sum + weight / 2) / weight).unwrap_or(u8::MAX)));
    }
    small
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shrinking_averages_squares() {
        // Two pixels wide, one high: the left square black, the right one third white.
        let row: Vec<u8> = [0, 0, 0, 255, 0, 0].iter().flat_map(|level| [*level; 3]).collect();
        assert_eq!(shrink(&row.repeat(3), (2, 1)), [0, 0, 0, 85, 85, 85]);
    }
}
