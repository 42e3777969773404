//! Transactions on the device: the pending scheme is changed while the running scheme continues.

use std::io::{Read, Write};

use dimsart_core::{Command, CommandError};

use super::{CommandOutcome, ConnectError, Device};

impl<S: Read + Write> Device<S> {
    /// Opens a transaction: from now on changes by any client apply to the pending scheme.
    ///
    /// # Errors
    /// [`ConnectError::Command`] when a transaction is open. [`ConnectError::Line`] when the device does not answer.
    pub fn begin(&mut self) -> Result<CommandOutcome, ConnectError> {
        if self.status()?.is_in_transaction {
            return Err(ConnectError::Command(self.refusal_text(CommandError::TransactionOpen)?));
        }
        // A refusal means that the request was sent twice: no transaction was open before.
        let effect = self.give_unless(Command::Begin, CommandError::TransactionOpen)?;
        self.outcome("transaction open: run `commit` to apply its changes".to_owned(), &effect)
    }

    /// Applies the pending scheme between two ticks.
    ///
    /// # Errors
    /// [`ConnectError::Command`] when it is refused, with all of its faults: the running scheme continues, and the
    /// transaction stays open. [`ConnectError::Line`] when the device does not answer.
    pub fn commit(&mut self) -> Result<CommandOutcome, ConnectError> {
        self.is_open()?;
        if self.status()?.is_running {
            // In a separate tick, so that no tick both checks and exchanges the scheme.
            self.give(Command::Check)?;
        }
        let effect = self.give_unless(Command::Commit, CommandError::NoTransaction)?;
        self.outcome("the pending scheme is applied".to_owned(), &effect)
    }

    /// Discards the pending scheme.
    ///
    /// # Errors
    /// [`ConnectError::Command`] when no transaction is open. [`ConnectError::Line`] when the device does not answer.
    pub fn abort(&mut self) -> Result<CommandOutcome, ConnectError> {
        self.is_open()?;
        let effect = self.give_unless(Command::Abort, CommandError::NoTransaction)?;
        self.outcome("the pending scheme is discarded, nothing has changed".to_owned(), &effect)
    }

    fn is_open(&mut self) -> Result<(), ConnectError> {
        match self.status()?.is_in_transaction {
            true => Ok(()),
            false => Err(ConnectError::Command(self.refusal_text(CommandError::NoTransaction)?)),
        }
    }
}
