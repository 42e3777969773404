//! Checks the parameters that a rig file declares.

use toml::Table;

use super::ParameterSection;
use super::set::{can_be_set, value_at, with_also};

/// Returns the errors of a file's parameters, one line each.
pub(super) fn problems(parameters: &[ParameterSection], text: &str) -> Vec<String> {
    // The text was parsed before.
    let table: Table = toml::from_str(text).unwrap_or_default();
    let mut problems = Vec::new();
    for (place, parameter) in parameters.iter().enumerate() {
        let ParameterSection { name, keys, also, values, with, .. } = parameter;
        let mut wrong = |what: String| problems.push(format!("parameter '{name}': {what}"));
        if parameters.iter().take(place).any(|other| other.name == *name) {
            wrong("duplicate name: give each parameter a unique name".to_owned());
        }
        if name.is_empty() || name.contains(['=', '+', ' ']) {
            wrong("invalid name: remove =, + and spaces".to_owned());
        }
        if value_at(&table, name).is_some() {
            wrong("the rig has a key of this name: choose another name".to_owned());
        }
        if keys.is_empty() && also.is_empty() && values.is_empty() {
            wrong("sets no keys: add `keys`".to_owned());
        }
        if with.as_ref().is_some_and(|with| !parameters.iter().any(|other| other.name == *with)) {
            wrong("unknown parameter in `with`: use the name of a declared parameter".to_owned());
        }
        let left_out = |key: &&String| value_at(&table, key).is_none();
        let with_also = with_also(&table, parameters, parameter);
        for key in keys.iter().filter(left_out) {
            if let Err(reason) = can_be_set(&with_also, key, &parameter.example()) {
                wrong(reason);
            }
        }
    }
    problems
}
