//! Files that override settings of a shipped rig, as `--set` does, section by section.

use std::path::Path;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::set::{self, Setting};
use super::{DEFAULT_RIG_NAME, RigFile, RigFileError};
use crate::schemes::{BUILT_IN_PREFIX, suggestion};

/// The key that names the rig.
const RIG: &str = "rig";

/// Reads the shipped rig's text and the settings that override it; `None` if the text has devices.
pub(super) fn read(
    text: &str,
    name: &str,
    folder: &Path,
) -> Result<Option<(&'static str, Vec<Setting>)>, RigFileError> {
    let not_one = |message: String| RigFileError::InvalidToml { name: name.to_owned(), message };
    let table: toml::Table = toml::from_str(text).map_err(|error: toml::de::Error| {
        not_one(format!("not a valid TOML file: {}{}", error.to_string().trim_end(), scheme_hint(name)))
    })?;
    if table.contains_key("device") {
        return Ok(None);
    }
    let wanted = table.get(RIG).map_or(Some(DEFAULT_RIG_NAME), |rig| rig.as_str()).unwrap_or_default();
    let shipped = RigFile::shipped(wanted).ok_or_else(|| {
        let known = super::SHIPPED.map(|(name, _)| name.to_owned());
        RigFileError::UnknownRig { name: wanted.to_owned(), near: suggestion(wanted, &known) }
    })?;
    let document = DeTable::parse(text).map_err(|error| not_one(error.to_string()))?;
    let mut settings = Vec::new();
    leaves(document.get_ref(), "", &mut settings);
    settings.sort_by_key(|(start, _)| *start);
    let rig: Option<RigFile> = toml::from_str(shipped).ok();
    let is_path =
        |key: &str| rig.as_ref().and_then(|rig| rig.parameter(key)).is_some_and(|found| found.is_path);
    let setting = |(start, key): (usize, String)| {
        let mut value = set::value_at(&table, &key)?.clone();
        if let toml::Value::String(path) = &mut value
            && is_path(&key)
            && !path.starts_with(BUILT_IN_PREFIX)
        {
            let joined = folder.join(&path);
            *path = std::path::absolute(&joined).unwrap_or(joined).display().to_string();
        }
        Some(Setting { at: at(text, name, start), key, value: value.to_string() })
    };
    let settings = settings.into_iter().filter(|(_, key)| key != RIG);
    Ok(Some((shipped, settings.filter_map(setting).collect())))
}

/// Collects every value except non-empty tables, with the start of its key.
fn leaves(table: &DeTable<'_>, above: &str, found: &mut Vec<(usize, String)>) {
    for (key, value) in table {
        let path = match above {
            "" => key.get_ref().to_string(),
            above => format!("{above}.{}", key.get_ref()),
        };
        match Spanned::get_ref(value) {
            DeValue::Table(inner) if !inner.is_empty() => leaves(inner, &path, found),
            _ => found.push((key.span().start, path)),
        }
    }
}

/// File, line and column of a byte, both from 1, columns in characters.
fn at(text: &str, name: &str, byte: usize) -> String {
    let before = text.get(..byte).unwrap_or(text);
    let column = 1 + before.rsplit('\n').next().unwrap_or_default().chars().count();
    format!("{name}:{}:{column}", before.matches('\n').count() + 1)
}

fn scheme_hint(name: &str) -> String {
    match Path::new(name).extension() {
        Some(extension) if extension == "scheme" => format!(
            "\nTo check a scheme: `dimsart check {name}`; to run it: `dimsart run --set master.scheme={name}`"
        ),
        _ => String::new(),
    }
}
