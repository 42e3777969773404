//! From the words of a user or a scheme to a device's numbers.
//!
//! A word that the device does not know comes back with the nearest one that it does.

use std::io::{Read, Write};

use dimsart_core::names::{split, split_axis};
use dimsart_core::scheme::ENGINE;
use dimsart_core::{Command, EngineCommand, ModuleRef, TypeRef, Value};

use super::description::{Parameter, Range};
use super::{ConnectError, Device};
use crate::schemes::suggestion;

/// Places of the words in a scheme's row, behind the destination.
pub(super) const MODULE: usize = 1;
pub(super) const COMMAND: usize = 2;
pub(super) const VALUE: usize = 3;

const PORT_PREFIX: &str = "PORT_";

/// `what` is not a `word`, but there are those.
fn unknown(index: usize, word: &str, what: &str, known: &[String]) -> ConnectError {
    let wrong = match word {
        "" => format!("{what} is missing"),
        word => format!("'{word}' is not {what}"),
    };
    ConnectError::Word { index, message: format!("{wrong}; {}", suggestion(word, known)) }
}

fn wrong(index: usize, message: String) -> ConnectError {
    ConnectError::Word { index, message }
}

/// A parameter as a word named it.
pub(super) struct Named {
    pub(super) index: u8,
    pub(super) axis: Option<u8>,
    pub(super) parameter: Parameter,
}

impl<S: Read + Write> Device<S> {
    /// The command that three words of a scheme's row stand for.
    pub(super) fn words_to_command(&mut self, words: [&str; 3]) -> Result<Command, ConnectError> {
        let [module, command, value] = words;
        if module == ENGINE {
            return self.words_to_engine_command(command, value);
        }
        let module = self.word_to_module(MODULE, module)?;
        if let Some(port) = command.strip_prefix(PORT_PREFIX) {
            let found = self.ports(module)?.into_iter().filter(|port| port.bound.is_some());
            let names: Vec<_> = found.map(|port| port.name).collect();
            let index = names.iter().position(|name| name == port).and_then(|index| u8::try_from(index).ok());
            let Some(index) = index else {
                let names: Vec<_> = names.iter().map(|name| format!("{PORT_PREFIX}{name}")).collect();
                return Err(unknown(COMMAND, command, "a port of this module", &names));
            };
            return Ok(Command::bind(module, index, self.word_to_signal(VALUE, value)?));
        }
        let Named { index, axis, parameter } = self.word_to_parameter(module, command)?;
        let value = self.word_to_value(&parameter, value)?;
        Ok(Command::Set { module, parameter: index, axis, value })
    }

    fn words_to_engine_command(&mut self, command: &str, value: &str) -> Result<Command, ConnectError> {
        let is_unknown = || {
            let known: Vec<_> = EngineCommand::ALL.iter().map(|known| known.name.to_owned()).collect();
            unknown(COMMAND, command, "a command of the engine", &known)
        };
        let found = EngineCommand::of(command).ok_or_else(is_unknown)?;
        if !found.needs_module && !value.is_empty() {
            return Err(wrong(VALUE, format!("'{value}' is one word too many: {command} takes none")));
        }
        let module = found.needs_module.then(|| self.word_to_module(VALUE, value)).transpose()?;
        found.with(module).ok_or_else(is_unknown)
    }

    /// A module by its name; it need not exist yet.
    pub(super) fn word_to_module(&mut self, index: usize, word: &str) -> Result<ModuleRef, ConnectError> {
        let names = self.kind_names()?;
        let found = split(word).and_then(|(name, number)| {
            let kind = names.iter().position(|known| known == name)?;
            Some(ModuleRef { kind: u8::try_from(kind).ok()?, number })
        });
        found.ok_or_else(|| unknown(index, word, "a module of this image", &names))
    }

    /// A parameter by its name, `K_PARAM` or `K_PARAM[0]`.
    pub(super) fn word_to_parameter(&mut self, module: ModuleRef, word: &str) -> Result<Named, ConnectError> {
        let (name, axis) = split_axis(word)
            .ok_or_else(|| wrong(COMMAND, format!("'{word}' is no parameter: write an axis as NAME[0]")))?;
        let parameters = self.parameters(module.kind)?;
        let names: Vec<_> = parameters.iter().map(|parameter| parameter.name.clone()).collect();
        let found = (0..).zip(parameters).find(|(_, parameter)| parameter.name == name);
        let Some((index, parameter)) = found else {
            let module = self.module_name(ModuleRef { number: 1, ..module })?;
            return Err(unknown(COMMAND, word, &format!("a parameter of {module}"), &names));
        };
        let dof = self.identity().axes.len();
        match axis {
            Some(_) if !parameter.is_per_axis() => {
                Err(wrong(COMMAND, format!("{name} is the same for all axes: leave the [axis] out")))
            }
            Some(axis) if usize::from(axis) >= dof => {
                Err(wrong(COMMAND, format!("no such axis: the device has {dof} of them, counted from 0")))
            }
            axis => Ok(Named { index, axis, parameter }),
        }
    }

    /// A signal by its name, `FORCE` or `FORCE.2`.
    pub(super) fn word_to_signal(&mut self, index: usize, word: &str) -> Result<TypeRef, ConnectError> {
        let (name, number) = split(word)
            .ok_or_else(|| wrong(index, format!("'{word}' is no signal: write copies as NAME.2")))?;
        match self.type_named(name)? {
            Some(id) => Ok(TypeRef { id, number }),
            None => Err(unknown(index, word, "a data type of this device", &self.type_names()?)),
        }
    }

    /// A value; whether a number is in range is for the device to say.
    fn word_to_value(&mut self, parameter: &Parameter, word: &str) -> Result<Value, ConnectError> {
        let Parameter { name, range, .. } = parameter;
        let wanted = |kind: &str| {
            let message = match word {
                "" => format!("{name} needs {kind}, {range}"),
                word => format!("'{word}' is not {kind}; {name} takes {range}"),
            };
            wrong(VALUE, message)
        };
        match range {
            Range::Real { .. } => word.parse().map(Value::Real).map_err(|_| wanted("a number")),
            Range::Count { .. } => word.parse().map(Value::Count).map_err(|_| wanted("a whole number")),
            Range::Flag => match word {
                "ON" => Ok(Value::Flag(true)),
                "OFF" => Ok(Value::Flag(false)),
                _ => Err(wanted("a switch")),
            },
            Range::Choice(names) => {
                let index = names.iter().position(|name| name == word);
                let index = index.and_then(|index| u8::try_from(index).ok());
                index
                    .map(Value::Choice)
                    .ok_or_else(|| unknown(VALUE, word, &format!("a value of {name}"), names))
            }
            Range::Types => Ok(Value::Type(self.word_to_signal(VALUE, word)?)),
        }
    }
}
