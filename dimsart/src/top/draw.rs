//! Draws a screen, by priority on small terminals.

mod body;
mod bottom;
mod chart;
mod head;

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout};
use ratatui::style::{Color, Style};
use ratatui::text::Line;
use ratatui::widgets::Paragraph;

use super::screen::Screen;

/// Draws the screen. Colours only repeat marks and words.
pub(super) fn draw(frame: &mut Frame<'_>, screen: &Screen) {
    let area = frame.area();
    let (width, height) = (usize::from(area.width), usize::from(area.height));
    let (head, bottom) = (head::lines(screen, width), bottom::lines(screen, width, height));
    // On a small terminal, modules and signals shrink first, the keys last.
    let length = |lines: &[Line<'_>]| u16::try_from(lines.len()).unwrap_or(u16::MAX).min(area.height);
    let below = length(&bottom);
    let above = length(&head).min(area.height - below);
    let parts = Layout::vertical([Constraint::Length(above), Constraint::Fill(1), Constraint::Length(below)]);
    let [above, middle, below] = parts.areas(area);
    frame.render_widget(Paragraph::new(head), above);
    body::draw(frame, screen, middle);
    frame.render_widget(Paragraph::new(bottom), below);
}

/// Returns a style with a terminal colour, unless colours are disabled.
fn paint(screen: &Screen, colour: Color) -> Style {
    if screen.has_colours { Style::new().fg(colour) } else { Style::new() }
}
