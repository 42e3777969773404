//! Why a device was not asked, or not told, what it was meant to be.

use dimsart_core::protocol::Refusal;

use super::{LineError, PortError};
use crate::schemes::SchemeFileError;

/// What went wrong between a user and a device.
#[derive(Debug, thiserror::Error)]
pub enum ConnectError {
    /// The port does not open.
    #[error(transparent)]
    Port(#[from] PortError),
    /// No answer.
    #[error(transparent)]
    Line(#[from] LineError),
    /// The device refused a question.
    #[error("{0}")]
    Refused(Refusal),
    /// Undamaged, and no answer to what was asked.
    #[error("the device answered something else than was asked: is its image of another version?")]
    OtherAnswer,
    /// A word that the device does not know, or none of those it takes.
    #[error("{message}")]
    Word {
        /// Which word of a scheme's row it is: 1 module, 2 command, 3 value.
        index: usize,
        /// What is wrong with it and what is right.
        message: String,
    },
    /// A command was understood and refused; nothing has changed.
    #[error("refused: {0}")]
    Command(String),
    /// The scheme cannot be read.
    #[error(transparent)]
    SchemeFile(#[from] SchemeFileError),
    /// A row of a scheme; the rows before it have been carried out, and none after it.
    #[error("{name}:{row}:{column}: {message}; the rows above it are in force{hint}")]
    Row {
        /// The scheme.
        name: String,
        /// Row, from 1.
        row: usize,
        /// Column, from 1.
        column: usize,
        /// What is wrong.
        message: String,
        /// What else may help; starts with its own separator.
        hint: String,
    },
}
