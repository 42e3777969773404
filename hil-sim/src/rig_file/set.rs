//! `--set` on a rig file: one value by its way from the top.

use serde::Deserialize;
use toml::{Table, Value};

use super::{RigFile, RigFileError, read};

/// The rig of `text`, `file`, with each of `sets` over it, or all that is wrong with them.
pub(super) fn apply_all(text: &str, mut file: RigFile, sets: &[String]) -> Result<RigFile, RigFileError> {
    // It was read once already.
    let mut table: Table = toml::from_str(text).unwrap_or_default();
    let (mut errors, mut unfinished) = (Vec::new(), None);
    for argument in sets {
        let refused = |error: toml::de::Error| {
            let way = argument.split('=').next().unwrap_or_default().trim();
            RigFileError::Set { argument: argument.clone(), reason: read::in_words(way, error.message()) }
        };
        let mut with = table.clone();
        match apply(&mut with, argument).map(|()| RigFile::deserialize(with.clone())) {
            Ok(Ok(found)) => (table, file, unfinished) = (with, found, None),
            // What goes with it can come with the next argument.
            Ok(Err(error)) if read::is_missing(&error) => (table, unfinished) = (with, Some(refused(error))),
            Ok(Err(error)) => errors.push(refused(error)),
            Err(error) => errors.push(error),
        }
    }
    errors.extend(unfinished);
    match errors.len() {
        0 => Ok(file),
        1 => Err(errors.remove(0)),
        _ => Err(RigFileError::Sets(errors)),
    }
}

/// Puts `argument` (`device.joint.axis.0.plant.load.inertia=0.02`) over a file. In a list, an entry goes by its number
/// from 0, or by its `name` or `device`.
fn apply(table: &mut Table, argument: &str) -> Result<(), RigFileError> {
    let refuse = |reason: String| RigFileError::Set { argument: argument.to_owned(), reason };
    let (key, text) = argument
        .split_once('=')
        .ok_or_else(|| refuse("write it KEY=VALUE, such as duration_s=2.0".to_owned()))?;
    let parts: Vec<&str> = key.split('.').map(str::trim).collect();
    let (last, parents) = parts
        .split_last()
        .filter(|(last, _)| !last.is_empty())
        .ok_or_else(|| refuse("a key is missing before the `=`".to_owned()))?;
    let mut here = table;
    let mut way = parents.iter();
    while let Some(part) = way.next() {
        let next = here.entry((*part).to_owned()).or_insert_with(|| Value::Table(Table::new()));
        here = match next {
            Value::Table(inner) => inner,
            Value::Array(entries) => {
                let names = names(entries);
                let entry = way.next().copied().unwrap_or_default();
                let place = entry.parse().ok().or_else(|| names.iter().position(|name| name == entry));
                let found =
                    place.and_then(|place: usize| entries.get_mut(place)).and_then(Value::as_table_mut);
                found.ok_or_else(|| {
                    refuse(format!(
                        "`{part}` is a list: say which one, by number or name: {}",
                        names.join(", ")
                    ))
                })?
            }
            _ => return Err(refuse(format!("`{part}` is a value, and has no keys"))),
        };
    }
    let text = text.trim();
    let value = text.parse().unwrap_or_else(|_| Value::String(text.to_owned()));
    here.insert((*last).to_owned(), value);
    Ok(())
}

/// What the entries of a list are called.
fn names(entries: &[Value]) -> Vec<String> {
    let name = |(place, entry): (usize, &Value)| {
        let named = ["name", "device", "from"].iter().find_map(|key| entry.get(key)?.as_str());
        named.map_or_else(|| place.to_string(), str::to_owned)
    };
    entries.iter().enumerate().map(name).collect()
}
