//! A scheme sent row by row, in one transaction.

use std::io::{Read, Write};

use dimsart_core::scheme::{self, Place, Row, SchemeError};
use dimsart_core::{Command, CommandError, protocol::Effect};
use serde::Serialize;

use super::command::ANY_SIDE;
use super::{ConnectError, Device};
use hil_sim::schemes::{Explained, SIDES, SchemeText, rows};

/// A scheme that arrived.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Sent {
    /// Rows that were for this side.
    pub rows: usize,
    /// Whether the scheme commands the device, with the first reason if it does not.
    pub state: String,
}

impl<S: Read + Write> Device<S> {
    /// Gives the rows for `side` to the device, upon what is there, in one transaction: what runs goes on meanwhile.
    ///
    /// # Errors
    /// [`ConnectError::Row`] for a row that is not understood or refused, with its place; [`ConnectError::Command`] when
    /// the whole is refused, or another transaction is open. Nothing has changed then. [`ConnectError::Line`] when the
    /// device does not answer.
    pub fn send_scheme(&mut self, scheme: &SchemeText, side: &str) -> Result<Sent, ConnectError> {
        self.send(scheme, side, None)
    }

    /// The same in place of what is there.
    ///
    /// # Errors
    /// As [`send_scheme`](Self::send_scheme).
    pub fn replace_scheme(&mut self, scheme: &SchemeText, side: &str) -> Result<Sent, ConnectError> {
        self.send(scheme, side, Some(Command::Close))
    }

    /// The rows for `side`, or for any, that build the scheme as it is; [`rows`](hil_sim::schemes::rows).
    ///
    /// # Errors
    /// [`ConnectError::Line`] when the device does not answer.
    pub fn scheme_rows(&mut self, side: Option<&str>) -> Result<String, ConnectError> {
        let (commands, side) = (self.commands()?, side.unwrap_or(ANY_SIDE));
        self.know(|known| rows(&commands, side, known))
    }

    fn send(
        &mut self,
        scheme: &SchemeText,
        side: &str,
        first: Option<Command>,
    ) -> Result<Sent, ConnectError> {
        self.begin()?;
        let sent = self.send_rows(scheme, side, first).and_then(|rows| {
            self.commit()?;
            Ok(rows)
        });
        // What cannot be aborted on a line that is gone, the next `begin` says.
        let rows = sent.inspect_err(|_| drop(self.abort()))?;
        let blocked = self.status()?.blocked;
        Ok(Sent { rows, state: self.state_text(blocked)? })
    }

    fn send_rows(
        &mut self,
        scheme: &SchemeText,
        side: &str,
        first: Option<Command>,
    ) -> Result<usize, ConnectError> {
        let hint = match self.instances()?.len() {
            0 => String::new(),
            _ if first.is_some() => String::new(),
            count => {
                format!(". {count} modules are on the device: `--replace` puts the scheme in their place")
            }
        };
        if let Some(first) = first {
            self.give(first)?;
        }
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
        Ok(rows)
    }

    fn send_row(&mut self, row: &Row<'_>) -> Result<Result<(), Misread>, ConnectError> {
        let command = match self.know(|known| row.command(known))? {
            Ok(command) => command,
            Err(error) => return Ok(Err(self.misread(error)?)),
        };
        if matches!(command, Command::Begin | Command::Commit | Command::Abort) {
            let mut misread = self.misread(row.refused(CommandError::TransactionOpen))?;
            misread.message =
                "refused: the file is sent as one transaction, it opens and ends none".to_owned();
            return Ok(Err(misread));
        }
        let Effect { refused, .. } = self.try_give(command)?;
        let Some(refused) = refused else { return Ok(Ok(())) };
        let mut misread = self.misread(row.refused(refused))?;
        if matches!(refused, CommandError::DoesNotMatch { .. }) {
            misread.message = format!("refused: {}", self.refusal_with_faults(refused)?);
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
