//! `[[parameter]]`: a short name for keys that are set together, with the values that make sense.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use super::set;

/// `[[parameter]]`: `--set`, sweeps and `--vary` take its name, and set all of its keys. Its default is what stands there.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct ParameterSection {
    /// What it is called, with the unit at its end: `link.delay_ticks`.
    pub name: String,
    /// The keys that it sets, as `--set` takes them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub keys: Vec<String>,
    /// What it is, in one line.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub meaning: String,
    /// Its minimum; left out, that of its keys.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min: Option<f64>,
    /// All of its values are above this one; left out, no such limit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub above: Option<f64>,
    /// Its maximum; left out, that of its keys.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max: Option<f64>,
    /// The texts that it takes; left out, any.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub choices: Vec<String>,
    /// The texts that it takes, in place of `keys` and `choices`, and the keys that each of them sets.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub values: BTreeMap<String, BTreeMap<String, Value>>,
    /// Keys that get these values when it is set and they are left out.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub also: BTreeMap<String, Value>,
    /// The parameter whose `also` it has, too.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub with: Option<String>,
    /// Whether it is a path, which in a file of settings begins in the file's folder.
    #[serde(default, skip_serializing_if = "is_false")]
    pub is_path: bool,
}

/// A value is left out of a file.
#[expect(clippy::trivially_copy_pass_by_ref, reason = "as serde has it")]
fn is_false(value: &bool) -> bool {
    !*value
}

impl ParameterSection {
    /// Whether it sets a key, to any value.
    #[must_use]
    pub fn sets(&self, key: &str) -> bool {
        let chosen = self.values.values().flat_map(BTreeMap::keys);
        self.keys.iter().chain(chosen).any(|own| own == key)
    }

    /// The keys that a value sets, with their values.
    ///
    /// # Errors
    /// What to give it instead of a value that it does not take.
    pub(super) fn settings(&self, value: &str) -> Result<Vec<(String, String)>, String> {
        let value = value.trim();
        if let Some(allowed) = self.allowed().filter(|_| !self.takes(value)) {
            return Err(format!("`{}` cannot be {value}; give it {allowed}", self.name));
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
            // A smaller number is 0 to a controller.
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

    /// The values that it takes, in words; none where any will do.
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

    /// A value to try its keys with.
    fn example(&self) -> String {
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

/// What is wrong with the parameters of a file, a line each.
pub(super) fn problems(parameters: &[ParameterSection], text: &str) -> Vec<String> {
    // It was read once already.
    let table: Table = toml::from_str(text).unwrap_or_default();
    let mut problems = Vec::new();
    for (place, parameter) in parameters.iter().enumerate() {
        let ParameterSection { name, keys, also, values, with, .. } = parameter;
        let mut wrong = |what: String| problems.push(format!("parameter '{name}': {what}"));
        if parameters.iter().take(place).any(|other| other.name == *name) {
            wrong("duplicate name: give each parameter its own".to_owned());
        }
        if name.is_empty() || name.contains(['=', '+', ' ']) {
            wrong("give it a name without =, + and spaces".to_owned());
        }
        if set::value_at(&table, name).is_some() {
            wrong("there is a key of this name: give it another one".to_owned());
        }
        if keys.is_empty() && also.is_empty() && values.is_empty() {
            wrong("it sets nothing: give it `keys`".to_owned());
        }
        if with.as_ref().is_some_and(|with| !parameters.iter().any(|other| other.name == *with)) {
            wrong("unknown parameter in `with`".to_owned());
        }
        let left_out = |key: &&String| set::value_at(&table, key).is_none();
        let with_also = set::with_also(&table, parameters, parameter);
        for key in keys.iter().filter(left_out) {
            if let Err(reason) = set::can_be_set(&with_also, key, &parameter.example()) {
                wrong(reason);
            }
        }
    }
    problems
}
