//! `[[parameter]]`: a short name for keys that are set together, with the values that make sense.

use serde::{Deserialize, Serialize};
use toml::Table;

use super::set;

/// `[[parameter]]`: `--set`, sweeps and `--vary` take its name, and set all of its keys. Its default is what stands there.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct ParameterSection {
    /// What it is called, with the unit at its end: `link.delay_ticks`.
    pub name: String,
    /// The keys that it sets, as `--set` takes them.
    pub keys: Vec<String>,
    /// What it is, in one line.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub meaning: String,
    /// Its minimum; left out, that of its keys.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min: Option<f64>,
    /// Its maximum; left out, that of its keys.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max: Option<f64>,
    /// The texts that it takes; left out, any.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub choices: Vec<String>,
}

impl ParameterSection {
    /// `--set` of all its keys to a value.
    ///
    /// # Errors
    /// What to give it instead of a value that it does not take.
    pub(super) fn settings(&self, value: &str) -> Result<Vec<String>, String> {
        let value = value.trim();
        if let Some(allowed) = self.allowed().filter(|_| !self.takes(value)) {
            return Err(format!("`{}` cannot be {value}; give it {allowed}", self.name));
        }
        Ok(self.keys.iter().map(|key| format!("{key}={value}")).collect())
    }

    fn takes(&self, value: &str) -> bool {
        if !self.choices.is_empty() {
            return self.choices.iter().any(|choice| choice == value.trim_matches(['"', '\'']));
        }
        let range = self.min.unwrap_or(f64::NEG_INFINITY)..=self.max.unwrap_or(f64::INFINITY);
        value.replace('_', "").parse().is_ok_and(|number: f64| range.contains(&number))
    }

    /// The values that it takes, in words; none where any will do.
    fn allowed(&self) -> Option<String> {
        match (self.choices.as_slice(), self.min, self.max) {
            ([], None, None) => None,
            ([], Some(min), None) => Some(format!("a number >= {min}")),
            ([], None, Some(max)) => Some(format!("a number <= {max}")),
            ([], Some(min), Some(max)) => Some(format!("a number from {min} to {max}")),
            (choices, ..) => Some(choices.join(", ")),
        }
    }

    /// A value to try its keys with.
    fn example(&self) -> String {
        let number = self.min.or(self.max).map(|number| number.to_string());
        self.choices.first().cloned().or(number).unwrap_or_else(|| "1".to_owned())
    }
}

/// What is wrong with the parameters of a file, a line each.
pub(super) fn problems(parameters: &[ParameterSection], text: &str) -> Vec<String> {
    // It was read once already.
    let table: Table = toml::from_str(text).unwrap_or_default();
    let mut problems = Vec::new();
    for (place, parameter) in parameters.iter().enumerate() {
        let ParameterSection { name, keys, .. } = parameter;
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
        if keys.is_empty() {
            wrong("it sets nothing: give it `keys`".to_owned());
        }
        for key in keys.iter().filter(|key| set::value_at(&table, key).is_none()) {
            if let Err(reason) = set::can_be_set(&table, key, &parameter.example()) {
                wrong(reason);
            }
        }
    }
    problems
}
