//! `[[parameter]]`: a short name for keys that are set together, with its valid values.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use toml::Value;

/// `[[parameter]]`: a name for `--set`, `--vary` and sweeps, which sets all its keys. Its default is the value of its
/// keys.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct ParameterSection {
    /// Name with its unit as suffix: `link.delay_ticks`.
    pub name: String,
    /// Its keys, as for `--set`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub keys: Vec<String>,
    /// Meaning, in one line.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub meaning: String,
    /// Minimum; default: limit of its keys.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min: Option<f64>,
    /// Exclusive minimum; default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub above: Option<f64>,
    /// Maximum; default: limit of its keys.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max: Option<f64>,
    /// Valid texts; default: any.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub choices: Vec<String>,
    /// Valid texts and the keys that each sets, instead of `keys` and `choices`.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub values: BTreeMap<String, BTreeMap<String, Value>>,
    /// Values of further keys, applied only to missing keys.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub also: BTreeMap<String, Value>,
    /// Parameter whose `also` applies as well.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub with: Option<String>,
    /// Whether it is a path, relative to the folder of a settings file.
    #[serde(default, skip_serializing_if = "is_false")]
    pub is_path: bool,
}

/// Skips a default value in a file.
#[expect(clippy::trivially_copy_pass_by_ref, reason = "as serde has it")]
fn is_false(value: &bool) -> bool {
    !*value
}

impl ParameterSection {
    /// Whether it sets a key, for any value.
    #[must_use]
    pub fn sets(&self, key: &str) -> bool {
        let chosen = self.values.values().flat_map(BTreeMap::keys);
        self.keys.iter().chain(chosen).any(|own| own == key)
    }

    /// Returns the keys that a value sets, with their values.
    ///
    /// # Errors
    /// The value is invalid; the message lists the valid values.
    pub(super) fn settings(&self, value: &str) -> Result<Vec<(String, String)>, String> {
        let value = value.trim();
        if let Some(allowed) = self.allowed().filter(|_| !self.takes(value)) {
            return Err(format!("`{}` is {value}, must be {allowed}", self.name));
        }
        let own = self.keys.iter().map(|key| (key.clone(), value.to_owned()));
        let chosen = self.values.get(unquoted(value)).into_iter().flatten();
        let chosen = chosen.map(|(key, value)| (key.clone(), value.to_string()));
        Ok(own.chain(chosen).collect())
    }

    fn takes(&self, value: &str) -> bool {
        if self.is_choice() {
            let names = self.choices.iter().chain(self.values.keys());
            return names.into_iter().any(|choice| choice == unquoted(value));
        }
        let largest = f64::from(f32::MAX);
        let range = self.min.unwrap_or(-largest)..=self.max.unwrap_or(largest);
        let is_in = |number: f64| {
            // Smaller numbers are 0 in `f32`.
            let is_above = self.above.is_none_or(|above| number - above >= f64::from(f32::MIN_POSITIVE));
            is_above && range.contains(&number)
        };
        let list = value.strip_prefix('[').and_then(|rest| rest.strip_suffix(']'));
        let mut numbers =
            list.unwrap_or(value).split(',').filter(|number| list.is_none() || !number.trim().is_empty());
        numbers.all(|number| number.trim().replace('_', "").parse().is_ok_and(is_in))
    }

    fn is_choice(&self) -> bool {
        !self.choices.is_empty() || !self.values.is_empty()
    }

    /// Describes the valid values; `None` if any value is valid.
    fn allowed(&self) -> Option<String> {
        if self.is_choice() {
            let names = self.choices.iter().chain(self.values.keys()).cloned();
            return Some(format!("one of {}", names.collect::<Vec<_>>().join(", ")));
        }
        Some(match (self.above, self.min, self.max) {
            (None, None, None) => return None,
            (Some(above), _, Some(f64::INFINITY)) => format!("a number > {above}, or inf"),
            (Some(above), _, None) => format!("a finite number > {above}"),
            (Some(above), _, Some(max)) => format!("a number > {above} and <= {max}"),
            (_, Some(min), None) => format!("a finite number >= {min}"),
            (_, None, Some(max)) => format!("a number <= {max}"),
            (_, Some(min), Some(max)) => format!("a number from {min} to {max}"),
        })
    }

    /// Valid value for checking its keys.
    pub(super) fn example(&self) -> String {
        let least = self.min.map(|min| min.max(0.0));
        let number = least.or(self.above.map(|above| above + 1.0)).or(self.max);
        let choice = self.choices.first().or(self.values.keys().next()).cloned();
        let path = self.is_path.then(|| "file".to_owned());
        path.or(choice).or(number.map(|number| number.to_string())).unwrap_or_else(|| "1".to_owned())
    }
}

fn unquoted(value: &str) -> &str {
    value.trim_matches(['"', '\''])
}
