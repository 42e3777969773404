//! What is wrong with a row of a scheme, in words.

use std::fmt;

use dimsart_core::modules::Standard;
use dimsart_core::scheme::{ENGINE, Problem, SchemeError};
use dimsart_core::{CommandError, Engine, EngineCommand, ModuleList, ParameterError, limits};

use super::suggestion;

/// A row's error in words.
pub(super) struct Explained<'a, const WORDS: usize> {
    pub(super) error: &'a SchemeError<'a>,
    pub(super) engine: &'a Engine<Standard, WORDS>,
}

impl<const WORDS: usize> Explained<'_, WORDS> {
    /// `'X' is not a number`, or that it is missing.
    fn missing_or(&self, f: &mut fmt::Formatter<'_>, what: impl fmt::Display) -> fmt::Result {
        match self.error.place.word {
            "" => write!(f, "the row ends where {what} should be"),
            word => write!(f, "'{word}' is not {what}"),
        }
    }

    /// `'X' is not a module; did you mean 'Y'?`, or the whole list when nothing is near.
    fn unknown(&self, f: &mut fmt::Formatter<'_>, what: &str, known: &[String]) -> fmt::Result {
        self.missing_or(f, what)?;
        write!(f, "; {}", suggestion(self.error.place.word, known))
    }
}

impl<const WORDS: usize> fmt::Display for Explained<'_, WORDS> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let word = self.error.place.word;
        match self.error.problem {
            Problem::Destination => self.unknown(f, "a side", &owned(&["master", "slave", "m&s", "all"])),
            Problem::Module => self.unknown(f, "a module", &modules(true)),
            Problem::ModuleValue => self.unknown(f, "a module", &modules(false)),
            Problem::EngineCommand => {
                let known: Vec<_> = EngineCommand::ALL.iter().map(|known| known.name.to_owned()).collect();
                self.unknown(f, "a command of the engine", &known)
            }
            Problem::ModuleCommand(module) => {
                let name = Engine::<Standard, WORDS>::module_name(module);
                let mut known: Vec<_> = parameters(module.kind);
                let ports = Engine::<Standard, WORDS>::new(self.engine.device().clone()).ports(module);
                let ports = ports.into_iter().flatten().filter(|port| port.data_type.is_some());
                known.extend(ports.map(|port| format!("PORT_{}", port.name)));
                self.unknown(f, &format!("a parameter or port of {name}"), &known)
            }
            Problem::Type => {
                let types = dimsart_core::types::ALL.iter().map(|data_type| data_type.name.to_owned());
                self.unknown(f, "a data type", &types.collect::<Vec<_>>())
            }
            Problem::Choice(names) => self.unknown(f, "one of its values", &owned(names)),
            Problem::Number { min, max } => self.missing_or(f, format_args!("a number from {min} to {max}")),
            Problem::Whole { min, max } => {
                self.missing_or(f, format_args!("a whole number from {min} to {max}"))
            }
            Problem::Surplus => write!(f, "'{word}' is one word too many on this row"),
            Problem::Refused(CommandError::Parameter(ParameterError::NoSuchAxis)) => {
                write!(f, "no such axis: the device has {} of them", self.engine.device().dof())
            }
            Problem::Refused(CommandError::WouldBreak(finding)) => {
                write!(f, "refused while the scheme runs: {}", self.engine.explain(finding))
            }
            Problem::Refused(error) => write!(f, "'{word}' refused: {error}"),
        }
    }
}

fn owned(words: &[&str]) -> Vec<String> {
    words.iter().map(|word| (*word).to_owned()).collect()
}

fn modules(with_engine: bool) -> Vec<String> {
    let engine = with_engine.then(|| ENGINE.to_owned());
    engine.into_iter().chain(Standard::KINDS.iter().map(|kind| kind.name.to_owned())).collect()
}

fn parameters(kind: u8) -> Vec<String> {
    let describe = |index| Engine::<Standard, { limits::DEFAULT_WORDS }>::describe_parameter(kind, index);
    (0..).map_while(describe).map(|parameter| parameter.name.to_owned()).collect()
}
