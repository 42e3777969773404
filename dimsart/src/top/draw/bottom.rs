//! Result of the last key, prompt, and list of keys.

use ratatui::style::{Color, Style};
use ratatui::text::{Line, Span};

use super::paint;
use crate::top::screen::{Edited, Mode, Note, Pane, Screen};
use crate::top::text::wrapped;

const KEYS: &str = " s/Space STOP  a arm  d disarm  Enter edit  / filter  ? help  q quit";
/// Keys for a narrow terminal.
const FEW_KEYS: &str = " Space STOP  a arm  d disarm  ? help  q";
const HELP: &str = "Space STOPS every station, always; s too, except while typing. a: arm, d: disarm; c: check and start the \
                    scheme, r: reset, both only while disarmed. ← →: modules, signals, chart, events; ↑ ↓: line. Enter: \
                    edit a parameter; *: not the default. /: filter, Esc clears it. 1-9, Tab: station. q: disarm and \
                    quit.";

/// Returns the bottom lines.
pub(super) fn lines(screen: &Screen, width: usize, height: usize) -> Vec<Line<'static>> {
    // Only the help, which closes with the next key, may hide the state of the device.
    let most = if screen.mode == Mode::Help { height / 2 } else { height / 5 };
    let name = screen.seen().map_or("", |seen| seen.name.as_str());
    let (text, style) = match (&screen.mode, &screen.note) {
        (Mode::Arming, _) => (format!("{name} may move: arm? y/n"), paint(screen, Color::Yellow).bold()),
        (Mode::Editing(edited), _) => {
            let Edited { module, parameter, range, text } = edited;
            (
                format!("{module} {parameter} ({range}) = {text}_  Enter: set, Esc: cancel"),
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

/// Returns the full text of the selected line, which may be truncated in its pane.
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
