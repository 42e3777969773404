//! Values of parameters and ports, in the notation of schemes.

use dimsart_core::scheme::PORT_PREFIX;
use dimsart_core::{ParameterDescription, ParameterShape, ParameterTypeDescription, Value, Vocabulary};
use hil_sim::schemes;

/// A parameter's values, or a port's signal.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Setting {
    /// Name, such as `K_PARAM` or `PORT_FORCE`.
    pub name: String,
    /// A value for each entry; of a list, the added values.
    pub values: Vec<String>,
    /// Default of each entry; none for a list, which starts empty.
    pub default: Option<String>,
    /// Unit; empty for a pure number.
    pub unit: String,
    /// Indices of the entries, on a device with `dof` axes.
    entries: ParameterShape,
    dof: u8,
}

impl Setting {
    /// A parameter with these values, or defaults where none.
    pub(super) fn of_parameter(
        found: &ParameterDescription<'_>,
        values: &[Option<Value>],
        known: &(impl Vocabulary + ?Sized),
    ) -> Self {
        let word = |value| schemes::value_text(value, &found.accepts, known);
        let default = found.default.map(word);
        let value = |value: &Option<Value>| value.map(word).or_else(|| default.clone()).unwrap_or_default();
        Self {
            name: found.name.to_owned(),
            values: values.iter().map(value).collect(),
            unit: match found.accepts {
                ParameterTypeDescription::Types => String::new(),
                _ => found.unit.for_axes(known.axes()).to_string(),
            },
            default,
            entries: found.entries,
            dof: known.dof(),
        }
    }

    /// A port bound to a signal, with its default signal; empty if unknown.
    pub(super) fn of_port(name: &str, signal: &str, default: String) -> Self {
        Self {
            name: format!("{PORT_PREFIX}{name}"),
            values: vec![signal.to_owned()],
            default: Some(default),
            unit: String::new(),
            entries: ParameterShape::ONE,
            dof: 0,
        }
    }

    /// Whether it is a port.
    #[must_use]
    pub fn is_port(&self) -> bool {
        self.name.starts_with(PORT_PREFIX)
    }

    /// Returns the setting with all values at their defaults.
    #[must_use]
    pub fn with_defaults(&self) -> Self {
        let values = self.default.iter().flat_map(|value| vec![value.clone(); self.values.len()]);
        Self { values: values.collect(), ..self.clone() }
    }

    /// Returns names and values that differ from another setting of the same parameter: one for all entries if they have the
    /// same values, and one for a list.
    #[must_use]
    pub fn differences(&self, other: &Self) -> Vec<(String, [String; 2])> {
        if self.values == other.values {
            return Vec::new();
        }
        if self.default.is_none() {
            return vec![(self.name.clone(), [self.values.join(", "), other.values.join(", ")])];
        }
        let pairs: Vec<_> = self.values.iter().zip(&other.values).collect();
        let is_uniform = pairs.windows(2).all(|two| two.first() == two.last());
        let entries = pairs.iter().enumerate().filter(|(_, (one, other))| one != other);
        let text = |(place, (one, other)): (usize, &(&String, &String))| {
            let index =
                if is_uniform { String::new() } else { schemes::entry_text(self.entries, place, self.dof) };
            (format!("{}{index}", self.name), [(*one).clone(), (*other).clone()])
        };
        entries.map(text).take(if is_uniform { 1 } else { usize::MAX }).collect()
    }
}
