//! Latest news of a station.

use serde_json::Value;

use super::live::Live;
use super::messages::{Event, Faults, Module, Overview, Parameter, Signal, Status, Told};
use super::text;

/// Known state of a station.
#[derive(Debug, Default)]
pub(super) struct Seen {
    pub(super) name: String,
    /// Why its line is closed.
    pub(super) gone: Option<String>,
    pub(super) status: Option<Status>,
    pub(super) faults: Option<Faults>,
    pub(super) overview: Option<Overview>,
    pub(super) events: Vec<Event>,
    pub(super) live: Live,
}

/// A line of the modules.
#[derive(Debug)]
pub(super) enum ModuleLine<'a> {
    Module(&'a Module),
    Entry(Entry<'a>),
}

/// A value of a parameter.
#[derive(Debug, Clone, Copy)]
pub(super) struct Entry<'a> {
    pub(super) module: &'a str,
    pub(super) parameter: &'a Parameter,
    pub(super) value: &'a Value,
    /// `None` for a parameter with one value.
    place: Option<usize>,
}

/// A value of a signal.
#[derive(Debug, Clone, Copy)]
pub(super) struct SignalLine<'a> {
    pub(super) signal: &'a Signal,
    pub(super) place: usize,
}

impl Seen {
    pub(super) fn new(name: &str) -> Self {
        Self { name: name.to_owned(), ..Self::default() }
    }

    /// Handles news; returns the reason if motion has ended.
    pub(super) fn hear(&mut self, text: &str) -> Option<String> {
        match Told::read(text)? {
            Told::Disconnected(reason) => self.gone = reason,
            Told::Status(status) => self.status = Some(status),
            Told::Faults(faults) => self.faults = Some(faults),
            Told::Events(events) => self.events = events,
            Told::Lost(lost) => return Some(lost.reason),
            Told::Overview(overview) => {
                self.live.period_s = overview.identity.sample_period_s;
                self.overview = Some(overview);
            }
        }
        None
    }

    /// Returns whether this program moves the station.
    pub(super) fn is_held_here(&self) -> bool {
        self.gone.is_none() && self.status.as_ref().is_some_and(|status| status.holder.is_some())
    }

    /// Returns the first fault and its remedy.
    pub(super) fn first_fault(&self) -> Option<String> {
        let faults = self.faults.as_ref()?;
        let finding = faults.findings.iter().find(|finding| finding.is_fault);
        let finding = finding.map(|finding| format!("fault: {}", finding.text));
        let first = || {
            let first = faults.first_fault.as_ref()?;
            Some(format!("first fault, tick {}: {}", first.tick, first.reason))
        };
        finding.or_else(|| faults.cut_out.clone()).or_else(first)
    }

    /// Returns modules and parameter values whose names match the filter.
    pub(super) fn modules(&self, filter: &str) -> Vec<ModuleLine<'_>> {
        let mut lines = Vec::new();
        for module in self.overview.iter().flat_map(|overview| &overview.modules) {
            let entries = module.parameters.iter().flat_map(|parameter| entries(&module.name, parameter));
            let mut found = entries
                .filter(|entry| has(&format!("{} {}", entry.module, entry.name()), filter))
                .map(ModuleLine::Entry)
                .peekable();
            if found.peek().is_some() || has(&module.name, filter) {
                lines.push(ModuleLine::Module(module));
                lines.extend(found);
            }
        }
        lines
    }

    /// Returns signal values whose names match the filter.
    pub(super) fn signals(&self, filter: &str) -> Vec<SignalLine<'_>> {
        let signals = self.overview.iter().flat_map(|overview| &overview.signals);
        let lines = signals
            .flat_map(|signal| (0..signal.values.len()).map(move |place| SignalLine { signal, place }));
        lines.filter(|line| has(&line.name(), filter)).collect()
    }

    /// Returns events that match the filter, newest first.
    pub(super) fn events(&self, filter: &str) -> Vec<&Event> {
        let has_it = |event: &&Event| has(&format!("{} {}", event.name, event.text), filter);
        self.events.iter().rev().filter(has_it).collect()
    }

    /// Returns the latest value of a signal without its unit: from its rows, or from the last overview.
    pub(super) fn signal_value(&self, line: SignalLine<'_>) -> String {
        let live = self.live.newest(&line.signal.name, line.place);
        live.unwrap_or_else(|| line.signal.values.get(line.place).map_or_else(String::new, text::value))
    }
}

impl Entry<'_> {
    /// Returns the name for `set`.
    pub(super) fn name(&self) -> String {
        name(&self.parameter.name, self.place)
    }

    pub(super) fn text(&self) -> String {
        text::with_unit(&text::value(self.value), &self.parameter.unit)
    }

    pub(super) fn default_text(&self) -> Option<String> {
        let default = self.parameter.default.as_ref()?;
        Some(text::with_unit(&text::value(default), &self.parameter.unit))
    }

    pub(super) fn differs_from_default(&self) -> bool {
        self.default_text().is_some_and(|default| default != self.text())
    }

    /// Returns the range, with the unit after the numbers and before their count.
    pub(super) fn range(&self) -> String {
        let Parameter { range, unit, .. } = self.parameter;
        match range.split_once(", ") {
            Some((numbers, rest)) if !unit.is_empty() => format!("{numbers} {unit}, {rest}"),
            _ => text::with_unit(range, unit),
        }
    }
}

impl SignalLine<'_> {
    pub(super) fn name(&self) -> String {
        name(&self.signal.name, (self.signal.values.len() > 1).then_some(self.place))
    }
}

fn entries<'a>(module: &'a str, parameter: &'a Parameter) -> impl Iterator<Item = Entry<'a>> {
    let is_many = parameter.values.len() > 1;
    let values = parameter.values.iter().enumerate();
    values.map(move |(place, value)| Entry { module, parameter, value, place: is_many.then_some(place) })
}

fn name(name: &str, place: Option<usize>) -> String {
    place.map_or_else(|| name.to_owned(), |place| format!("{name}[{place}]"))
}

fn has(text: &str, filter: &str) -> bool {
    text.to_lowercase().contains(&filter.to_lowercase())
}
