//! `--set`: sets a key by its path, or a parameter by its name.

use toml::{Table, Value};

use super::error::SET;
use super::{ParameterSection, RigFile, RigFileError, read};
use crate::renamed_keys::{self, RenamedKey};

/// Minimum similarity of two names, maximum 2.
const MIN_LIKENESS: f64 = 1.2;

/// A setting and its origin.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Setting {
    /// `--set` and its argument, or file, line and column.
    pub(super) at: String,
    pub(super) key: String,
    /// TOML value, or an unquoted text.
    pub(super) value: String,
}

impl Setting {
    /// Settings of a `--set` argument: one, or one per key of a table.
    pub(super) fn of_argument(argument: &str) -> Result<Vec<Self>, RigFileError> {
        let at = format!("{SET}{argument}");
        let refuse = |at| RigFileError::InvalidSetting {
            at,
            reason: "write key=value, for example --set seed=2".to_owned(),
        };
        let Some((key, value)) = argument.split_once('=') else { return Err(refuse(at)) };
        let (key, value) = (key.trim(), value.trim());
        let is_broken = value.starts_with(['[', '{', '"', '\'']) && value.parse::<Value>().is_err();
        if value.is_empty() || is_broken || key.split('.').any(|part| part.trim().is_empty()) {
            return Err(refuse(at));
        }
        let key: Vec<&str> = key.split('.').map(str::trim).collect();
        Ok(Self { at, key: key.join("."), value: value.to_owned() }.flattened())
    }

    /// Replaces an old key, in the path or in the value; returns the first one.
    pub(super) fn update(&mut self) -> Option<RenamedKey> {
        let (key, in_path) = renamed_keys::replace_renamed_path(&self.key);
        let value = format!("value = {}", self.value);
        let (value, in_value) = renamed_keys::replace_renamed_keys(&value);
        self.key = key;
        self.value = value["value = ".len()..].to_owned();
        in_path.or(in_value.first().copied())
    }

    /// Settings of the entries of a table.
    fn flattened(self) -> Vec<Self> {
        match self.value.parse::<Value>() {
            Ok(Value::Table(entries)) if !entries.is_empty() => {
                let of_entry = |(key, value): (String, Value)| {
                    let key = format!("{}.{key}", self.key);
                    Self { at: self.at.clone(), key, value: value.to_string() }.flattened()
                };
                entries.into_iter().flat_map(of_entry).collect()
            }
            _ => vec![self],
        }
    }
}

/// Applies each of `settings` to the rig of `text`, `file`; or reports all their errors.
pub(super) fn apply_all(
    text: &str,
    mut file: RigFile,
    settings: &[Setting],
) -> Result<RigFile, RigFileError> {
    if settings.is_empty() {
        return Ok(file);
    }
    // The text was parsed before.
    let mut table: Table = toml::from_str(text).unwrap_or_default();
    let parameters = file.parameters.clone();
    let all = settings.iter().try_fold(table.clone(), |with, setting| {
        with_setting(&with, &parameters, &setting.key, &setting.value)
    });
    if let Ok(Ok(found)) = all.map(Table::try_into) {
        return Ok(found);
    }
    // Applied one by one to find the error of each.
    let (mut errors, mut unfinished) = (Vec::new(), None);
    for Setting { at, key, value } in settings {
        let refused = |reason: String| RigFileError::InvalidSetting { at: at.clone(), reason };
        let wrong = |error: &toml::de::Error| {
            elsewhere(&table, key, error.message()).unwrap_or_else(|| read::in_words(key, error.message()))
        };
        let or_mistyped = |reason: String| refused(mistyped_parameter(&parameters, key).unwrap_or(reason));
        let with = with_setting(&table, &parameters, key, value);
        match with.map(|with| (with.clone().try_into(), with)) {
            Ok((Ok(found), with)) => (table, file, unfinished) = (with, found, None),
            // The next setting can supply the missing key.
            Ok((Err(error), with)) if read::is_missing(&error) => {
                let reason = wrong(&error);
                (table, unfinished) = (with, Some(refused(reason)));
            }
            Ok((Err(error), _)) => errors.push(or_mistyped(wrong(&error))),
            Err(reason) => errors.push(or_mistyped(reason)),
        }
    }
    errors.extend(unfinished);
    match errors.len() {
        0 => Ok(file),
        1 => Err(errors.remove(0)),
        _ => Err(RigFileError::InvalidSettings(errors)),
    }
}

/// Sets a key, or the keys of a parameter, in a copy of the table.
fn with_setting(
    table: &Table,
    parameters: &[ParameterSection],
    key: &str,
    value: &str,
) -> Result<Table, String> {
    let Some(parameter) = parameters.iter().find(|found| found.name == key) else {
        let mut with = table.clone();
        apply(&mut with, key, value)?;
        return Ok(with);
    };
    let settings = parameter.settings(value)?;
    let mut with = with_also(table, parameters, parameter);
    settings.iter().try_for_each(|(key, value)| apply(&mut with, key, value))?;
    Ok(with)
}

/// Adds the missing keys of `also` to a copy of the table.
pub(super) fn with_also(
    table: &Table,
    parameters: &[ParameterSection],
    parameter: &ParameterSection,
) -> Table {
    let mut with = table.clone();
    let other = parameters.iter().find(|other| parameter.with.as_ref() == Some(&other.name));
    for (key, value) in parameter.also.iter().chain(other.into_iter().flat_map(|other| &other.also)) {
        if value_at(&with, key).is_none() {
            // Unknown keys are reported when the file is read.
            let _ = apply(&mut with, key, &value.to_string());
        }
    }
    with
}

/// Message for a refused key that resembles the name of a parameter or its last part.
fn mistyped_parameter(parameters: &[ParameterSection], key: &str) -> Option<String> {
    let known: Vec<&str> = parameters.iter().map(|parameter| parameter.name.as_str()).collect();
    if known.contains(&key) {
        return None;
    }
    let below: Vec<&str> =
        known.iter().filter_map(|name| name.strip_prefix(key)?.strip_prefix('.')).collect();
    if !below.is_empty() {
        return Some(format!("`{key}` is a section, not a value; set one of its keys: {}", below.join(", ")));
    }
    let last = |name: &str| name.rsplit('.').next().unwrap_or_default().to_owned();
    let like = |a: &str, b: &str| strsim::jaro_winkler(a, b) + strsim::normalized_damerau_levenshtein(a, b);
    let likeness = |name: &&&str| like(key, name).max(0.9 * like(&last(key), &last(name)));
    let best = known.iter().max_by(|a, b| likeness(a).total_cmp(&likeness(b)))?;
    (likeness(&best) >= MIN_LIKENESS).then(|| format!("unknown key `{key}`; did you mean `{best}`?"))
}

/// Returns the value of a key.
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

/// Checks whether a key that the file omits accepts a value.
pub(super) fn can_be_set(table: &Table, key: &str, value: &str) -> Result<(), String> {
    let mut with = table.clone();
    apply(&mut with, key, value)?;
    match with.try_into::<RigFile>() {
        Ok(_) => Ok(()),
        Err(error) => {
            Err(elsewhere(table, key, error.message())
                .unwrap_or_else(|| read::in_words(key, error.message())))
        }
    }
}

/// Sets a value (`device.joint.axis.0.plant.load.inertia`, `0.02`). An entry of a list is selected by its index from
/// 0, or by its `name` or `device`.
fn apply(table: &mut Table, key: &str, text: &str) -> Result<(), String> {
    let (key, _) = renamed_keys::replace_renamed_path(key);
    let parts: Vec<&str> = key.split('.').collect();
    let Some((last, parents)) = parts.split_last() else { return Ok(()) };
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
                    format!("`{part}` is a list: select an entry by index or name: {}", names.join(", "))
                })?
            }
            _ => return Err(format!("`{part}` is a value, not a section: remove the rest of the key")),
        };
    }
    let text = text.trim();
    let value = text.parse().unwrap_or_else(|_| Value::String(text.to_owned()));
    here.insert((*last).to_owned(), value);
    Ok(())
}

/// Suggests the path of the same keys elsewhere in the file, or reports a list without entries.
fn elsewhere(table: &Table, way: &str, message: &str) -> Option<String> {
    let (first, _) = way.split_once('.')?;
    if !table.contains_key(first) && message.starts_with("invalid type: map, expected a sequence") {
        return Some(format!(
            "the file has no [[{first}]]: add the section to the file before setting its keys"
        ));
    }
    if !message.starts_with("unknown field") {
        return None;
    }
    let mut ways = Vec::new();
    ways_of(&Value::Table(table.clone()), "", &mut ways);
    // Both paths start and end with the same keys.
    let same = |a: &str, b: &str| a.split('.').zip(b.split('.')).take_while(|(a, b)| a == b).count();
    let reversed = |way: &str| way.rsplit('.').collect::<Vec<_>>().join(".");
    let likeness = |other: &String| same(&reversed(way), &reversed(other)) + same(way, other);
    let is_like = |other: &&String| same(&reversed(way), &reversed(other)) > 0 && same(way, other) > 0;
    let near = ways.iter().filter(is_like).max_by_key(|other| likeness(other))?;
    Some(format!("unknown key `{way}`; did you mean `{near}`?"))
}

/// Collects the paths of all values of a table.
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

/// Names of the entries of a list.
fn names(entries: &[Value]) -> Vec<String> {
    let name = |(place, entry): (usize, &Value)| {
        let named = ["name", "device", "from"].iter().find_map(|key| entry.get(key)?.as_str());
        named.map_or_else(|| place.to_string(), str::to_owned)
    };
    entries.iter().enumerate().map(name).collect()
}
