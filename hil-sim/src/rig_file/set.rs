//! `--set` on a rig file: one value by its way from the top.

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
            let reason = elsewhere(&table, way, error.message())
                .unwrap_or_else(|| read::in_words(way, error.message()));
            RigFileError::Set { argument: argument.clone(), reason }
        };
        let mut with = table.clone();
        match apply(&mut with, argument).map(|()| toml::from_str(&with.to_string())) {
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

/// What to write instead of a way whose keys are somewhere else in the file, or of a list that has no entries.
fn elsewhere(table: &Table, way: &str, message: &str) -> Option<String> {
    let (first, _) = way.split_once('.')?;
    if !table.contains_key(first) && message.starts_with("invalid type: map, expected a sequence") {
        return Some(format!("there is no [[{first}]] in the file: add one to it, and set its keys then"));
    }
    if !message.starts_with("unknown field") {
        return None;
    }
    let mut ways = Vec::new();
    ways_of(&Value::Table(table.clone()), "", &mut ways);
    // The last keys are the same, and so is where both begin.
    let same = |a: &str, b: &str| a.split('.').zip(b.split('.')).take_while(|(a, b)| a == b).count();
    let reversed = |way: &str| way.rsplit('.').collect::<Vec<_>>().join(".");
    let likeness = |other: &String| same(&reversed(way), &reversed(other)) + same(way, other);
    let is_like = |other: &&String| same(&reversed(way), &reversed(other)) > 0 && same(way, other) > 0;
    let near = ways.iter().filter(is_like).max_by_key(|other| likeness(other))?;
    Some(format!("there is no key `{way}`; did you mean `{near}`?"))
}

/// The ways to all values of a table.
fn ways_of(value: &Value, way: &str, ways: &mut Vec<String>) {
    let below = |key: &str| if way.is_empty() { key.to_owned() } else { format!("{way}.{key}") };
    match value {
        Value::Table(inner) => inner.iter().for_each(|(key, value)| ways_of(value, &below(key), ways)),
        Value::Array(entries) if entries.iter().any(Value::is_table) => {
            names(entries).iter().zip(entries).for_each(|(name, value)| ways_of(value, &below(name), ways));
        }
        _ => ways.push(way.to_owned()),
    }
}

/// What the entries of a list are called.
fn names(entries: &[Value]) -> Vec<String> {
    let name = |(place, entry): (usize, &Value)| {
        let named = ["name", "device", "from"].iter().find_map(|key| entry.get(key)?.as_str());
        named.map_or_else(|| place.to_string(), str::to_owned)
    };
    entries.iter().enumerate().map(name).collect()
}
