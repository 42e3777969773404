//! Commands and what they come to on the device.

use std::fmt;
use std::io::{Read, Write};

use dimsart_core::protocol::{Effect, Request, Response};
use dimsart_core::{Command, CommandError, ModuleRef, Value};

use super::device::take;
use super::show::ParameterReport;
use super::words::{MODULE, VALUE};
use super::{ConnectError, Device};

/// What an accepted command came to.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// What holds now of that which was commanded.
    pub effect: String,
    /// Whether the scheme commands the device now.
    pub is_commanded: bool,
    /// The same in words, with the first reason if it does not.
    pub state: String,
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}; {}", self.effect, self.state)
    }
}

impl<S: Read + Write> Device<S> {
    /// Value, unit and range of a parameter, `K_PARAM`, or of one axis, `K_PARAM[0]`.
    ///
    /// # Errors
    /// [`ConnectError::Word`] for a name that the device does not have or a module that does not exist.
    pub fn get(&mut self, module: &str, parameter: &str) -> Result<ParameterReport, ConnectError> {
        let module = self.word_to_module(MODULE, module)?;
        let named = self.word_to_parameter(module, parameter)?;
        let instances = self.instances()?;
        if instances.iter().any(|instance| instance.module == module) {
            return self.parameter_report(module, &named);
        }
        let mut known = Vec::new();
        for instance in instances {
            known.push(self.module_name(instance.module)?);
        }
        let known = if known.is_empty() { "there is none yet".to_owned() } else { known.join(", ") };
        let name = self.module_name(module)?;
        let message =
            format!("there is no {name} on the device yet, `set` or `on` makes it; there is: {known}");
        Err(ConnectError::Word { index: MODULE, message })
    }

    /// Sets a parameter, `K_PARAM` or `K_PARAM[0]`, or binds a port, `PORT_FORCE`.
    ///
    /// # Errors
    /// [`ConnectError::Word`] for what is not understood, [`ConnectError::Command`] for what the device
    /// refuses; nothing has changed then.
    pub fn set(&mut self, module: &str, parameter: &str, value: &str) -> Result<Outcome, ConnectError> {
        let command = self.words_to_command([module, parameter, value])?;
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
            let reason = self.refused(command, error)?;
            return Err(ConnectError::Command(format!("{reason}; {module} {parameter} stays {holds}")));
        }
        self.outcome(format!("{module} {parameter} is {holds}"), &effect)
    }

    /// Plugs a module in.
    ///
    /// # Errors
    /// As [`set`](Self::set).
    pub fn on(&mut self, module: &str) -> Result<Outcome, ConnectError> {
        let reference = self.word_to_module(VALUE, module)?;
        let effect = self.give(Command::PlugIn(reference))?;
        let place = self.instances()?.into_iter().find(|instance| instance.module == reference);
        let place = place.and_then(|instance| instance.place);
        let effect_text = match place {
            Some(place) => format!("{module} is plugged in, at place {}", u16::from(place) + 1),
            None => format!("{module} is not plugged in any more"),
        };
        self.outcome(effect_text, &effect)
    }

    /// Unplugs a module; it keeps its parameters.
    ///
    /// # Errors
    /// As [`set`](Self::set).
    pub fn off(&mut self, module: &str) -> Result<Outcome, ConnectError> {
        let reference = self.word_to_module(VALUE, module)?;
        let effect = self.give(Command::Unplug(reference))?;
        self.outcome(format!("{module} is unplugged and keeps its parameters"), &effect)
    }

    /// Stops the scheme: the device gets its safe input.
    ///
    /// # Errors
    /// [`ConnectError::Line`] when the device does not answer.
    pub fn stop(&mut self) -> Result<Outcome, ConnectError> {
        let effect = self.give(Command::Stop)?;
        self.outcome("the device gets its safe input".to_owned(), &effect)
    }

    /// Lets a module, or every one that is plugged in, forget its state.
    ///
    /// # Errors
    /// As [`set`](Self::set).
    pub fn reset(&mut self, module: Option<&str>) -> Result<Outcome, ConnectError> {
        let Some(module) = module else {
            let effect = self.give(Command::Reset)?;
            return self.outcome("every module forgot its state".to_owned(), &effect);
        };
        self.give_to(module, Command::ResetModule, "forgot its state")
    }

    /// Brings the parameters of a module that is not plugged in back to their defaults.
    ///
    /// # Errors
    /// As [`set`](Self::set).
    pub fn init(&mut self, module: &str) -> Result<Outcome, ConnectError> {
        self.give_to(module, Command::InitModule, "has its default parameters")
    }

    /// Takes a module away; or stops the scheme and takes all of them away.
    ///
    /// # Errors
    /// As [`set`](Self::set).
    pub fn close(&mut self, module: Option<&str>) -> Result<Outcome, ConnectError> {
        let Some(module) = module else {
            let effect = self.give(Command::Close)?;
            return self.outcome("no module is left".to_owned(), &effect);
        };
        self.give_to(module, Command::CloseModule, "is gone")
    }

    /// A command about one module, and what it comes to.
    fn give_to(
        &mut self,
        module: &str,
        command: fn(ModuleRef) -> Command,
        comes_to: &str,
    ) -> Result<Outcome, ConnectError> {
        let reference = self.word_to_module(VALUE, module)?;
        let effect = self.give(command(reference))?;
        self.outcome(format!("{module} {comes_to}"), &effect)
    }

    /// Gives a command; a refusal is an error.
    pub(super) fn give(&mut self, command: Command) -> Result<Effect, ConnectError> {
        let effect = self.try_give(command)?;
        match effect.refused {
            None => Ok(effect),
            Some(error) => Err(ConnectError::Command(self.refused(command, error)?)),
        }
    }

    pub(super) fn try_give(&mut self, command: Command) -> Result<Effect, ConnectError> {
        self.ask(&Request::Command(command), take!(Effect))?.ok_or(ConnectError::OtherAnswer)
    }

    /// Why the device refused this command.
    pub(super) fn refused(&mut self, command: Command, error: CommandError) -> Result<String, ConnectError> {
        let Command::Set { module, parameter, .. } = command else { return self.refusal_text(error, None) };
        let parameters = self.parameters(module.kind)?;
        self.refusal_text(error, parameters.get(usize::from(parameter)))
    }

    fn outcome(&mut self, effect: String, answer: &Effect) -> Result<Outcome, ConnectError> {
        let state = self.state_text(answer.blocked)?;
        Ok(Outcome { effect, is_commanded: answer.blocked.is_none(), state })
    }
}
