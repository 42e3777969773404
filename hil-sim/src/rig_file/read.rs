//! A text as a rig, or everything that is wrong with its keys.
//!
//! Reading ends at the first mistake. So that is taken out, or something that can be read put in its place, and the rest
//! is read again. All of it is done twice, with other stand-ins: what does not go together both times is not their fault.

use std::ops::Range;
use std::path::PathBuf;

use serde::Deserialize;
use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue, Deserializer, Error};

use super::{RigFile, RigFileError};
use crate::schemes::suggestion;

/// What can stand where something else is wrong.
const STAND_INS: [[&str; 2]; 5] = [["0", "1"], ["true", "false"], ["'x'", "'y'"], ["[]", "[]"], ["{}", "{}"]];
/// Where a stand-in says that it was written.
const NOWHERE: Range<usize> = usize::MAX..usize::MAX;
/// More mistakes than anybody reads.
const MOST: usize = 100;
/// How a mistake begins that is not where a key is, but where there is none.
const MISSING: &str = "missing field `";

type Document<'t> = Spanned<DeTable<'t>>;

/// The rig, or all that is wrong in `text`, a sentence each.
pub(super) fn read(text: &str, name: &str) -> Result<RigFile, RigFileError> {
    let document = DeTable::parse(text).map_err(|error| RigFileError::NotOne {
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
        // What is wrong around a stand-in may be the stand-in's fault.
        if !mended.iter().any(|mended: &Vec<String>| mended.starts_with(&place.way)) {
            let start = error.span().map_or(0, |span| span.start);
            let words = in_words(&place.way.join("."), error.message());
            found.push((start, format!("{}: {words}", line_and_column(text, start))));
        }
        let has_stand_in = place.kind != Kind::Key && place.stand_in(&mut documents, error.message());
        if !has_stand_in && !place.take_out(&mut documents) || found.len() == MOST {
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
    Err(RigFileError::Wrong { name: name.to_owned(), sets: Vec::new(), problems })
}

fn rig(document: &Document<'_>) -> Result<RigFile, Error> {
    RigFile::deserialize(Deserializer::from(document.clone()))
}

/// Whether a key is not there that must be.
pub(super) fn is_missing(error: &Error) -> bool {
    error.message().starts_with(MISSING)
}

/// What is wrong with the key at the end of `way`, from what the deserializer says.
pub(super) fn in_words(way: &str, message: &str) -> String {
    let mut quoted = message.split('`').skip(1).step_by(2).map(str::to_owned);
    if message.starts_with("unknown field") {
        let key = quoted.next().unwrap_or_default();
        let near = suggestion(&key, &quoted.collect::<Vec<_>>());
        return match way.ends_with(&key) {
            true => format!("there is no key `{way}`; {near}"),
            false => format!("`{way}` has no key `{key}`; {near}"),
        };
    }
    if message.starts_with(MISSING) {
        let key = quoted.next().unwrap_or_default();
        return match way.ends_with(&key) {
            true => format!("`{way}` is missing"),
            false => format!("`{way}` cannot be without `{key}`"),
        };
    }
    let found = ["invalid type: ", "invalid value: ", "unknown variant "].iter();
    let found = found.filter_map(|what| message.strip_prefix(what)).next();
    match found.and_then(|found| found.split_once(", expected ")) {
        Some((found, expected)) => format!("`{way}` is {found}; give it {}", kind_in_words(expected)),
        None => format!("`{way}`: {message}"),
    }
}

/// What the deserializer expects, for somebody who writes TOML.
fn kind_in_words(expected: &str) -> &str {
    match expected {
        "f64" | "f32" => "a number",
        "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number from 0",
        "i8" | "i16" | "i32" | "i64" => "a whole number",
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
    /// A key that does not exist.
    Key,
    /// A value that its key does not take.
    Value,
    /// A key that must be there.
    Missing,
}

/// Where a mistake is: the keys from the top, entries of lists by number.
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

    /// Puts something in its place that can be read, if anything can: where there is a choice, what `message` quotes.
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

    /// Takes it out, if it is there and no entry of a list.
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

/// What has entries.
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

/// Adds to `way` what leads to the key or value that was written at `span`.
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
    // A list of tables is written where its first entry is.
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
