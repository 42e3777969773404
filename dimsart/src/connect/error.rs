//! Why a device was not asked, or not told, what it was meant to be.

use dimsart_link::protocol::{IdentificationFailure, PROTOCOL_VERSION, Refusal};

use hil_sim::link::PortError;

use super::LineError;
use hil_sim::schemes::SchemeFileError;

/// What went wrong between a user and a device.
#[derive(Debug, thiserror::Error)]
pub enum ConnectError {
    /// The port does not open.
    #[error(transparent)]
    Port(#[from] PortError),
    /// No answer.
    #[error(transparent)]
    Line(#[from] LineError),
    /// A device of a protocol version that is not understood any more.
    #[error(
        "the device speaks protocol {0} and this command {PROTOCOL_VERSION}: use the `dimsart` that its image was built \
         with, or flash an image of this version, `cargo xtask flash BOARD`"
    )]
    TooOld(u16),
    /// What would change a device of a newer protocol version, which is only looked at.
    #[error(
        "it speaks protocol {0}, this program {PROTOCOL_VERSION}: look only, nothing has changed; update the program, \
         that is, use the `dimsart` that its image was built with"
    )]
    LookOnly(u16),
    /// The device refused a question.
    #[error("{0}")]
    Refused(Refusal),
    /// There is no lease to be had.
    #[error("the device moves without a lease: `check` lets the scheme run, `stop` stops it")]
    NoLease,
    /// The lease was held and is over.
    #[error(
        "no answer to the renewals of the lease in time: it is over, and the device gets its safe input; the line loses \
         bytes, or the device has too little time for it"
    )]
    LeaseOver,
    /// The one for whom the lease was held is gone.
    #[error(
        "nobody was there for half a second: the lease is renewed no more, and the device gets its safe input"
    )]
    NobodyThere,
    /// An image without authentication, or an older one.
    #[error(
        "this image has no authentication; flash the `auth` variant, such as `cargo xtask flash nucleo-g474re,auth`"
    )]
    NoKeys,
    /// An image without laws, or an older one.
    #[error(
        "this image takes no laws: flash the `online` variant, such as `cargo xtask flash nucleo-g474re,online`"
    )]
    NoLaws,
    /// A board without a drive, or an older image.
    #[error("this board has no drive whose motor could be configured, or its image is an older one")]
    NoDrive,
    /// A configuration that is not understood.
    #[error(
        "the board's configuration has layout {0}, which this program does not know: use the `dimsart` that its image was built with"
    )]
    MotorLayout(u16),
    /// The board has found out nothing about its motor.
    #[error("{0}")]
    Identification(IdentificationFailure),
    /// The system gives no random numbers.
    #[error("the system gives no random number, which the device's nonces would begin with: {0}")]
    NoRandomness(String),
    /// A list of the device goes on beyond all that a device can have.
    #[error("a list of the device has no end: flash an image of this version, `cargo xtask flash BOARD`")]
    EndlessList,
    /// Undamaged, and no answer to what was asked.
    #[error("the device answered something else than was asked: is its image of another version?")]
    OtherAnswer,
    /// A word that the device does not know, or none of those it takes.
    #[error("{0}")]
    Word(String),
    /// A command was understood and refused; nothing has changed.
    #[error("refused: {0}")]
    Command(String),
    /// The scheme cannot be read.
    #[error(transparent)]
    SchemeFile(#[from] SchemeFileError),
    /// A row of a scheme, of which no row is in force then.
    #[error("{name}:{row}:{column}: {message}; nothing has changed{hint}")]
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
