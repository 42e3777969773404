//! Wire format of commands: by numbers, which never change.

use super::{Command, ModuleRef};
use crate::parameter;
use crate::signal::TypeRef;

/// Encoded command.
#[derive(serde::Serialize, serde::Deserialize)]
pub(super) struct Wire {
    target: Target,
    /// Number of an engine command or a parameter, or [`PORT`] + the number of a port.
    number: u8,
    entry: Option<u8>,
    value: Value,
}

/// First number of a port.
const PORT: u8 = 128;
/// Numbers of the program commands.
const PUT_LAW: u8 = 32;
const KEEP_LAW: u8 = 33;
const REMOVE_LAW: u8 = 34;

/// Target of a command.
#[derive(PartialEq, serde::Serialize, serde::Deserialize)]
enum Target {
    Engine,
    Module(ModuleRef),
}

/// A [parameter's value](parameter::Value), or the value of another command.
#[derive(serde::Serialize, serde::Deserialize)]
enum Value {
    Real(f32),
    Count(u32),
    Flag(bool),
    Choice(u8),
    Type(TypeRef),
    Module(ModuleRef),
    Nothing,
    Integer(i32),
    Words([u32; 2]),
}

/// Invalid combination of numbers and value.
#[derive(Debug)]
pub(super) struct NoCommand;

impl core::fmt::Display for NoCommand {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("invalid command")
    }
}

impl From<parameter::Value> for Value {
    fn from(value: parameter::Value) -> Self {
        match value {
            parameter::Value::Real(value) => Self::Real(value),
            parameter::Value::Count(value) => Self::Count(value),
            parameter::Value::Flag(value) => Self::Flag(value),
            parameter::Value::Choice(value) => Self::Choice(value),
            parameter::Value::Type(value) => Self::Type(value),
            parameter::Value::Integer(value) => Self::Integer(value),
        }
    }
}

impl TryFrom<Value> for parameter::Value {
    type Error = NoCommand;

    fn try_from(value: Value) -> Result<Self, NoCommand> {
        Ok(match value {
            Value::Real(value) => Self::Real(value),
            Value::Count(value) => Self::Count(value),
            Value::Flag(value) => Self::Flag(value),
            Value::Choice(value) => Self::Choice(value),
            Value::Type(value) => Self::Type(value),
            Value::Integer(value) => Self::Integer(value),
            Value::Module(_) | Value::Nothing | Value::Words(_) => return Err(NoCommand),
        })
    }
}

impl Wire {
    fn of_law(number: u8, place: u8, value: Value) -> Self {
        Self { target: Target::Engine, number, entry: Some(place), value }
    }
}

impl From<Command> for Wire {
    fn from(command: Command) -> Self {
        match command {
            Command::Set { module, parameter, entry, value } => {
                // No module has so many parameters that the number would mean a port.
                let number = parameter.min(PORT - 1);
                Self { target: Target::Module(module), number, entry, value: value.into() }
            }
            Command::Bind { module, port, signal } => {
                let (target, number) = (Target::Module(module), PORT.saturating_add(port));
                Self { target, number, entry: None, value: Value::Type(signal) }
            }
            Command::UploadLaw { place, words } => Self::of_law(PUT_LAW, place, Value::Words(words)),
            Command::StoreLaw { number, count } => Self::of_law(KEEP_LAW, number, Value::Count(count.into())),
            Command::RemoveLaw { number } => Self::of_law(REMOVE_LAW, number, Value::Nothing),
            command => {
                let (number, module) = command.to_engine().unwrap_or_default();
                let value = module.map_or(Value::Nothing, Value::Module);
                Self { target: Target::Engine, number, entry: None, value }
            }
        }
    }
}

impl TryFrom<Wire> for Command {
    type Error = NoCommand;

    fn try_from(Wire { target, number, entry, value }: Wire) -> Result<Self, NoCommand> {
        let Target::Module(module) = target else {
            let module = match value {
                Value::Words(words) if number == PUT_LAW => {
                    return Ok(Self::UploadLaw { place: entry.ok_or(NoCommand)?, words });
                }
                Value::Count(count) if number == KEEP_LAW => {
                    let count = u8::try_from(count).map_err(|_| NoCommand)?;
                    return Ok(Self::StoreLaw { number: entry.ok_or(NoCommand)?, count });
                }
                Value::Nothing if number == REMOVE_LAW => {
                    return Ok(Self::RemoveLaw { number: entry.ok_or(NoCommand)? });
                }
                Value::Module(module) => Some(module),
                Value::Nothing => None,
                _ => return Err(NoCommand),
            };
            return Self::of_engine(number, module).ok_or(NoCommand);
        };
        match (number.checked_sub(PORT), value) {
            (Some(port), Value::Type(signal)) => Ok(Self::Bind { module, port, signal }),
            (Some(_), _) => Err(NoCommand),
            (None, value) => Ok(Self::Set { module, parameter: number, entry, value: value.try_into()? }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::EngineCommand;

    const MODULE: ModuleRef = ModuleRef::new("WAVEIMP_MOD", 2);

    #[test]
    fn every_command_is_read_as_it_was_written() {
        let of_engine = EngineCommand::ALL.iter().map(|known| {
            let command = known.with(known.needs_module.then_some(MODULE)).unwrap();
            assert_eq!(command.as_engine_command(), Some(*known));
            command
        });
        let signal = TypeRef { id: 300, number: 1 };
        let values = [
            parameter::Value::Real(1.5),
            parameter::Value::Count(300),
            parameter::Value::Flag(true),
            parameter::Value::Choice(2),
            parameter::Value::Type(signal),
            parameter::Value::Integer(i32::MIN),
        ];
        let sets = values.map(|value| Command::Set { module: MODULE, parameter: 127, entry: Some(7), value });
        let others = [Command::bind(MODULE, 0, signal), Command::bind(MODULE, 127, signal)];
        let laws = [
            Command::UploadLaw { place: 118, words: [u32::MAX, 0] },
            Command::StoreLaw { number: 4, count: 120 },
            Command::RemoveLaw { number: 1 },
        ];
        for command in of_engine.chain(sets).chain(others).chain(laws) {
            let mut buffer = [0; 24];
            let bytes = postcard::to_slice(&command, &mut buffer).unwrap();
            assert_eq!(postcard::from_bytes(bytes), Ok(command));
        }
    }

    #[test]
    fn what_is_no_command_is_not_read() {
        let read = postcard::from_bytes::<Command>;
        assert_eq!(read(&[0, 17, 0, 6]), Ok(Command::Stop));
        for no_command in [
            // An unknown engine command.
            &[0, 0, 0, 6][..],
            &[0, 255, 0, 5, 3, 2],
            // MOD_ON without a module, STOP with one, MATCHING_CHECK with a number.
            &[0, 1, 0, 6],
            &[0, 17, 0, 5, 3, 2],
            &[0, 16, 0, 0, 0, 0, 0x80, 0x3F],
            // A law's words without an index, with the number of another command, and out of range.
            &[0, 32, 0, 8, 1, 1],
            &[0, 33, 1, 1, 8, 1, 1],
            &[0, 33, 1, 1, 1, 0x80, 2],
            // A port bound to a number; a parameter set to a module, and without a value.
            &[1, 3, 2, 128, 0, 1, 1],
            &[1, 3, 2, 4, 0, 5, 3, 2],
            &[1, 3, 2, 4, 0, 6],
        ] {
            assert!(read(no_command).is_err(), "{no_command:?}");
        }
    }
}
