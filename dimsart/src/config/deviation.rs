//! What differs from the defaults.

use serde::Serialize;

use super::Configuration;

/// A parameter or port that is not as by default; or a module of which everything is.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Deviation {
    /// Place of the module in the order, from 1; none while it is not plugged in.
    pub place: Option<usize>,
    /// Module.
    pub module: String,
    /// Parameter, one entry of it, or port; none where all of the module is as by default.
    pub parameter: Option<String>,
    /// Its value; of a list, all that was added.
    pub value: Option<String>,
    /// Its value by default; none where that is not known.
    pub default: Option<String>,
    /// Unit; empty for a pure number.
    pub unit: String,
}

/// What differs from the defaults, module by module in their order.
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
            let differences = setting.as_default().differences(setting).into_iter();
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
