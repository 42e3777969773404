//! Commands to a device, and their outcome.

use std::fmt;
use std::io::{Read, Write};

use dimsart_core::scheme::Row;
use dimsart_core::{Command, CommandError, ModuleRef, ParameterError, Value, Vocabulary};
use dimsart_link::protocol::{Effect, Request, Response};
use serde::Serialize;

use super::device::take;
use super::show::ParameterReport;
use super::{ConnectError, Device};

/// Destination of a row that applies to every device.
pub(crate) const ALL_DESTINATIONS: &str = "all";

/// Outcome of an accepted command.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CommandOutcome {
    /// Value or state in force after the command.
    pub effect: String,
    /// Whether the scheme commands the device now.
    pub is_commanded: bool,
    /// Text of `is_commanded`, with the first reason if it is false.
    pub state: String,
}

impl fmt::Display for CommandOutcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}; {}", self.effect, self.state)
    }
}

impl<S: Read + Write> Device<S> {
    /// Reads value, unit and range of a parameter, `K_PARAM`, or of one axis, `K_PARAM[0]`.
    ///
    /// # Errors
    /// [`ConnectError::InvalidWord`] for an unknown name or a module that does not exist.
    pub fn get(&mut self, module: &str, parameter: &str) -> Result<ParameterReport, ConnectError> {
        let row = Row::from_words(&[ALL_DESTINATIONS, module, parameter]);
        let law = self.law_of(&row)?;
        let (module, parameter, entry) = self.read(law.as_ref(), |known| {
            let named = row.parameter(known)?;
            let found = known.parameter_text(named.0.kind, named.1);
            let count = found.map_or(0, |found| found.entries.count(known.dof()));
            let is_there = named.2.is_none_or(|place| place < count);
            let no_such_entry = CommandError::Parameter(ParameterError::NoSuchEntry);
            is_there.then_some(named).ok_or_else(|| row.refused(no_such_entry))
        })?;
        let instances = self.instances()?;
        if instances.iter().any(|instance| instance.module == module) {
            return self.parameter_report(module, parameter, entry);
        }
        let mut known = Vec::new();
        for instance in instances {
            known.push(self.module_name(instance.module)?);
        }
        let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
        let name = self.module_name(module)?;
        Err(ConnectError::InvalidWord(format!(
            "the device has no module {name}: `set` or `on` creates it (existing modules: {known})"
        )))
    }

    /// Sets a parameter, `K_PARAM` or `K_PARAM[0]`, or binds a port, `PORT_FORCE`.
    ///
    /// # Errors
    /// [`ConnectError::InvalidWord`] for an unknown name or value, [`ConnectError::Command`] when the device refuses it; nothing has
    /// changed then.
    pub fn set(
        &mut self,
        module: &str,
        parameter: &str,
        value: &str,
    ) -> Result<CommandOutcome, ConnectError> {
        let row = Row::from_words(&[ALL_DESTINATIONS, module, parameter, value]);
        let law = self.law_of(&row)?;
        let command = match self.read(law.as_ref(), |known| known.command(&row)) {
            Err(ConnectError::InvalidWord(wrong)) => {
                let stays = match self.get(module, parameter) {
                    Ok(report) => format!("; {module} {parameter} stays {}", report.values_text()),
                    Err(error @ ConnectError::Line(_)) => return Err(error),
                    Err(_) => String::new(),
                };
                return Err(ConnectError::InvalidWord(format!("{wrong}{stays}")));
            }
            command => command?,
        };
        let effect = self.try_give(command)?;
        let holds = match effect.value {
            None => None,
            Some(Value::Type(signal)) if matches!(command, Command::Bind { .. }) => {
                Some(self.signal_name(signal)?)
            }
            Some(_) => Some(self.get(module, parameter)?.values_text()),
        };
        let holds = holds.unwrap_or_else(|| "not set".to_owned());
        if let Some(error) = effect.refused {
            let reason = self.refusal_text(error)?;
            return Err(ConnectError::Command(format!("{reason}; {module} {parameter} stays {holds}")));
        }
        self.change(format!("{module} {parameter} is {holds}"), &effect)
    }

    /// Plugs a module in, before another one or as the last.
    ///
    /// # Errors
    /// As [`set`](Self::set).
    pub fn plug_in(&mut self, module: &str, before: Option<&str>) -> Result<CommandOutcome, ConnectError> {
        let reference = self.module(module)?;
        if let Some(before) = before {
            let before = self.module(before)?;
            self.give(Command::PlaceBefore(before))?;
        }
        let effect = self.give(Command::PlugIn(reference))?;
        let place = self.instances()?.into_iter().find(|instance| instance.module == reference);
        let place = place.and_then(|instance| instance.place);
        let effect_text = match place {
            Some(place) => format!("{module} is plugged in at position {}", u16::from(place) + 1),
            None => format!("{module} was unplugged again"),
        };
        self.change(effect_text, &effect)
    }

    /// Unplugs a module; it keeps its parameters.
    ///
    /// # Errors
    /// As [`set`](Self::set).
    pub fn unplug(&mut self, module: &str) -> Result<CommandOutcome, ConnectError> {
        let reference = self.module(module)?;
        let effect = self.give(Command::Unplug(reference))?;
        self.change(format!("{module} is unplugged and keeps its parameters"), &effect)
    }

    /// Stops the scheme and releases the lease, whichever client holds it: outputs at their safe value.
    ///
    /// # Errors
    /// [`ConnectError::Line`] when the device does not answer.
    pub fn stop(&mut self) -> Result<CommandOutcome, ConnectError> {
        let effect = self.give(Command::Stop)?;
        self.outcome("outputs at their safe value, lease released".to_owned(), &effect)
    }

    /// Resets the state of a module, or of all plugged-in modules.
    ///
    /// # Errors
    /// As [`set`](Self::set).
    pub fn reset(&mut self, module: Option<&str>) -> Result<CommandOutcome, ConnectError> {
        let Some(module) = module else {
            let effect = self.give(Command::Reset)?;
            return self.outcome("all modules reset".to_owned(), &effect);
        };
        let effect = self.module(module).and_then(|module| self.give(Command::ResetModule(module)))?;
        self.outcome(format!("{module} reset"), &effect)
    }

    /// Resets the parameters of an unplugged module to their defaults.
    ///
    /// # Errors
    /// As [`set`](Self::set).
    pub fn reset_parameters(&mut self, module: &str) -> Result<CommandOutcome, ConnectError> {
        self.give_to(module, Command::InitModule, "has its default parameters")
    }

    /// Deletes a module; or stops the scheme and deletes all modules.
    ///
    /// # Errors
    /// As [`set`](Self::set).
    pub fn delete_module(&mut self, module: Option<&str>) -> Result<CommandOutcome, ConnectError> {
        let Some(module) = module else {
            let effect = self.give(Command::Close)?;
            return self.change("all modules deleted".to_owned(), &effect);
        };
        self.give_to(module, Command::CloseModule, "is deleted")
    }

    /// Sends a command about one module and returns its outcome.
    fn give_to(
        &mut self,
        module: &str,
        command: fn(ModuleRef) -> Command,
        comes_to: &str,
    ) -> Result<CommandOutcome, ConnectError> {
        let reference = self.module(module)?;
        let effect = self.give(command(reference))?;
        self.change(format!("{module} {comes_to}"), &effect)
    }

    /// Sends a command; a refusal is an error.
    pub(super) fn give(&mut self, command: Command) -> Result<Effect, ConnectError> {
        let effect = self.try_give(command)?;
        match effect.refused {
            None => Ok(effect),
            Some(error) => Err(ConnectError::Command(self.refusal_with_faults(error)?)),
        }
    }

    /// Sends a command; a refusal is an error unless it is `done`: the command was carried out before.
    pub(super) fn give_unless(
        &mut self,
        command: Command,
        done: CommandError,
    ) -> Result<Effect, ConnectError> {
        match self.try_give(command)? {
            effect if effect.refused == Some(done) => Ok(effect),
            Effect { refused: Some(error), .. } => {
                Err(ConnectError::Command(self.refusal_with_faults(error)?))
            }
            effect => Ok(effect),
        }
    }

    /// Explains why a command was refused, with all faults of a scheme that does not match.
    pub(super) fn refusal_with_faults(&mut self, error: CommandError) -> Result<String, ConnectError> {
        let CommandError::HasFaults { faults } = error else { return self.refusal_text(error) };
        let (_, findings) = self.findings()?;
        let texts = findings.into_iter().filter(|finding| finding.is_fault).map(|finding| finding.text);
        Ok(format!("the scheme has {faults} fault(s): {}", texts.collect::<Vec<_>>().join("; ")))
    }

    pub(super) fn try_give(&mut self, command: Command) -> Result<Effect, ConnectError> {
        if command == Command::Stop {
            // STOP ends the lease. A lost lease must not prevent STOP.
            self.forget_lease();
        }
        self.ask(&Request::Command(command), take!(Effect))?.ok_or(ConnectError::UnexpectedAnswer)
    }

    /// Returns the outcome of a change of the scheme.
    fn change(&mut self, effect: String, answer: &Effect) -> Result<CommandOutcome, ConnectError> {
        let waits =
            if answer.is_in_transaction { " in the pending scheme; run `commit` to apply it" } else { "" };
        self.outcome(effect + waits, answer)
    }

    pub(super) fn outcome(
        &mut self,
        effect: String,
        answer: &Effect,
    ) -> Result<CommandOutcome, ConnectError> {
        let state = self.state_text(answer.blocked)?;
        Ok(CommandOutcome { effect, is_commanded: answer.blocked.is_none(), state })
    }
}
