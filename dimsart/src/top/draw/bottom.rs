//! What came of the last key, what is asked or typed now, and the keys.

use ratatui::style::{Color, Style};
use ratatui::text::{Line, Span};

use super::paint;
use crate::top::screen::{Edited, Mode, Note, Pane, Screen};
use crate::top::text::wrapped;

const KEYS: &str = " s/Space STOP  a arm  d disarm  Enter edit  / filter  ? help  q quit";
/// Where the others have no room.
const FEW_KEYS: &str = " Space STOP  a arm  d disarm  ? help  q";
const HELP: &str = "Space STOPS every station, always; s too, unless you type. a: arm, d: disarm; c: check, which starts the \
                    scheme, r: reset, both of a device at rest. ← →: modules, signals, chart, events; ↑ ↓: line. Enter: \
                    edit a parameter; * differs from its default. /: filter, Esc ends it. 1-9, Tab: station. q: quit, at \
                    rest.";

/// Down to the bottom.
pub(super) fn lines(screen: &Screen, width: usize, height: usize) -> Vec<Line<'static>> {
    // Only help, which goes with the next key, may hide how the device is doing.
    let most = if screen.mode == Mode::Help { height / 2 } else { height / 5 };
    let name = screen.seen().map_or("", |seen| seen.name.as_str());
    let (text, style) = match (&screen.mode, &screen.note) {
        (Mode::Arming, _) => {
            (format!("this lets {name} move: arm it? y/n"), paint(screen, Color::Yellow).bold())
        }
        (Mode::Editing(edited), _) => {
            let Edited { module, parameter, range, text } = edited;
            (
                format!("{module} {parameter} ({range}) = {text}_  Enter sets it, Esc does not"),
                Style::new().bold(),
            )
        }
        (Mode::Filtering, _) => (format!("/{}_", screen.filter(screen.pane)), Style::new().bold()),
        (Mode::Help, _) => (HELP.to_owned(), Style::new()),
        (Mode::Looking, Some(Note { text, is_bad: true })) => {
            (text.clone(), paint(screen, Color::Red).bold())
        }
        (Mode::Looking, Some(Note { text, .. })) => (text.clone(), Style::new()),
        (Mode::Looking, None) => (chosen(screen).unwrap_or_default(), Style::new()),
    };
    let mut lines: Vec<Line<'_>> =
        wrapped(&text, width, most.max(1)).into_iter().map(|line| Line::styled(line, style)).collect();
    let keys = if width < KEYS.chars().count() { FEW_KEYS } else { KEYS };
    lines.push(Line::from(Span::styled(keys, Style::new().reversed())));
    lines
}

/// All of what is chosen, whose line may be too short for it.
fn chosen(screen: &Screen) -> Option<String> {
    if screen.pane == Pane::Events {
        let events = screen.seen()?.events(screen.filter(Pane::Events));
        return events.get(screen.selected(Pane::Events)).map(ToString::to_string);
    }
    let entry = screen.entry().filter(|_| screen.pane == Pane::Modules)?;
    let default = entry.default_text().map_or(String::new(), |default| format!(", default {default}"));
    let (name, value, range) = (entry.name(), entry.text(), entry.range());
    Some(format!("{} {name} = {value} ({range}{default}) {}", entry.module, entry.parameter.summary))
}
