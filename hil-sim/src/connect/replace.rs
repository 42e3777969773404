//! One scheme in place of another, or the old one back.

use std::io::{Read, Write};

use dimsart_core::protocol::{Request, Response};
use dimsart_core::{Command, Cursor};

use super::scheme::Sent;
use super::{ConnectError, Device};
use crate::schemes::SchemeText;

impl<S: Read + Write> Device<S> {
    /// Stops the scheme that is on the device and puts another one in its place.
    ///
    /// # Errors
    /// [`ConnectError::Replace`] when a row is not understood or refused: the old scheme is on the device again, and
    /// runs if it ran. [`ConnectError::Line`] when the device does not answer.
    pub fn replace_scheme(&mut self, scheme: &SchemeText, side: &str) -> Result<Sent, ConnectError> {
        let was_running = self.status()?.is_running;
        let before = self.commands()?;
        self.give(Command::Close)?;
        match self.send_scheme(scheme, side) {
            Err(error @ ConnectError::Row { .. }) => {
                self.give(Command::Close)?;
                let start = was_running.then_some(Command::Check);
                for command in before.into_iter().chain(start) {
                    self.give(command)?;
                }
                Err(ConnectError::Replace(Box::new(error)))
            }
            result => result,
        }
    }

    /// The commands that would build the scheme as it is.
    ///
    /// # Errors
    /// [`ConnectError::Line`] when the device does not answer.
    pub fn commands(&mut self) -> Result<Vec<Command>, ConnectError> {
        let take = |response: Response<'_>| match response {
            Response::SchemeCommand(command) => Some(command),
            _ => None,
        };
        let (mut cursor, mut commands) = (Cursor::default(), Vec::new());
        loop {
            let (place, index) = cursor.place_and_index();
            let command = self.ask(&Request::SchemeCommand { place, index }, take)?;
            commands.extend(command);
            if !cursor.advance(command.is_some()) {
                return Ok(commands);
            }
        }
    }
}
