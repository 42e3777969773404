//! A scheme sent row by row.

use std::io::{Read, Write};

use dimsart_core::scheme::{self, Row, SchemeError};
use dimsart_core::{CommandError, protocol::Effect};

use super::words::{COMMAND, MODULE, VALUE};
use super::{ConnectError, Device};
use crate::schemes::{SIDES, SchemeText};

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
            let refused = |row, column, message| ConnectError::Row {
                name: scheme.name.clone(),
                row,
                column,
                message,
                hint: hint.clone(),
            };
            let row = row.map_err(|SchemeError { place, .. }| {
                let message = format!("'{}' is not a side; there is {}, all", place.word, SIDES.join(", "));
                refused(place.line, place.column, message)
            })?;
            match self.send_row(&row) {
                Ok(_) => rows += 1,
                Err((_, error @ (ConnectError::Line(_) | ConnectError::OtherAnswer))) => return Err(error),
                Err((index, error)) => {
                    let column = column(&row, &scheme.text, index);
                    return Err(refused(row.line(), column, error.to_string()));
                }
            }
        }
        let blocked = self.status()?.blocked;
        Ok(Sent { rows, state: self.state_text(blocked)? })
    }

    /// An error comes with the place of the word that it is about.
    fn send_row(&mut self, row: &Row<'_>) -> Result<Effect, (usize, ConnectError)> {
        let surplus = row.word(VALUE + 1);
        if !surplus.is_empty() {
            let message = format!("'{surplus}' is one word too many on this row");
            return Err((VALUE + 1, ConnectError::Word { index: VALUE + 1, message }));
        }
        let words = [MODULE, COMMAND, VALUE].map(|index| row.word(index));
        let command = self.words_to_command(words).map_err(|error| match error {
            ConnectError::Word { index, .. } => (index, error),
            _ => (VALUE, error),
        })?;
        let last = if row.word(VALUE).is_empty() { COMMAND } else { VALUE };
        let effect = self.try_give(command).map_err(|error| (last, error))?;
        match (effect.refused, effect.blocked) {
            (None, _) => Ok(effect),
            // The first fault says more than their number.
            (Some(CommandError::DoesNotMatch { faults }), Some(blocked)) => {
                let first = self.blocked_text(blocked).map_err(|error| (last, error))?;
                let text =
                    format!("the scheme has {faults} fault(s), the first: {first}; `faults` names all");
                Err((last, ConnectError::Command(text)))
            }
            (Some(error), _) => {
                let text = self.refused(command, error).map_err(|error| (last, error))?;
                Err((last, ConnectError::Command(text)))
            }
        }
    }
}

/// Column of a word in its line, from 1; behind the last word for one that is missing.
fn column(row: &Row<'_>, text: &str, index: usize) -> usize {
    let line = text.lines().nth(row.line().saturating_sub(1)).unwrap_or_default();
    let start = |word: &str| word.as_ptr().addr() - line.as_ptr().addr();
    match row.word(index) {
        "" => {
            let last = (0..index).rev().map(|index| row.word(index)).find(|word| !word.is_empty());
            last.map_or(1, |last| start(last) + last.len() + 1)
        }
        word => start(word) + 1,
    }
}
