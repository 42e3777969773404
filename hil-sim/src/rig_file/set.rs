//! `--set` on a rig file: one value by its way from the top, or by the name of a parameter.

use toml::{Table, Value};

use super::{ParameterSection, RigFile, RigFileError, read};

/// Letters in which a name is mistyped at most.
const MAX_TYPOS: usize = 3;

/// The rig of `text`, `file`, with each of `sets` over it, or all that is wrong with them.
pub(super) fn apply_all(text: &str, mut file: RigFile, sets: &[String]) -> Result<RigFile, RigFileError> {
    // It was read once already.
    let mut table: Table = toml::from_str(text).unwrap_or_default();
    let (mut errors, mut unfinished) = (Vec::new(), None);
    let parameters = file.parameters.clone();
    for argument in sets {
        let refused = |error: toml::de::Error| {
            let way = argument.split('=').next().unwrap_or_default().trim();
            let reason = elsewhere(&table, way, error.message())
                .unwrap_or_else(|| read::in_words(way, error.message()));
            RigFileError::Set { argument: argument.clone(), reason }
        };
        let or_mistyped = |error| mistyped_parameter(&parameters, argument).unwrap_or(error);
        let mut with = table.clone();
        let applied = by_parameter(&parameters, argument)
            .and_then(|settings| settings.iter().try_for_each(|setting| apply(&mut with, setting)));
        match applied.map(|()| toml::from_str(&with.to_string())) {
            Ok(Ok(found)) => (table, file, unfinished) = (with, found, None),
            // What goes with it can come with the next argument.
            Ok(Err(error)) if read::is_missing(&error) => (table, unfinished) = (with, Some(refused(error))),
            Ok(Err(error)) => errors.push(or_mistyped(refused(error))),
            Err(error) => errors.push(or_mistyped(error)),
        }
    }
    errors.extend(unfinished);
    match errors.len() {
        0 => Ok(file),
        1 => Err(errors.remove(0)),
        _ => Err(RigFileError::Sets(errors)),
    }
}

/// The arguments that set the keys of a parameter, or the argument itself.
fn by_parameter(parameters: &[ParameterSection], argument: &str) -> Result<Vec<String>, RigFileError> {
    let itself = || Ok(vec![argument.to_owned()]);
    let Some((name, value)) = argument.split_once('=') else { return itself() };
    let Some(parameter) = parameters.iter().find(|found| found.name == name.trim()) else { return itself() };
    parameter.settings(value).map_err(|reason| RigFileError::Set { argument: argument.to_owned(), reason })
}

/// What to say of an argument that was refused, if it is nearly the name of a parameter.
fn mistyped_parameter(parameters: &[ParameterSection], argument: &str) -> Option<RigFileError> {
    let way = argument.split('=').next().unwrap_or_default().trim();
    let typos = |parameter: &&ParameterSection| strsim::damerau_levenshtein(way, &parameter.name);
    let near = parameters.iter().min_by_key(typos).filter(|near| (1..=MAX_TYPOS).contains(&typos(near)))?;
    let reason = format!("there is no key `{way}`; did you mean `{}`?", near.name);
    Some(RigFileError::Set { argument: argument.to_owned(), reason })
}

/// The value of a key.
pub(super) fn value_at<'t>(table: &'t Table, key: &str) -> Option<&'t Value> {
    let (first, rest) = key.split_once('.').map_or((key, None), |(first, rest)| (first, Some(rest)));
    let mut here = table.get(first.trim())?;
    for part in rest.into_iter().flat_map(|rest| rest.split('.')).map(str::trim) {
        here = match here {
            Value::Table(inner) => inner.get(part)?,
            Value::Array(entries) => {
                let place = part.parse().ok().or_else(|| names(entries).iter().position(|name| name == part));
                entries.get(place?)?
            }
            _ => return None,
        };
    }
    Some(here)
}

/// Whether a key that the file leaves out takes a value, or why not.
pub(super) fn can_be_set(table: &Table, key: &str, value: &str) -> Result<(), String> {
    let mut with = table.clone();
    match apply(&mut with, &format!("{key}={value}")) {
        Err(RigFileError::Set { reason, .. }) => return Err(reason),
        Err(error) => return Err(error.to_string()),
        Ok(()) => {}
    }
    match toml::from_str::<RigFile>(&with.to_string()) {
        Ok(_) => Ok(()),
        Err(error) => {
            Err(elsewhere(table, key, error.message())
                .unwrap_or_else(|| read::in_words(key, error.message())))
        }
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
