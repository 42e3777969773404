//! Error messages for rows of a scheme.

use std::fmt;

use dimsart_core::names::split;
use dimsart_core::scheme::{ENGINE, PORT_PREFIX, RowError, SWITCH, SchemeError};
use dimsart_core::{
    CommandError, EngineCommand, Explanation, KindId, ModuleRef, ParameterDescription, ParameterError,
    ParameterTypeDescription, Vocabulary,
};

use super::{MAX_WORD_CHARS, most_similar, suggestion};
use crate::untrusted_text::truncate;

/// Error message of a row, with the names of the controller that the row addresses.
pub struct SchemeErrorMessage<'a, V: ?Sized> {
    /// The error, with its place.
    pub error: SchemeError<'a>,
    /// The names.
    pub known: &'a V,
}

impl<V: Vocabulary + ?Sized> SchemeErrorMessage<'_, V> {
    /// Writes `'X' is not a number`, or that the number is missing.
    fn missing_or(&self, f: &mut fmt::Formatter<'_>, what: impl fmt::Display) -> fmt::Result {
        match self.error.place.word {
            "" => write!(f, "expected {what} at the end of the row"),
            word => write!(f, "'{}' is not {what}", truncate(word, MAX_WORD_CHARS)),
        }
    }

    /// Writes `'X' is not a module; did you mean 'Y'?`, or the whole list if no name is similar.
    fn unknown<'k>(
        &self,
        f: &mut fmt::Formatter<'_>,
        what: impl fmt::Display,
        known: impl IntoIterator<Item = &'k str>,
    ) -> fmt::Result {
        self.missing_or(f, what)?;
        let known: Vec<String> = known.into_iter().map(str::to_owned).collect();
        write!(f, "; {}", suggestion(self.error.place.word, &known))
    }

    /// The word's module kind, if the vocabulary names it although the controller lacks it.
    fn missing_kind(&self) -> Option<&str> {
        let (kind, _) = split(self.error.place.word)?;
        self.known.kind_name(KindId::from_name(kind)).filter(|known| *known == kind)
    }

    fn value(&self, f: &mut fmt::Formatter<'_>, parameter: &ParameterDescription<'_>) -> fmt::Result {
        let ParameterDescription { name, unit, accepts, .. } = parameter;
        let unit = unit.for_axes(self.known.axes());
        let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        match accepts {
            ParameterTypeDescription::Real { min, max, .. } => {
                self.missing_or(f, format_args!("a number from {min} to {max}{unit}"))
            }
            ParameterTypeDescription::Count { min, max } => {
                self.missing_or(f, format_args!("an integer from {min} to {max}{unit}"))
            }
            ParameterTypeDescription::Integer { min, max } => {
                self.missing_or(f, format_args!("an integer from {min} to {max}{unit}"))
            }
            ParameterTypeDescription::Choice(names) => {
                self.unknown(f, format_args!("a value of {name}"), names.iter().copied())
            }
            _ => self.unknown(f, format_args!("a value of {name}"), SWITCH.iter().copied()),
        }
    }

    /// Explains invalid indices of a parameter.
    fn entry(&self, f: &mut fmt::Formatter<'_>, parameter: &ParameterDescription<'_>) -> fmt::Result {
        let ParameterDescription { name, entries, .. } = parameter;
        let word = truncate(self.error.place.word, MAX_WORD_CHARS);
        let (rows, columns) = entries.size(self.known.dof());
        if entries.is_matrix() {
            write!(
                f,
                "'{word}' is not an element of {name} ({rows} rows, {columns} columns): write {name}[0][0]; \
                indices start at 0"
            )
        } else if entries.is_per_axis() {
            write!(
                f,
                "'{word}' is not an entry of {name}, which has one value per axis: write {name}[0]; axes start at 0"
            )
        } else {
            write!(f, "'{word}' has one value for all axes: remove the [axis]")
        }
    }

    fn parameters_and_ports(&self, module: ModuleRef) -> Vec<String> {
        let parameters = self.known.parameter_texts(module.kind).map(|found| found.name.to_owned());
        let ports = self.known.port_texts(module).filter(|port| port.bound.is_some());
        parameters.chain(ports.map(|port| format!("{PORT_PREFIX}{}", port.name))).collect()
    }
}

impl<V: Vocabulary + ?Sized> fmt::Display for SchemeErrorMessage<'_, V> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { error: SchemeError { place, problem }, known } = *self;
        let word = &*truncate(place.word, MAX_WORD_CHARS);
        match problem {
            RowError::Module | RowError::ModuleValue if let Some(kind) = self.missing_kind() => {
                write!(
                    f,
                    "the image does not include {kind}: build it with this module kind (docs/firmware.md)"
                )
            }
            RowError::Destination => self.unknown(f, "a destination", ["master", "slave", "m&s", "all"]),
            RowError::Module => self.unknown(f, "a module", [ENGINE].into_iter().chain(known.kind_names())),
            RowError::ModuleValue => self.unknown(f, "a module", known.kind_names()),
            RowError::EngineCommand => {
                self.unknown(f, "a command of the engine", EngineCommand::ALL.iter().map(|known| known.name))
            }
            RowError::ModuleCommand(module) => {
                let (name, there) = (known.module_name(module), self.parameters_and_ports(module));
                if there.is_empty() {
                    return write!(
                        f,
                        "the image does not include {name}: build it with the group of this module (docs/firmware.md)"
                    );
                }
                self.unknown(f, format!("a parameter or port of {name}"), there.iter().map(String::as_str))?;
                match most_similar(word, &there) {
                    Some(_) => write!(f, " available: {}", there.join(", ")),
                    None => Ok(()),
                }
            }
            RowError::Type => self.unknown(f, "a data type", known.type_texts().map(|found| found.name)),
            RowError::Entry { module, parameter } => match known.parameter_text(module.kind, parameter) {
                Some(parameter) => self.entry(f, &parameter),
                None => self.missing_or(f, "an entry of this parameter"),
            },
            RowError::Value { module, parameter } => match known.parameter_text(module.kind, parameter) {
                Some(parameter) => self.value(f, &parameter),
                None => self.missing_or(f, "a value of this parameter"),
            },
            RowError::Surplus => write!(f, "unexpected word '{word}' at the end of the row"),
            RowError::Refused(error @ CommandError::Parameter(ParameterError::NoSuchEntry)) => {
                Explanation::for_refusal(known, error).fmt(f)
            }
            RowError::Refused(error) => {
                write!(f, "'{word}' refused: {}", Explanation::for_refusal(known, error))
            }
        }
    }
}
