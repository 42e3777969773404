//! A screen, drawn: what matters first, for the smallest terminal, too.

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

/// Draws it. Without colours nothing is lost: what has one has a mark or a word, too.
pub(super) fn draw(frame: &mut Frame<'_>, screen: &Screen) {
    let area = frame.area();
    let (width, height) = (usize::from(area.width), usize::from(area.height));
    let (head, bottom) = (head::lines(screen, width), bottom::lines(screen, width, height));
    // Where there is no room for all, modules and signals give way first, the keys last.
    let length = |lines: &[Line<'_>]| u16::try_from(lines.len()).unwrap_or(u16::MAX).min(area.height);
    let below = length(&bottom);
    let above = length(&head).min(area.height - below);
    let parts = Layout::vertical([Constraint::Length(above), Constraint::Fill(1), Constraint::Length(below)]);
    let [above, middle, below] = parts.areas(area);
    frame.render_widget(Paragraph::new(head), above);
    body::draw(frame, screen, middle);
    frame.render_widget(Paragraph::new(bottom), below);
}

/// One of the terminal's own colours, where colours are wanted.
fn paint(screen: &Screen, colour: Color) -> Style {
    if screen.has_colours { Style::new().fg(colour) } else { Style::new() }
}
