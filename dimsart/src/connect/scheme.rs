//! Sends a scheme row by row, in one transaction.

use std::io::{Read, Write};

use dimsart_core::scheme::{self, Row, RowError, SchemeError, SourceLocation};
use dimsart_core::{Command, CommandError, ModuleRef};
use dimsart_link::protocol::Effect;
use serde::Serialize;

use super::command::ALL_DESTINATIONS;
use super::{ConnectError, Device};
use hil_sim::law::{Law, LawVocabulary};
use hil_sim::schemes::{SIDES, SchemeErrorMessage, SchemeText, rows};

/// Outcome of sending a scheme.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct SendOutcome {
    /// Rows for this side.
    pub rows: usize,
    /// Whether the scheme commands the device, with the first reason if it does not.
    pub state: String,
    /// Rows that were skipped because they are unknown to the device, each with its location.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub skipped: Vec<String>,
}

/// Options for sending rows.
#[derive(Debug, Default)]
pub(super) struct Sending {
    /// Commands before the rows; if empty, the rows add to the present scheme.
    pub(super) first: Vec<Command>,
    /// Skips rows that are unknown to the device.
    pub(super) skips_unknown: bool,
    /// Checks the pending scheme on the device without applying it.
    pub(super) is_dry_run: bool,
}

impl<S: Read + Write> Device<S> {
    /// Adds the rows for `side` to the scheme of the device, in one transaction. The running scheme continues meanwhile.
    ///
    /// # Errors
    /// [`ConnectError::InvalidRow`] for an invalid or refused row, with its location; [`ConnectError::Command`] when the scheme is
    /// refused, or another transaction is open. Nothing has changed then. [`ConnectError::Line`] when the device does not
    /// answer.
    pub fn send_scheme(&mut self, scheme: &SchemeText, side: &str) -> Result<SendOutcome, ConnectError> {
        self.send(scheme, side, Sending::default())
    }

    /// Replaces the scheme of the device by the rows for `side`.
    ///
    /// # Errors
    /// As [`send_scheme`](Self::send_scheme).
    pub fn replace_scheme(&mut self, scheme: &SchemeText, side: &str) -> Result<SendOutcome, ConnectError> {
        self.send(scheme, side, Sending { first: vec![Command::Close], ..Sending::default() })
    }

    /// Replaces the pending scheme of the open transaction by rows for all destinations.
    ///
    /// # Errors
    /// As [`send_scheme`](Self::send_scheme); the transaction stays open with the rows before the refused one.
    pub(crate) fn replace_pending(&mut self, scheme: &SchemeText) -> Result<(), ConnectError> {
        let sending = Sending { first: vec![Command::Close], ..Sending::default() };
        self.send_rows(scheme, ALL_DESTINATIONS, sending).map(drop)
    }

    /// Returns the rows that rebuild the current scheme, with this destination or `all`; see [`rows`](hil_sim::schemes::rows).
    ///
    /// # Errors
    /// [`ConnectError::Line`] when the device does not answer.
    pub fn scheme_rows(&mut self, side: Option<&str>) -> Result<String, ConnectError> {
        let commands = self.commands()?;
        self.rows_of(&commands, side.unwrap_or(ALL_DESTINATIONS))
    }

    pub(super) fn rows_of(&mut self, commands: &[Command], side: &str) -> Result<String, ConnectError> {
        self.know(|known| rows(commands, side, known))
    }

    pub(super) fn send(
        &mut self,
        scheme: &SchemeText,
        side: &str,
        sending: Sending,
    ) -> Result<SendOutcome, ConnectError> {
        self.may_change()?;
        self.begin()?;
        let is_dry_run = sending.is_dry_run;
        let sent = self.send_rows(scheme, side, sending).and_then(|sent| {
            if is_dry_run {
                self.give(Command::Check)?;
                self.abort()?;
            } else {
                self.commit()?;
            }
            Ok(sent)
        });
        // If the line is closed and the abort is lost, the next `begin` reports the open transaction.
        let (rows, skipped) = sent.inspect_err(|_| drop(self.abort()))?;
        let blocked = self.status()?.blocked;
        Ok(SendOutcome { rows, state: self.state_text(blocked)?, skipped })
    }

    fn send_rows(
        &mut self,
        scheme: &SchemeText,
        side: &str,
        sending: Sending,
    ) -> Result<(usize, Vec<String>), ConnectError> {
        let Sending { first, skips_unknown, .. } = sending;
        let hint = match self.instances()?.len() {
            0 => String::new(),
            _ if !first.is_empty() => String::new(),
            count => {
                format!(". The device has {count} modules already: use `--replace` to replace them")
            }
        };
        for command in first {
            self.give(command)?;
        }
        let laws = self.laws_for(&scheme.text)?;
        let (mut rows, mut skipped) = (0, Vec::new());
        for row in scheme::rows_for(&scheme.text, side, SIDES) {
            let sent = match row {
                Ok(row) => self.send_row(&row, &laws)?,
                Err(error) => Err(self.misread(error, None)?),
            };
            let name = scheme.name.clone();
            match sent {
                Ok(()) => rows += 1,
                Err(Misread { line, column, message, is_unknown: true }) if skips_unknown => {
                    skipped.push(format!("{name}:{line}:{column}: {message}"));
                }
                Err(Misread { line, column, message, .. }) => {
                    return Err(ConnectError::InvalidRow { name, row: line, column, message, hint });
                }
            }
        }
        Ok((rows, skipped))
    }

    fn send_row(&mut self, row: &Row<'_>, laws: &[(u8, Law)]) -> Result<Result<(), Misread>, ConnectError> {
        let runner = if laws.is_empty() { None } else { self.runner_of(row)? };
        let law = runner.and_then(|(module, number)| {
            let (_, law) = laws.iter().find(|(known, _)| *known == number)?;
            Some((module, law.clone()))
        });
        let law = law.as_ref();
        let command = match self.know(|known| LawVocabulary::new(known, law).command(row))? {
            Ok(command) => command,
            Err(error) => return Ok(Err(self.misread(error, law)?)),
        };
        if matches!(command, Command::Begin | Command::Commit | Command::Abort) {
            let mut misread = self.misread(row.refused(CommandError::TransactionOpen), None)?;
            misread.message =
                "refused: remove this row, because a file is always sent as one transaction".to_owned();
            return Ok(Err(misread));
        }
        let Effect { refused, .. } = self.try_give(command)?;
        let Some(refused) = refused else { return Ok(Ok(())) };
        let mut misread = self.misread(row.refused(refused), law)?;
        if matches!(refused, CommandError::HasFaults { .. }) {
            misread.message = format!("refused: {}", self.refusal_with_faults(refused)?);
        }
        Ok(Err(misread))
    }

    fn misread(
        &mut self,
        error: SchemeError<'_>,
        law: Option<&(ModuleRef, Law)>,
    ) -> Result<Misread, ConnectError> {
        let SourceLocation { line, column, word } = error.place;
        let message = self
            .know(|known| SchemeErrorMessage { error, known: &LawVocabulary::new(known, law) }.to_string())?;
        let is_unknown = match error.problem {
            RowError::Destination | RowError::Surplus | RowError::Entry { .. } | RowError::Refused(_) => {
                false
            }
            // Another version may name a choice differently; a wrong number is wrong in every version.
            RowError::Value { .. } => word.starts_with(|first: char| first.is_ascii_alphabetic()),
            _ => !word.is_empty(),
        };
        Ok(Misread { line, column, message, is_unknown })
    }
}

/// An invalid or refused row and its location.
struct Misread {
    line: usize,
    column: usize,
    message: String,
    /// Whether the word may be valid in another version.
    is_unknown: bool,
}
