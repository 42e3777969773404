//! Modules, signals, chart and events: together on a large terminal, otherwise only the selected pane.

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, List, ListItem, ListState};

use super::{chart, paint};
use crate::top::messages::Event;
use crate::top::screen::{Pane, Screen};
use crate::top::seen::{Entry, ModuleLine, SignalLine};

/// Minimum size for all panes.
const WIDE: u16 = 72;
const HIGH: u16 = 12;

pub(super) fn draw(frame: &mut Frame<'_>, screen: &Screen, area: Rect) {
    if area.width < WIDE || area.height < HIGH {
        return pane(frame, screen, screen.pane, area);
    }
    let halves = Layout::vertical([Constraint::Percentage(50), Constraint::Percentage(50)]);
    let columns = Layout::horizontal([Constraint::Percentage(58), Constraint::Percentage(42)]);
    let [upper, lower] = halves.areas(area);
    let ([modules, signals], [plot, events]) = (columns.areas(upper), columns.areas(lower));
    let panes =
        [(Pane::Modules, modules), (Pane::Signals, signals), (Pane::Chart, plot), (Pane::Events, events)];
    panes.into_iter().for_each(|(which, area)| pane(frame, screen, which, area));
}

fn pane(frame: &mut Frame<'_>, screen: &Screen, which: Pane, area: Rect) {
    let (title, lines) = match which {
        Pane::Chart => return chart::draw(frame, screen, frame_of(screen, which, String::new()), area),
        Pane::Modules => ("modules", modules(screen, which)),
        Pane::Signals => ("signals", signals(screen)),
        Pane::Events => ("events", events(screen, which)),
    };
    let filter = screen.filter(which);
    let title = if filter.is_empty() { title.to_owned() } else { format!("{title} /{filter}") };
    let (items, selected) = lines;
    let is_chosen = which == screen.pane;
    let chosen =
        if is_chosen { Style::new().reversed() } else { Style::new().add_modifier(Modifier::UNDERLINED) };
    let list = List::new(items).block(frame_of(screen, which, title)).highlight_style(chosen);
    let mut state = ListState::default().with_selected(selected);
    frame.render_stateful_widget(list, area, &mut state);
}

/// Returns the frame of a pane, thick for the selected pane.
fn frame_of(screen: &Screen, which: Pane, title: String) -> Block<'static> {
    let block = Block::bordered().title(title);
    if which == screen.pane {
        block.border_type(ratatui::widgets::BorderType::Thick).border_style(Style::new().bold())
    } else {
        block
    }
}

type Lines<'a> = (Vec<ListItem<'a>>, Option<usize>);

fn modules(screen: &Screen, which: Pane) -> Lines<'_> {
    let lines = screen.modules();
    let is_entry = |line: &ModuleLine<'_>| matches!(line, ModuleLine::Entry(_));
    let entries = lines.iter().enumerate().filter(|(_, line)| is_entry(line));
    let selected = entries.map(|(place, _)| place).nth(screen.selected(which));
    let item = |line: &ModuleLine<'_>| match line {
        ModuleLine::Module(module) => {
            let place = module.place.map_or_else(|| "unplugged:".to_owned(), |place| format!("{place}."));
            ListItem::new(Line::styled(format!("{place} {}", module.name), Style::new().bold()))
        }
        ModuleLine::Entry(entry) => ListItem::new(parameter(screen, entry)),
    };
    (lines.iter().map(item).collect(), selected)
}

fn parameter(screen: &Screen, entry: &Entry<'_>) -> Line<'static> {
    let (mark, style) = match entry.differs_from_default() {
        true => ('*', paint(screen, Color::Cyan).bold()),
        false => (' ', Style::new()),
    };
    let default = entry.default_text().map_or(String::new(), |default| format!(", default {default}"));
    Line::from(vec![
        Span::styled(format!("{mark}{:<13} {}", entry.name(), entry.text()), style),
        Span::styled(format!("  {}{default}", entry.range()), Style::new().dim()),
    ])
}

fn signals(screen: &Screen) -> Lines<'_> {
    let (seen, lines) = (screen.seen(), screen.signals());
    let item = |line: &SignalLine<'_>| {
        let value = seen.map_or_else(String::new, |seen| seen.signal_value(*line));
        ListItem::new(format!("{:<14} {value:>10} {}", line.name(), line.signal.unit))
    };
    (lines.iter().map(item).collect(), Some(screen.selected(Pane::Signals)))
}

fn events(screen: &Screen, which: Pane) -> Lines<'_> {
    let events = screen.seen().map(|seen| seen.events(screen.filter(which))).unwrap_or_default();
    let item = |event: &&Event| ListItem::new(event.to_string());
    let selected = (which == screen.pane).then(|| screen.selected(which));
    (events.iter().map(item).collect(), selected)
}
