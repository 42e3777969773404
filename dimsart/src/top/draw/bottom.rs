//! What came of the last key, what is asked or typed now, and the keys.

use ratatui::style::{Color, Style};
use ratatui::text::{Line, Span};

use super::paint;
use crate::top::screen::{Edited, Mode, Note, Pane, Screen};
use crate::top::text::wrapped;

/// Lines of a sentence at most.
const MOST: usize = 4;
const KEYS: &str = " s/Space STOP  a arm  d disarm  Enter edit  / filter  ? help  q quit";
/// Where the others have no room.
const FEW_KEYS: &str = " Space STOP  a arm  d disarm  ? help  q";
const HELP: &str = "Space STOPS every station, always; s too, unless you type. 1-9, Tab: station. ← →: modules, signals, chart, \
                    events. ↑ ↓ PgUp PgDn: line. Enter: edit the parameter. /: filter, Esc ends it. a: arm, d: disarm. \
                    q, Ctrl-C: quit, the device at rest. A parameter with * differs from its default.";

/// Down to the bottom.
pub(super) fn lines(screen: &Screen, width: usize) -> Vec<Line<'static>> {
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
        wrapped(&text, width, MOST).into_iter().map(|line| Line::styled(line, style)).collect();
    let keys = if width < KEYS.chars().count() { FEW_KEYS } else { KEYS };
    lines.push(Line::from(Span::styled(keys, Style::new().reversed())));
    lines
}

/// All of a parameter, whose line may be too short for it.
fn chosen(screen: &Screen) -> Option<String> {
    let entry = screen.entry().filter(|_| screen.pane == Pane::Modules)?;
    let default = entry.default_text().map_or(String::new(), |default| format!(", default {default}"));
    let (name, value, range) = (entry.name(), entry.text(), entry.range());
    Some(format!("{} {name} = {value} ({range}{default}) {}", entry.module, entry.parameter.summary))
}
