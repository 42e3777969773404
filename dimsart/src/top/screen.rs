//! State of the screen, and its changes by keys.

use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyEventKind, KeyModifiers};

use super::seen::{Entry, ModuleLine, Seen, SignalLine};

/// An action requested by the user.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Wish {
    Arm {
        station: usize,
    },
    Disarm {
        station: usize,
    },
    /// Stops every station.
    Stop,
    /// Checks the scheme of a device at rest and starts it.
    Check {
        station: usize,
    },
    /// Clears its fault.
    Reset {
        station: usize,
    },
    Set {
        station: usize,
        module: String,
        parameter: String,
        value: String,
    },
    Quit,
}

/// A part of the screen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Pane {
    Modules,
    Signals,
    Chart,
    Events,
}

/// In the order of the keys ← and →.
const PANES: [Pane; 4] = [Pane::Modules, Pane::Signals, Pane::Chart, Pane::Events];
/// Lines of `PgUp` and `PgDn`.
const PAGE: isize = 10;

/// Present use of the keys.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Mode {
    Looking,
    /// Asks for confirmation before arming.
    Arming,
    Editing(Edited),
    Filtering,
    Help,
}

/// A value that is being typed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Edited {
    pub(super) module: String,
    pub(super) parameter: String,
    pub(super) range: String,
    pub(super) text: String,
}

/// Result of an action.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Note {
    pub(super) text: String,
    pub(super) is_bad: bool,
}

/// State of the screen.
#[derive(Debug)]
pub(super) struct Screen {
    pub(super) stations: Vec<Seen>,
    /// Index of the shown station.
    pub(super) at: usize,
    pub(super) pane: Pane,
    pub(super) mode: Mode,
    pub(super) note: Option<Note>,
    pub(super) has_colours: bool,
    /// Indexed by [`Screen::list`].
    filters: [String; 3],
    selected: [usize; 3],
}

impl Screen {
    pub(super) fn new(names: &[&str], has_colours: bool) -> Self {
        Self {
            stations: names.iter().map(|name| Seen::new(name)).collect(),
            at: 0,
            pane: Pane::Modules,
            mode: Mode::Looking,
            note: None,
            has_colours,
            filters: Default::default(),
            selected: Default::default(),
        }
    }

    /// Returns the shown station.
    pub(super) fn seen(&self) -> Option<&Seen> {
        self.stations.get(self.at)
    }

    /// Handles news of a station.
    pub(super) fn hear(&mut self, station: usize, text: &str) {
        let Some(seen) = self.stations.get_mut(station) else { return };
        if let Some(lost) = seen.hear(text) {
            let text = format!("{}: {lost}", seen.name);
            self.note = Some(Note { text, is_bad: true });
        }
    }

    /// Shows the result of an action. An error stays until the next key, so that a later success does not hide it.
    pub(super) fn tell(&mut self, text: String, is_bad: bool) {
        if !is_bad && self.note.as_ref().is_some_and(|note| note.is_bad) {
            return;
        }
        self.note = Some(Note { text, is_bad });
    }

    pub(super) fn filter(&self, pane: Pane) -> &str {
        self.filters.get(Self::list(pane)).map_or("", String::as_str)
    }

    /// Returns the selected line of a pane's list.
    pub(super) fn selected(&self, pane: Pane) -> usize {
        let last = self.lines(pane).saturating_sub(1);
        self.selected.get(Self::list(pane)).map_or(0, |selected| (*selected).min(last))
    }

    /// Returns the lines of the modules.
    pub(super) fn modules(&self) -> Vec<ModuleLine<'_>> {
        self.seen().map(|seen| seen.modules(self.filter(Pane::Modules))).unwrap_or_default()
    }

    /// Returns the selected parameter value; module lines cannot be selected.
    pub(super) fn entry(&self) -> Option<Entry<'_>> {
        entries(&self.modules()).nth(self.selected(Pane::Modules))
    }

    /// Returns the lines of the signals.
    pub(super) fn signals(&self) -> Vec<SignalLine<'_>> {
        self.seen().map(|seen| seen.signals(self.filter(Pane::Signals))).unwrap_or_default()
    }

    /// Returns the selected signal.
    pub(super) fn signal(&self) -> Option<SignalLine<'_>> {
        self.signals().get(self.selected(Pane::Signals)).copied()
    }

    /// Handles a key.
    pub(super) fn key(&mut self, key: KeyEvent) -> Option<Wish> {
        if key.kind == KeyEventKind::Release {
            return None;
        }
        self.note = None;
        if key.code == KeyCode::Char('c') && key.modifiers.contains(KeyModifiers::CONTROL) {
            return Some(Wish::Quit);
        }
        // STOP in every mode: no value and no name contains a space.
        if key.code == KeyCode::Char(' ') {
            self.mode = Mode::Looking;
            return Some(Wish::Stop);
        }
        match std::mem::replace(&mut self.mode, Mode::Looking) {
            Mode::Looking => self.look(key.code),
            Mode::Help => None,
            Mode::Arming => {
                matches!(key.code, KeyCode::Char('y' | 'Y')).then_some(Wish::Arm { station: self.at })
            }
            Mode::Editing(edited) => self.edit(edited, key.code),
            Mode::Filtering => {
                self.type_filter(key.code);
                None
            }
        }
    }

    fn look(&mut self, key: KeyCode) -> Option<Wish> {
        match key {
            KeyCode::Char('q') => return Some(Wish::Quit),
            KeyCode::Char('s') => return Some(Wish::Stop),
            KeyCode::Char('d') => return Some(Wish::Disarm { station: self.at }),
            KeyCode::Char('c' | 'r') if self.seen().is_some_and(Seen::is_held_here) => {
                self.tell(
                    "armed: the device would move at once; press `d`, then `c` or `r`, then `a`".to_owned(),
                    true,
                );
            }
            KeyCode::Char('c') => return Some(Wish::Check { station: self.at }),
            KeyCode::Char('r') => return Some(Wish::Reset { station: self.at }),
            KeyCode::Char('a') => self.mode = Mode::Arming,
            KeyCode::Char('/') => self.mode = Mode::Filtering,
            KeyCode::Char('?') => self.mode = Mode::Help,
            KeyCode::Char(digit @ '1'..='9') => {
                let place = digit.to_digit(10).and_then(|digit| usize::try_from(digit).ok());
                self.show(place.map_or(0, |place| place - 1));
            }
            KeyCode::Tab => self.show((self.at + 1) % self.stations.len().max(1)),
            KeyCode::BackTab => {
                self.show(self.at.checked_sub(1).unwrap_or(self.stations.len().saturating_sub(1)))
            }
            KeyCode::Left => self.turn(PANES.len() - 1),
            KeyCode::Right => self.turn(1),
            KeyCode::Up => self.walk(-1),
            KeyCode::Down => self.walk(1),
            KeyCode::PageUp => self.walk(-PAGE),
            KeyCode::PageDown => self.walk(PAGE),
            KeyCode::Home => self.walk(isize::MIN),
            KeyCode::End => self.walk(isize::MAX),
            KeyCode::Esc => self.set_filter(String::new()),
            KeyCode::Enter => match self.entry() {
                Some(entry) if self.pane == Pane::Modules => {
                    let edited = Edited {
                        module: entry.module.to_owned(),
                        parameter: entry.name(),
                        range: entry.range(),
                        text: String::new(),
                    };
                    self.mode = Mode::Editing(edited);
                }
                _ => self.tell("Enter edits a parameter: select a parameter with ← → ↑ ↓".to_owned(), false),
            },
            _ => {}
        }
        None
    }

    fn edit(&mut self, mut edited: Edited, key: KeyCode) -> Option<Wish> {
        match key {
            KeyCode::Esc => return None,
            KeyCode::Enter if edited.text.is_empty() => return None,
            KeyCode::Enter => {
                let Edited { module, parameter, text, .. } = edited;
                return Some(Wish::Set { station: self.at, module, parameter, value: text });
            }
            KeyCode::Backspace => drop(edited.text.pop()),
            KeyCode::Char(letter) => edited.text.push(letter),
            _ => {}
        }
        self.mode = Mode::Editing(edited);
        None
    }

    fn type_filter(&mut self, key: KeyCode) {
        let mut filter = self.filter(self.pane).to_owned();
        match key {
            KeyCode::Enter => return,
            KeyCode::Esc => return self.set_filter(String::new()),
            KeyCode::Backspace => drop(filter.pop()),
            KeyCode::Char(letter) => filter.push(letter),
            _ => {}
        }
        self.set_filter(filter);
        self.mode = Mode::Filtering;
    }

    fn show(&mut self, station: usize) {
        if station < self.stations.len() {
            self.at = station;
        }
    }

    fn turn(&mut self, steps: usize) {
        let here = PANES.iter().position(|pane| *pane == self.pane).unwrap_or_default();
        self.pane = PANES.get((here + steps) % PANES.len()).copied().unwrap_or(self.pane);
    }

    fn walk(&mut self, lines: isize) {
        let walked = self.selected(self.pane).saturating_add_signed(lines);
        let last = self.lines(self.pane).saturating_sub(1);
        if let Some(selected) = self.selected.get_mut(Self::list(self.pane)) {
            *selected = walked.min(last);
        }
    }

    fn set_filter(&mut self, filter: String) {
        let list = Self::list(self.pane);
        if let (Some(known), Some(selected)) = (self.filters.get_mut(list), self.selected.get_mut(list)) {
            (*known, *selected) = (filter, 0);
        }
    }

    /// Returns the number of selectable lines.
    fn lines(&self, pane: Pane) -> usize {
        match pane {
            Pane::Modules => entries(&self.modules()).count(),
            Pane::Signals | Pane::Chart => self.signals().len(),
            Pane::Events => self.seen().map_or(0, |seen| seen.events(self.filter(pane)).len()),
        }
    }

    /// Returns the list of a pane: the chart shows the selected signal.
    fn list(pane: Pane) -> usize {
        match pane {
            Pane::Modules => 0,
            Pane::Signals | Pane::Chart => 1,
            Pane::Events => 2,
        }
    }
}

fn entries<'a, 'b>(lines: &'b [ModuleLine<'a>]) -> impl Iterator<Item = Entry<'a>> + use<'a, 'b> {
    lines.iter().filter_map(|line| match line {
        ModuleLine::Entry(entry) => Some(*entry),
        ModuleLine::Module(_) => None,
    })
}
