//! A scheme sent row by row.

use std::io::{Read, Write};

use dimsart_core::scheme::{self, Place, Row, SchemeError};
use dimsart_core::{CommandError, protocol::Effect};

use super::{ConnectError, Device};
use crate::schemes::{Explained, SIDES, SchemeText};

/// A scheme that arrived.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sent {
    /// Rows that were for this side.
    pub rows: usize,
    /// Whether the scheme commands the device, with the first reason if it does not.
    pub state: String,
}

impl<S: Read + Write> Device<S> {
    /// Gives the rows for `side` to the device, in order, until one is refused.
    ///
    /// # Errors
    /// [`ConnectError::Row`] for a row that is not understood or refused, with its place; the rows before
    /// it are in force. [`ConnectError::Line`] when the device does not answer.
    pub fn send_scheme(&mut self, scheme: &SchemeText, side: &str) -> Result<Sent, ConnectError> {
        let hint = match self.instances()?.len() {
            0 => String::new(),
            count => format!(
                ". {count} modules were on the device before: `--replace` puts the scheme in their place"
            ),
        };
        let mut rows = 0;
        for row in scheme::rows_for(&scheme.text, side, SIDES) {
            let sent = match row {
                Ok(row) => self.send_row(&row)?,
                Err(error) => Err(self.misread(error)?),
            };
            sent.map_err(|Misread { line, column, message }| {
                let (name, hint) = (scheme.name.clone(), hint.clone());
                ConnectError::Row { name, row: line, column, message, hint }
            })?;
            rows += 1;
        }
        let blocked = self.status()?.blocked;
        Ok(Sent { rows, state: self.state_text(blocked)? })
    }

    fn send_row(&mut self, row: &Row<'_>) -> Result<Result<(), Misread>, ConnectError> {
        let command = match self.know(|known| row.command(known))? {
            Ok(command) => command,
            Err(error) => return Ok(Err(self.misread(error)?)),
        };
        let Effect { refused, blocked, .. } = self.try_give(command)?;
        let Some(refused) = refused else { return Ok(Ok(())) };
        let error = row.refused(refused);
        let mut misread = self.misread(error)?;
        // The first fault says more than their number.
        if let (CommandError::DoesNotMatch { faults }, Some(blocked)) = (refused, blocked) {
            let first = self.blocked_text(blocked)?;
            misread.message =
                format!("refused: the scheme has {faults} fault(s), the first: {first}; `faults` names all");
        }
        Ok(Err(misread))
    }

    fn misread(&mut self, error: SchemeError<'_>) -> Result<Misread, ConnectError> {
        let Place { line, column, .. } = error.place;
        let message = self.know(|known| Explained { error, known }.to_string())?;
        Ok(Misread { line, column, message })
    }
}

/// A row that was not understood or refused, and where.
struct Misread {
    line: usize,
    column: usize,
    message: String,
}
