//! Differences between two configurations.

use serde::Serialize;

use super::{Configuration, Module, Setting, UnknownRow};

/// Kind of a change from the first configuration to the second.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ChangeKind {
    /// A module of the second configuration only, with its settings.
    Added,
    /// A module of the first configuration only.
    Removed,
    /// Another value, or plugged in or unplugged.
    Changed,
    /// Another position among the modules plugged in in both.
    Moved,
    /// A port bound to another signal.
    Bound,
}

impl ChangeKind {
    /// Returns its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Added => "added",
            Self::Removed => "removed",
            Self::Changed => "changed",
            Self::Moved => "moved",
            Self::Bound => "bound",
        }
    }
}

/// A difference.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Change {
    /// Kind of change.
    pub change: ChangeKind,
    /// Module.
    pub module: String,
    /// Parameter, entry of a parameter, or port; none for the whole module.
    pub parameter: Option<String>,
    /// In the first configuration: value, signal, position from 1, or whether it is plugged in; empty if unknown.
    pub from: String,
    /// In the second configuration.
    pub to: String,
    /// Unit of both; empty for a pure number.
    pub unit: String,
}

/// All differences.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Difference {
    /// By modules of the second configuration in order, then removed modules.
    pub changes: Vec<Change>,
    /// Unknown rows of the first configuration only.
    pub unknown_removed: Vec<UnknownRow>,
    /// Unknown rows of the second configuration only.
    pub unknown_added: Vec<UnknownRow>,
}

impl Difference {
    /// Compares two configurations.
    #[must_use]
    pub fn between(from: &Configuration, to: &Configuration) -> Self {
        let mut changes = Vec::new();
        let stay = unmoved(&order(from), &order(to));
        for (place, module) in (1..).zip(&to.modules) {
            let before = (1..).zip(&from.modules).find(|(_, before)| before.name == module.name);
            match before {
                None => added(module, place, &mut changes),
                Some((old_place, before)) => {
                    let both_on = before.is_on && module.is_on;
                    if both_on && !stay.contains(&module.name.as_str()) {
                        let [from, to] = [old_place, place].map(|place: usize| place.to_string());
                        changes.push(whole(ChangeKind::Moved, module, from, to));
                    }
                    changed(before, module, &mut changes);
                }
            }
        }
        let is_gone = |module: &&Module| to.modules.iter().all(|there| there.name != module.name);
        changes.extend((1..).zip(&from.modules).filter(|(_, module)| is_gone(module)).map(
            |(place, module)| whole(ChangeKind::Removed, module, place_text(module, place), String::new()),
        ));
        let only_in = |one: &Configuration, other: &Configuration| {
            let is_there = |row: &UnknownRow| other.unknown.iter().any(|known| known.row == row.row);
            one.unknown.iter().filter(|row| !is_there(row)).cloned().collect()
        };
        Self { changes, unknown_removed: only_in(from, to), unknown_added: only_in(to, from) }
    }

    /// Whether the configurations are equal.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.changes.is_empty() && self.unknown_removed.is_empty() && self.unknown_added.is_empty()
    }
}

fn whole(change: ChangeKind, module: &Module, from: String, to: String) -> Change {
    Change { change, module: module.name.clone(), parameter: None, from, to, unit: String::new() }
}

fn place_text(module: &Module, place: usize) -> String {
    if module.is_on { format!("position {place}") } else { "not plugged in".to_owned() }
}

fn added(module: &Module, place: usize, changes: &mut Vec<Change>) {
    changes.push(whole(ChangeKind::Added, module, String::new(), place_text(module, place)));
    let settings = module.settings.iter();
    changes.extend(settings.flat_map(|setting| {
        compared(ChangeKind::Added, ChangeKind::Added, module, &setting.with_defaults(), setting)
    }));
}

/// Lists the differences of a module in both configurations.
fn changed(before: &Module, module: &Module, changes: &mut Vec<Change>) {
    if before.is_on != module.is_on {
        let [from, to] =
            [before, module].map(|module| if module.is_on { "plugged in" } else { "not plugged in" });
        changes.push(whole(ChangeKind::Changed, module, from.to_owned(), to.to_owned()));
    }
    let named = |settings: &[Setting], name: &str| settings.iter().find(|there| there.name == name).cloned();
    let compare =
        |from: &Setting, to: &Setting| compared(ChangeKind::Changed, ChangeKind::Bound, module, from, to);
    for setting in &module.settings {
        let from = named(&before.settings, &setting.name).unwrap_or_else(|| setting.with_defaults());
        changes.extend(compare(&from, setting));
    }
    for setting in &before.settings {
        if named(&module.settings, &setting.name).is_none() {
            changes.extend(compare(setting, &setting.with_defaults()));
        }
    }
}

fn compared(
    of_value: ChangeKind,
    of_port: ChangeKind,
    module: &Module,
    from: &Setting,
    setting: &Setting,
) -> Vec<Change> {
    let change = if setting.is_port() { of_port } else { of_value };
    let differences = from.differences(setting).into_iter();
    let text = |(name, [from, to]): (String, [String; 2])| Change {
        change,
        module: module.name.clone(),
        parameter: Some(name),
        from,
        to,
        unit: setting.unit.clone(),
    };
    differences.map(text).collect()
}

/// Names of the plugged-in modules, in order.
fn order(configuration: &Configuration) -> Vec<&str> {
    configuration.modules.iter().filter(|module| module.is_on).map(|module| module.name.as_str()).collect()
}

/// The longest common subsequence of names: the other modules have moved.
fn unmoved<'a>(from: &[&'a str], to: &[&str]) -> Vec<&'a str> {
    // The longest run that ends with each name, with increasing positions in the second order.
    let mut runs: Vec<Vec<(usize, &str)>> = Vec::new();
    for name in from {
        let Some(place) = to.iter().position(|there| there == name) else { continue };
        let goes_on = |run: &&Vec<(usize, &str)>| run.last().is_some_and(|(last, _)| *last < place);
        let mut run = runs.iter().filter(goes_on).max_by_key(|run| run.len()).cloned().unwrap_or_default();
        run.push((place, name));
        runs.push(run);
    }
    let longest = runs.into_iter().max_by_key(Vec::len).unwrap_or_default();
    longest.into_iter().map(|(_, name)| name).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_few_modules_as_possible_have_moved() {
        for (from, to, expected) in [
            ("a b c d", "a b c d", "a b c d"),
            ("a b c d", "d a b c", "a b c"),
            ("a b c d", "b c a d", "b c d"),
            ("a b c", "x a y c", "a c"),
            ("a b", "c d", ""),
        ] {
            let [from, to] = [from, to].map(|order| order.split(' ').collect::<Vec<_>>());
            assert_eq!(unmoved(&from, &to).join(" "), expected, "{from:?} {to:?}");
        }
    }
}
