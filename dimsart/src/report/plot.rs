//! Renders a picture as SVG text; an embedded font gives the widths of texts.
//!
//! Plotters uses whole pixels, so a picture is drawn [`FINENESS`] times larger than displayed: the view box gives sub-pixel
//! coordinates.

use std::sync::Once;

use plotters::coord::Shift;
use plotters::drawing::DrawingAreaErrorKind;
use plotters::prelude::{DrawingArea, FontStyle, IntoDrawingArea, RGBColor, SVGBackend, TextStyle};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, FontDesc, FontFamily, FontTransform, register_font};

/// Vertical offset of centred capitals, as a share of the text's size: a backend centres lower-case letters.
const CAPITALS_RISE: f64 = 0.07;

/// Canvas units per displayed pixel.
const FINENESS: u32 = 3;

/// A viewer without `DejaVu Sans` falls back to a font of the same width.
const FONT: &str = "DejaVu Sans, Verdana, sans-serif";

pub(super) const BLACK: RGBColor = RGBColor(0x1f, 0x25, 0x2b);
pub(super) const GREY: RGBColor = RGBColor(0x6b, 0x75, 0x80);
pub(super) const LIGHT_GREY: RGBColor = RGBColor(0xb4, 0xbc, 0xc4);
pub(super) const GRID: RGBColor = RGBColor(0xe3, 0xe7, 0xeb);
pub(super) const WHITE: RGBColor = RGBColor(0xff, 0xff, 0xff);

/// Colours that are distinct for every kind of colour vision (after Okabe and Ito, 2008), dark enough for white text.
const PALETTE: [RGBColor; 8] = [
    RGBColor(0x00, 0x6d, 0xaa),
    RGBColor(0xd2, 0x5a, 0x00),
    RGBColor(0x00, 0x8a, 0x64),
    RGBColor(0xa6, 0x52, 0x8c),
    RGBColor(0xb5, 0x7d, 0x00),
    RGBColor(0x2b, 0x90, 0xc4),
    RGBColor(0x5b, 0x68, 0x76),
    RGBColor(0x8a, 0x55, 0x36),
];

/// Returns colour `index` of the palette, repeated cyclically.
pub(super) fn color(index: usize) -> RGBColor {
    PALETTE.get(index % PALETTE.len()).copied().unwrap_or(BLACK)
}

/// Drawing area of a picture.
pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Result of drawing.
pub(super) type Drawn = Result<(), DrawingAreaErrorKind<std::io::Error>>;

/// A picture.
pub(super) trait Picture {
    /// Returns width and height in displayed pixels.
    fn size(&self) -> (u32, u32);

    /// Draws on a white `area` of this [`size`](Self::size); lengths are converted by [`px`].
    fn draw(&self, area: &Area<'_>) -> Drawn;
}

/// Converts displayed pixels to canvas units.
#[expect(clippy::cast_possible_truncation, reason = "pictures are far smaller than i32; a cast saturates")]
pub(super) fn px(length: f64) -> i32 {
    (length * f64::from(FINENESS)).round() as i32
}

/// Converts canvas units to displayed pixels.
pub(super) fn shown(length: i32) -> f64 {
    f64::from(length) / f64::from(FINENESS)
}

/// [`px`] for unsigned widths.
pub(super) fn width(length: f64) -> u32 {
    px(length).unsigned_abs()
}

/// Returns a font of `size` displayed pixels.
pub(super) fn font(size: f64, style: FontStyle, color: RGBColor) -> TextStyle<'static> {
    let font = FontDesc::new(FontFamily::Name(FONT), f64::from(px(size)), style);
    TextStyle { color: color.to_backend_color(), ..TextStyle::from(font) }
}

/// Draws text, placed by its `horizontal` edge and the middle of its capitals.
pub(super) fn label(
    area: &Area<'_>,
    text: &str,
    (x, y): (f64, f64),
    horizontal: HPos,
    style: &TextStyle<'static>,
) -> Drawn {
    let middle = px(y + CAPITALS_RISE * shown_size(style));
    area.draw_text(text, &style.pos(Pos::new(horizontal, VPos::Center)), (px(x), middle))
}

/// Draws vertical text, placed by its middle.
pub(super) fn upright_label(
    area: &Area<'_>,
    text: &str,
    (x, y): (f64, f64),
    style: &TextStyle<'static>,
) -> Drawn {
    let style = style.transform(FontTransform::Rotate270).pos(Pos::new(HPos::Center, VPos::Center));
    area.draw_text(text, &style, (px(x), px(y)))
}

fn shown_size(style: &TextStyle<'static>) -> f64 {
    style.font.get_size() / f64::from(FINENESS)
}

/// Returns a [`font`] of at most `size` with which `text` fits in `room`.
pub(super) fn fitting(
    text: &str,
    room: f64,
    size: f64,
    style: FontStyle,
    color: RGBColor,
) -> TextStyle<'static> {
    let natural = text_width(text, &font(size, style, color)).max(1.0);
    font((size * room / natural).clamp(7.0, size), style, color)
}

/// Returns the width of `text` in displayed pixels.
pub(super) fn text_width(text: &str, style: &TextStyle<'static>) -> f64 {
    style.font.layout_box(text).map_or(0.0, |((left, _), (right, _))| shown(right - left))
}

/// Renders the picture as SVG text.
///
/// # Errors
/// An error of the drawing backend, as text.
pub(super) fn svg(picture: &impl Picture) -> Result<String, String> {
    static FONTS: Once = Once::new();
    FONTS.call_once(|| {
        for (style, bytes) in
            [(FontStyle::Normal, dejavu::sans::regular()), (FontStyle::Bold, dejavu::sans::bold())]
        {
            // A font that fails to load is reported by the first text drawn with it.
            let _ = register_font(FONT, style, bytes);
        }
    });
    let (wide, high) = picture.size();
    let fine = (wide * FINENESS, high * FINENESS);
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, fine).into_drawing_area();
        area.fill(&WHITE.to_rgba())
            .and_then(|()| picture.draw(&area))
            .and_then(|()| area.present())
            .map_err(|error| error.to_string())?;
    }
    let [drawn, shown] = [fine, (wide, high)].map(|(w, h)| format!("width=\"{w}\" height=\"{h}\""));
    Ok(text.replacen(&drawn, &shown, 1))
}
