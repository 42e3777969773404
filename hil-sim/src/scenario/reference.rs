//! The shipped scenario as the one source of keys, their types, defaults and meanings.

use toml::de::{DeTable, DeValue};
use toml::{Spanned, Table, Value};

/// The text of `scenarios/bilateral.toml`.
pub const SHIPPED: &str = include_str!("../../scenarios/bilateral.toml");

/// One key of a scenario.
#[derive(Debug, Clone, PartialEq)]
pub struct Key {
    /// Path from the top: `link.loss`. Its end names the unit.
    pub path: String,
    /// Its default as TOML; none for a key that the shipped scenario leaves out.
    pub default: Option<String>,
    /// One line.
    pub meaning: String,
}

/// A key with its place in a text: the way from the top, and where key and value stand, in bytes.
pub(super) struct Leaf {
    pub(super) path: Vec<String>,
    pub(super) key_start: usize,
    pub(super) value_end: usize,
}

/// Every key of the shipped scenario, and an example of every one it leaves out.
pub(super) fn complete_text() -> String {
    let is_left_out = |rest: &str| rest.starts_with(|c: char| c == '[' || c.is_ascii_lowercase());
    let lines =
        SHIPPED.lines().map(|line| line.strip_prefix('#').filter(|rest| is_left_out(rest)).unwrap_or(line));
    lines.flat_map(|line| [line, "\n"]).collect()
}

/// [`complete_text`], parsed.
pub(super) fn complete() -> Table {
    parse_embedded(&complete_text())
}

/// The shipped scenario, parsed.
pub(super) fn shipped() -> Table {
    parse_embedded(SHIPPED)
}

/// A part of the program that does not parse is an empty table, from which no scenario comes.
fn parse_embedded(text: &str) -> Table {
    text.parse().unwrap_or_default()
}

/// Every key, in the order of the shipped file.
pub(super) fn keys() -> Vec<Key> {
    let (text, complete, shipped) = (complete_text(), complete(), shipped());
    let Ok(document) = DeTable::parse(&text) else { return Vec::new() };
    let describe = |leaf: Leaf| {
        find(&complete, &leaf.path).filter(|value| !value.is_table())?;
        let rest = text.get(leaf.value_end..)?.lines().next()?;
        Some(Key {
            default: find(&shipped, &leaf.path).map(ToString::to_string),
            meaning: rest.trim().trim_start_matches('#').trim().to_owned(),
            path: leaf.path.join("."),
        })
    };
    leaves(document.get_ref()).into_iter().filter_map(describe).collect()
}

/// Every value of `table` that is not a table with entries, in the order of the text.
pub(super) fn leaves(table: &DeTable<'_>) -> Vec<Leaf> {
    let mut found = Vec::new();
    collect(table, &[], &mut found);
    found.sort_by_key(|leaf| leaf.key_start);
    found
}

fn collect(table: &DeTable<'_>, parents: &[String], found: &mut Vec<Leaf>) {
    for (key, value) in table {
        let path: Vec<String> = parents.iter().cloned().chain([key.get_ref().to_string()]).collect();
        match Spanned::get_ref(value) {
            DeValue::Table(inner) if !inner.is_empty() => collect(inner, &path, found),
            _ => found.push(Leaf { path, key_start: key.span().start, value_end: value.span().end }),
        }
    }
}

/// The value at `path`.
pub(super) fn find<'a>(table: &'a Table, path: &[String]) -> Option<&'a Value> {
    let (last, parents) = path.split_last()?;
    parents.iter().try_fold(table, |table, part| table.get(part)?.as_table())?.get(last)
}

/// Below it, of 2, a key is like another one by chance.
const LEAST_LIKENESS: f64 = 1.2;

/// The valid key most like `wrong`: a mistyped one, or the last part of one; none where nothing is like it.
pub(super) fn nearest(wrong: &str) -> Option<String> {
    let last = |path: &str| path.rsplit('.').next().unwrap_or_default().to_owned();
    let like = |a: &str, b: &str| strsim::jaro_winkler(a, b) + strsim::normalized_damerau_levenshtein(a, b);
    let likeness = |key: &Key| like(wrong, &key.path).max(0.9 * like(&last(wrong), &last(&key.path)));
    let best = keys().into_iter().max_by(|a, b| likeness(a).total_cmp(&likeness(b)));
    best.filter(|key| likeness(key) >= LEAST_LIKENESS).map(|key| key.path)
}
