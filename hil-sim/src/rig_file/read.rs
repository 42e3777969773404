//! Reads a rig, or reports all errors of its keys.
//!
//! The deserializer stops at the first error. The error is therefore removed or replaced by a placeholder, and the
//! rest is read again. Two different sets of placeholders are used: a conflict that occurs with both is not caused by
//! a placeholder.

use std::ops::Range;
use std::path::PathBuf;

use serde::Deserialize;
use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue, Deserializer, Error};

use super::{RigFile, RigFileError};
use crate::schemes::suggestion;

/// Placeholders for an invalid value, so that reading continues.
const STAND_INS: [[&str; 2]; 5] = [["0", "1"], ["true", "false"], ["'x'", "'y'"], ["[]", "[]"], ["{}", "{}"]];
/// Span of a placeholder.
const NOWHERE: Range<usize> = usize::MAX..usize::MAX;
/// Maximum number of reported errors.
const MAX: usize = 100;
/// Start of the deserializer's message for a missing key.
const MISSING: &str = "missing field `";

type Document<'t> = Spanned<DeTable<'t>>;

/// Reads a rig from `text`, or reports all its errors, one sentence each.
pub(super) fn read(text: &str, name: &str) -> Result<RigFile, RigFileError> {
    let document = DeTable::parse(text).map_err(|error| RigFileError::InvalidToml {
        name: name.to_owned(),
        message: error.to_string().trim_end().to_owned(),
    })?;
    let mut documents = [document.clone(), document];
    let (mut found, mut mended) = (Vec::new(), Vec::new());
    while let Err(error) = rig(&documents[0]) {
        let Some(place) = error.span().and_then(|span| Place::of(&documents[0], &span, error.message()))
        else {
            found.push((0, error.message().to_owned()));
            break;
        };
        // An error around a placeholder may be caused by it.
        if !mended.iter().any(|mended: &Vec<String>| mended.starts_with(&place.way)) {
            let start = error.span().map_or(0, |span| span.start);
            let words = in_words(&place.way.join("."), error.message());
            found.push((start, format!("{}: {words}", line_and_column(text, start))));
        }
        let has_stand_in = place.kind != Kind::Key && place.stand_in(&mut documents, error.message());
        if !has_stand_in && !place.take_out(&mut documents) || found.len() == MAX {
            break;
        }
        mended.push(place.way);
    }
    found.sort_by_key(|(start, _)| *start);
    let mut problems: Vec<String> = found.into_iter().map(|(_, words)| words).collect();
    let [first, second] = documents.map(|document| rig(&document));
    match (first, second) {
        (Ok(file), _) if problems.is_empty() => return Ok(file),
        (Ok(first), Ok(second)) => {
            let [first, second] = [first, second].map(|file| file.completed(PathBuf::new()).problems());
            problems.extend(first.into_iter().filter(|problem| second.contains(problem)));
        }
        _ => {}
    }
    Err(RigFileError::InvalidKeys { name: name.to_owned(), sets: Vec::new(), problems })
}

fn rig(document: &Document<'_>) -> Result<RigFile, Error> {
    RigFile::deserialize(Deserializer::from(document.clone()))
}

/// Whether a required key is missing.
pub(super) fn is_missing(error: &Error) -> bool {
    error.message().starts_with(MISSING)
}

/// Rephrases the deserializer's message for the key at the end of `way`.
pub(super) fn in_words(way: &str, message: &str) -> String {
    let mut quoted = message.split('`').skip(1).step_by(2).map(str::to_owned);
    if message.starts_with("unknown field") {
        let key = quoted.next().unwrap_or_default();
        let near = suggestion(&key, &quoted.collect::<Vec<_>>());
        return match way.ends_with(&key) {
            true => format!("unknown key `{way}`; {near}"),
            false => format!("unknown key `{key}` in `{way}`; {near}"),
        };
    }
    if message.starts_with(MISSING) {
        let key = quoted.next().unwrap_or_default();
        return match way.ends_with(&key) {
            true => format!("`{way}` is missing"),
            false => format!("missing key `{key}` in `{way}`"),
        };
    }
    let found = ["invalid type: ", "invalid value: ", "unknown variant "].iter();
    let found = found.filter_map(|what| message.strip_prefix(what)).next();
    match found.and_then(|found| found.split_once(", expected ")) {
        Some((found, expected)) => format!("`{way}` is {found}, must be {}", kind_in_words(expected)),
        None => format!("`{way}`: {message}"),
    }
}

/// Names the type that the deserializer expects in TOML's terms.
fn kind_in_words(expected: &str) -> &str {
    match expected {
        "f64" | "f32" => "a number",
        "u8" | "u16" | "u32" | "u64" | "usize" => "an integer >= 0",
        "i8" | "i16" | "i32" | "i64" => "an integer",
        "a sequence" => "a list",
        "a boolean" => "true or false",
        other if other.starts_with("struct") => "a table of keys",
        other => other,
    }
}

fn line_and_column(text: &str, place: usize) -> String {
    let before = text.get(..place).unwrap_or_default();
    let line = 1 + before.matches('\n').count();
    let column = 1 + before.rsplit('\n').next().unwrap_or_default().chars().count();
    format!("line {line}, column {column}")
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// An unknown key.
    Key,
    /// An invalid value.
    Value,
    /// A missing key.
    Missing,
}

/// Location of an error: keys from the top, list entries by index.
#[derive(Debug)]
struct Place {
    kind: Kind,
    way: Vec<String>,
}

impl Place {
    fn of(document: &Document<'_>, span: &Range<usize>, message: &str) -> Option<Self> {
        let mut way = Vec::new();
        let mut kind = match document.span() == *span {
            true => Kind::Value,
            false => find(document.get_ref(), span, &mut way)?,
        };
        if let Some(key) = message.strip_prefix(MISSING) {
            way.push(key.trim_end_matches('`').to_owned());
            kind = Kind::Missing;
        }
        (!way.is_empty()).then_some(Self { kind, way })
    }

    /// Replaces the value by a placeholder, if possible; for a choice, by the first text quoted in `message`.
    fn stand_in(&self, documents: &mut [Document<'_>; 2], message: &str) -> bool {
        let choice = |quoted: &str| [quoted, quoted].map(|choice| DeValue::String(choice.to_owned().into()));
        let stand_in = |text: &'static str| DeValue::parse(text).map(Spanned::into_inner).ok();
        let stand_ins =
            STAND_INS.iter().filter_map(|[first, second]| Some([stand_in(first)?, stand_in(second)?]));
        stand_ins.chain(message.split('`').skip(1).step_by(2).map(choice)).any(|stand_ins| {
            let mut with: [Document<'_>; 2] = documents.clone();
            let is_in =
                with.iter_mut().zip(stand_ins).all(|(document, value)| self.put(document, value).is_some());
            let is_read = is_in && rig(&with[0]).map_or_else(|error| error.span() != Some(NOWHERE), |_| true);
            if is_read {
                *documents = with;
            }
            is_read
        })
    }

    fn put(&self, document: &mut Document<'_>, value: DeValue<'static>) -> Option<()> {
        let value = Spanned::new(NOWHERE, value);
        let (last, parents) = self.way.split_last()?;
        match inner(document.get_mut(), parents)? {
            Inner::Table(table) => {
                table.insert(Spanned::new(NOWHERE, last.clone().into()), value);
            }
            Inner::Array(entries) => *entries.get_mut(last.parse::<usize>().ok()?)? = value,
        }
        Some(())
    }

    /// Removes the key, if present and not an entry of a list.
    fn take_out(&self, documents: &mut [Document<'_>; 2]) -> bool {
        documents.iter_mut().all(|document| {
            let Some((last, parents)) = self.way.split_last() else { return false };
            match inner(document.get_mut(), parents) {
                Some(Inner::Table(table)) => table.remove(last.as_str()).is_some(),
                _ => false,
            }
        })
    }
}

/// Tables and lists.
enum Inner<'d, 't> {
    Table(&'d mut DeTable<'t>),
    Array(&'d mut DeArray<'t>),
}

fn inner<'d, 't>(table: &'d mut DeTable<'t>, way: &[String]) -> Option<Inner<'d, 't>> {
    let mut here = Inner::Table(table);
    for part in way {
        let next = match here {
            Inner::Table(table) => table.get_mut(part.as_str())?,
            Inner::Array(entries) => entries.get_mut(part.parse::<usize>().ok()?)?,
        };
        here = match next.get_mut() {
            DeValue::Table(table) => Inner::Table(table),
            DeValue::Array(entries) => Inner::Array(entries),
            _ => return None,
        };
    }
    Some(here)
}

/// Appends the path to the key or value at `span`.
fn find(table: &DeTable<'_>, span: &Range<usize>, way: &mut Vec<String>) -> Option<Kind> {
    for (key, value) in table {
        way.push(key.get_ref().to_string());
        if key.span() == *span {
            return Some(Kind::Key);
        }
        if let Some(kind) = find_in(value, span, way) {
            return Some(kind);
        }
        way.pop();
    }
    None
}

fn find_in(value: &Spanned<DeValue<'_>>, span: &Range<usize>, way: &mut Vec<String>) -> Option<Kind> {
    // The span of a list of tables is that of its first entry.
    let is_here = value.span() == *span;
    let inside = match value.get_ref() {
        DeValue::Table(table) => find(table, span, way),
        DeValue::Array(entries) => entries.iter().enumerate().find_map(|(place, entry)| {
            way.push(place.to_string());
            let kind = find_in(entry, span, way);
            if kind.is_none() {
                way.pop();
            }
            kind
        }),
        _ => None,
    };
    inside.or(is_here.then_some(Kind::Value))
}
