//! One setting put over the settings so far: a line of a file, or an argument of `--set`.

use super::Scenario;
use super::error::{Origin, ScenarioError};
use super::range::Range;
use super::reference::{self, Leaf};
use crate::schemes::BUILT_IN_PREFIX;
use serde::Deserialize;
use std::path::Path;
use toml::de::DeTable;
use toml::{Table, Value};

/// A key, its new value, and where that was written.
pub(super) struct Change {
    path: Vec<String>,
    value: Value,
    origin: Origin,
}

impl Change {
    /// The change that `argument` (`link.loss=0.1`) of `--set` asks for; several if the value is a table.
    pub(super) fn from_argument(argument: &str) -> Result<Vec<Self>, ScenarioError> {
        let not_a_setting = || ScenarioError::NotASetting { argument: argument.to_owned() };
        let (key, text) = argument.split_once('=').ok_or_else(not_a_setting)?;
        let path: Vec<String> = key.split('.').map(|part| part.trim().to_owned()).collect();
        let text = text.trim();
        if text.is_empty() || path.iter().any(String::is_empty) {
            return Err(not_a_setting());
        }
        let complete = reference::complete();
        let takes_text = reference::find(&complete, &path).is_some_and(Value::is_str);
        let value = match text.parse::<Value>() {
            Ok(value) if value.is_str() || !takes_text => value,
            Err(_) if text.starts_with(['[', '{', '"', '\'']) => return Err(not_a_setting()),
            _ => Value::String(text.to_owned()),
        };
        let mut changes = Vec::new();
        flatten(path, value, &Origin::Set(argument.to_owned()), &mut changes);
        Ok(changes)
    }

    /// The changes that a file asks for, in its order.
    pub(super) fn from_file(path: &Path) -> Result<Vec<Self>, ScenarioError> {
        let unreadable = |source| ScenarioError::Unreadable { path: path.to_owned(), source };
        let not_toml = |error: toml::de::Error| ScenarioError::NotToml {
            path: path.to_owned(),
            message: error.to_string().trim_end().to_owned(),
        };
        let text = std::fs::read_to_string(path).map_err(unreadable)?;
        let values: Table = toml::from_str(&text).map_err(not_toml)?;
        let document = DeTable::parse(&text).map_err(not_toml)?;
        let change = |leaf: Leaf| {
            let (line, column) = line_and_column(&text, leaf.key_start);
            let value = reference::find(&values, &leaf.path)?.clone();
            let value = from_folder(&leaf.path, value, path.parent());
            Some(Self {
                path: leaf.path,
                value,
                origin: Origin::File { path: path.to_owned(), line, column },
            })
        };
        Ok(reference::leaves(document.get_ref()).into_iter().filter_map(change).collect())
    }

    /// Puts the change into `settings`, which stay as they are if it is refused.
    pub(super) fn apply(self, settings: &mut Table) -> Result<(), ScenarioError> {
        let Self { path, value, origin } = self;
        let complete = reference::complete();
        let key = path.join(".");
        let Some(example) = reference::find(&complete, &path) else {
            return Err(ScenarioError::UnknownKey { nearest: reference::nearest(&key), key, origin });
        };
        let mut changed = settings.clone();
        let range = Range::of(&key);
        match refusal(example, &value, range) {
            Some(allowed) => {
                return Err(ScenarioError::WrongValue { key, value: value.to_string(), allowed, origin });
            }
            None => insert(&mut changed, &complete, &path, value.clone()),
        }
        // What is left to refuse is a word that is not in an enum's list.
        if let Err(error) = Scenario::deserialize(changed.clone()) {
            let message = error.message();
            let allowed =
                message.split_once("expected ").map_or(message, |(_, expected)| expected).to_owned();
            return Err(ScenarioError::WrongValue { key, value: value.to_string(), allowed, origin });
        }
        *settings = changed;
        Ok(())
    }
}

/// Keys whose value is the path of a file.
const PATHS: [&str; 4] = ["master.scheme", "slave.scheme", "udp.delays_file", "link.key_file"];

/// A path in a file begins in the file's folder; as a whole, it leads there from anywhere.
fn from_folder(key: &[String], value: Value, folder: Option<&Path>) -> Value {
    let is_path = PATHS.contains(&key.join(".").as_str());
    match (value, folder) {
        (Value::String(path), Some(folder)) if is_path && !path.starts_with(BUILT_IN_PREFIX) => {
            let joined = folder.join(path);
            Value::String(std::path::absolute(&joined).unwrap_or(joined).display().to_string())
        }
        (value, _) => value,
    }
}

/// One change for each entry of a table, and for each value that is none.
fn flatten(path: Vec<String>, value: Value, origin: &Origin, changes: &mut Vec<Change>) {
    match value {
        Value::Table(entries) if !entries.is_empty() => {
            for (key, value) in entries {
                let path = path.iter().cloned().chain([key]).collect();
                flatten(path, value, origin, changes);
            }
        }
        value => changes.push(Change { path, value, origin: origin.clone() }),
    }
}

/// What the key takes, if it does not take `value`. An empty table asks for a section with its defaults.
fn refusal(example: &Value, value: &Value, range: Option<Range>) -> Option<String> {
    let out_of_range =
        |number: f64| range.filter(|range| !range.holds(number)).map(|range| range.to_string());
    let number = || range.map_or_else(|| "a number".to_owned(), |range| range.to_string());
    match (example, value) {
        (Value::Float(_), Value::Float(number)) => out_of_range(*number),
        #[expect(
            clippy::cast_precision_loss,
            reason = "a range's ends are far apart compared with the rounding"
        )]
        (Value::Float(_) | Value::Integer(_), Value::Integer(number)) => out_of_range(*number as f64),
        (Value::Array(examples), Value::Array(values)) => {
            values.iter().find_map(|value| refusal(examples.first()?, value, range))
        }
        (Value::String(_), Value::String(_)) | (Value::Boolean(_), Value::Boolean(_)) => None,
        (Value::Table(_), Value::Table(_)) => None,
        (Value::Float(_), _) => Some(number()),
        (Value::Integer(_), _) => Some(number().replacen("number", "whole number", 1)),
        (Value::Array(_), _) if range.is_none() => Some("a list of names, such as [\"world\"]".to_owned()),
        (Value::Array(_), _) => Some(format!("a list, each entry {}", number())),
        (Value::String(_), _) => Some("a text in quotes".to_owned()),
        (Value::Boolean(_), _) => Some("true or false".to_owned()),
        (Value::Table(entries), _) => {
            let keys: Vec<&str> = entries.keys().map(String::as_str).collect();
            Some(format!("no value: it is a section with the keys {}", keys.join(", ")))
        }
        (Value::Datetime(_), _) => Some("a date".to_owned()),
    }
}

/// Sets `path`; a section that was left out comes with the defaults of `complete`.
fn insert(settings: &mut Table, complete: &Table, path: &[String], value: Value) {
    let Some((first, rest)) = path.split_first() else { return };
    let default = || complete.get(first).cloned().unwrap_or_else(|| Value::Table(Table::new()));
    match (complete.get(first), rest) {
        (Some(Value::Table(inner)), _) => {
            let section = settings.entry(first.clone()).or_insert_with(default);
            if let Some(section) = section.as_table_mut() {
                insert(section, inner, rest, value);
            }
        }
        _ => {
            settings.insert(first.clone(), value);
        }
    }
}

/// Line and column of a byte, both from 1, columns in characters.
fn line_and_column(text: &str, byte: usize) -> (usize, usize) {
    let before = text.get(..byte).unwrap_or(text);
    let line_start = before.rfind('\n').map_or(0, |at| at + 1);
    let column = before.get(line_start..).map_or(0, |part| part.chars().count());
    (before.matches('\n').count() + 1, column + 1)
}
