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
    let width = usize::from(area.width);
    let (head, bottom) = (head::lines(screen, width), bottom::lines(screen, width));
    let height = |lines: &[Line<'_>]| Constraint::Length(u16::try_from(lines.len()).unwrap_or(u16::MAX));
    // Where there is no room for all, the modules give way, and what is wrong goes before the keys.
    let parts = Layout::vertical([height(&head), Constraint::Fill(1), height(&bottom)]);
    let [above, middle, below] = parts.areas(area);
    frame.render_widget(Paragraph::new(head), above);
    body::draw(frame, screen, middle);
    frame.render_widget(Paragraph::new(bottom), below);
}

/// One of the terminal's own colours, where colours are wanted.
fn paint(screen: &Screen, colour: Color) -> Style {
    if screen.has_colours { Style::new().fg(colour) } else { Style::new() }
}
