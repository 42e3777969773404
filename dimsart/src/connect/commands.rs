//! Reads the scheme of a device as a list of commands.

use std::io::{Read, Write};

use dimsart_core::{Command, CommandCursor};
use dimsart_link::protocol::{Request, Response};

use super::{ConnectError, Device, LineError};

impl<S: Read + Write> Device<S> {
    /// Reads the commands that rebuild the current scheme.
    ///
    /// # Errors
    /// [`ConnectError::Line`] when the device does not answer, or uses a command of a newer version.
    pub fn commands(&mut self) -> Result<Vec<Command>, ConnectError> {
        let commands: Option<Vec<Command>> = self.commands_known()?.into_iter().collect();
        commands.ok_or(ConnectError::Line(LineError::Unsupported))
    }

    /// Reads the commands as [`commands`](Self::commands) does; `None` stands for a command of a newer version.
    pub(super) fn commands_known(&mut self) -> Result<Vec<Option<Command>>, ConnectError> {
        let take = |response: Response<'_>| match response {
            Response::SchemeCommand(command) => Some(command),
            _ => None,
        };
        let (mut cursor, mut commands) = (CommandCursor::default(), Vec::new());
        loop {
            let (place, index) = cursor.next_command_location();
            let command = match self.ask(&Request::SchemeCommand { place, index }, take) {
                Err(ConnectError::Line(LineError::Unsupported)) => Some(None),
                command => command?.map(Some),
            };
            commands.extend(command);
            if !cursor.advance(command.is_some()) {
                return Ok(commands);
            }
        }
    }
}
