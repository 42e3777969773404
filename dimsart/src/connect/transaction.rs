//! Transactions on the device: the next scheme is put together while the other one runs.

use std::io::{Read, Write};

use dimsart_core::{Command, CommandError};

use super::{CommandOutcome, ConnectError, Device};

impl<S: Read + Write> Device<S> {
    /// Opens a transaction: what is changed from now on, by whomever, is the next scheme's.
    ///
    /// # Errors
    /// [`ConnectError::Command`] when one is open already. [`ConnectError::Line`] when the device does not answer.
    pub fn begin(&mut self) -> Result<CommandOutcome, ConnectError> {
        if self.status()?.is_in_transaction {
            return Err(ConnectError::Command(self.refusal_text(CommandError::TransactionOpen)?));
        }
        // Refused, it was sent twice: nothing was open before.
        let effect = self.give_unless(Command::Begin, CommandError::TransactionOpen)?;
        self.outcome("a transaction is open: `commit` puts in force what it changes".to_owned(), &effect)
    }

    /// Puts the next scheme in force, between two ticks.
    ///
    /// # Errors
    /// [`ConnectError::Command`] when it is refused, with all of its faults: the other scheme runs on, and the transaction
    /// stays open. [`ConnectError::Line`] when the device does not answer.
    pub fn commit(&mut self) -> Result<CommandOutcome, ConnectError> {
        self.is_open()?;
        if self.status()?.is_running {
            // In a tick of its own: none has to check the scheme and to exchange it, too.
            self.give(Command::Check)?;
        }
        let effect = self.give_unless(Command::Commit, CommandError::NoTransaction)?;
        self.outcome("the next scheme is in force".to_owned(), &effect)
    }

    /// Drops the next scheme.
    ///
    /// # Errors
    /// [`ConnectError::Command`] when no transaction is open. [`ConnectError::Line`] when the device does not answer.
    pub fn abort(&mut self) -> Result<CommandOutcome, ConnectError> {
        self.is_open()?;
        let effect = self.give_unless(Command::Abort, CommandError::NoTransaction)?;
        self.outcome("the next scheme is dropped, nothing has changed".to_owned(), &effect)
    }

    fn is_open(&mut self) -> Result<(), ConnectError> {
        match self.status()?.is_in_transaction {
            true => Ok(()),
            false => Err(ConnectError::Command(self.refusal_text(CommandError::NoTransaction)?)),
        }
    }
}
