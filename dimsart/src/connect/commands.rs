//! The scheme that a device has, as commands.

use std::io::{Read, Write};

use dimsart_core::protocol::{Request, Response};
use dimsart_core::{Command, Cursor};

use super::{ConnectError, Device};

impl<S: Read + Write> Device<S> {
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
