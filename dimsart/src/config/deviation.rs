//! Differences from the defaults.

use serde::Serialize;

use super::Configuration;

/// A parameter or port that differs from its default, or a module with all defaults.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Deviation {
    /// Position of the module, from 1; none if unplugged.
    pub place: Option<usize>,
    /// Module.
    pub module: String,
    /// Parameter, entry of a parameter, or port; none if the module has all defaults.
    pub parameter: Option<String>,
    /// Value; of a list, all added values.
    pub value: Option<String>,
    /// Default value; none if unknown.
    pub default: Option<String>,
    /// Unit; empty for a pure number.
    pub unit: String,
}

/// Lists differences from the defaults, by module in order.
#[must_use]
pub fn deviations(configuration: &Configuration) -> Vec<Deviation> {
    let mut found = Vec::new();
    for (place, module) in (1..).zip(&configuration.modules) {
        let deviation = |parameter, value, default: Option<String>, unit| Deviation {
            place: module.is_on.then_some(place),
            module: module.name.clone(),
            parameter,
            value,
            default: default.filter(|default| !default.is_empty()),
            unit,
        };
        let before = found.len();
        for setting in &module.settings {
            let differences = setting.with_defaults().differences(setting).into_iter();
            found.extend(differences.map(|(name, [default, value])| {
                deviation(Some(name), Some(value), Some(default), setting.unit.clone())
            }));
        }
        if found.len() == before {
            found.push(deviation(None, None, None, String::new()));
        }
    }
    found
}
