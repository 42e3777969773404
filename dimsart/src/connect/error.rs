//! Errors of requests and commands to a device.

use dimsart_link::protocol::{IdentificationFailure, PROTOCOL_VERSION, Refusal};

use hil_sim::link::PortError;

use super::LineError;
use hil_sim::schemes::SchemeFileError;

/// Error of a request or command to a device.
#[derive(Debug, thiserror::Error)]
pub enum ConnectError {
    /// The port cannot be opened.
    #[error(transparent)]
    Port(#[from] PortError),
    /// No answer.
    #[error(transparent)]
    Line(#[from] LineError),
    /// The protocol version of the device is too old.
    #[error(
        "protocol version mismatch: device {0}, this command {PROTOCOL_VERSION}; use the `dimsart` of the image's \
         version, or flash a current image: `cargo xtask flash BOARD`"
    )]
    TooOld(u16),
    /// A device of a newer protocol version is read-only.
    #[error(
        "read-only, nothing has changed: the device has protocol version {0}, this program {PROTOCOL_VERSION}; use the \
         `dimsart` of the image's version"
    )]
    ReadOnly(u16),
    /// The device refused the request.
    #[error("{0}")]
    Refused(Refusal),
    /// The device has no lease.
    #[error("the device needs no lease: `check` starts the scheme, `stop` stops it")]
    NoLease,
    /// The lease expired.
    #[error(
        "lease expired, outputs at their safe value: the device did not answer lease renewals in time; check the line \
         for lost bytes, and the device for overload"
    )]
    LeaseExpired,
    /// The remote user of the lease is silent or has left.
    #[error("client silent for 0.5 s: lease released, outputs at their safe value")]
    ClientSilent,
    /// The image has no authentication.
    #[error(
        "this image has no authentication; flash the `auth` variant, such as `cargo xtask flash nucleo-g474re,auth`"
    )]
    NoKeys,
    /// The image cannot load laws.
    #[error(
        "this image cannot load laws: flash the `online` variant, such as `cargo xtask flash nucleo-g474re,online`"
    )]
    NoLaws,
    /// The board has no drive, or its image is too old.
    #[error(
        "this board has no configurable motor drive, or an old image: flash a current image, `cargo xtask flash \
         BOARD`"
    )]
    NoDrive,
    /// The layout of the configuration is unknown.
    #[error(
        "unknown layout {0} of the board's motor configuration: use the `dimsart` of the image's version"
    )]
    MotorLayout(u16),
    /// The board could not identify its motor.
    #[error("{0}")]
    Identification(IdentificationFailure),
    /// The system has no random numbers.
    #[error("cannot create a nonce, the system's random number generator failed: {0}")]
    NoRandomness(String),
    /// A list of the device exceeds its maximum length.
    #[error(
        "the device sent a list that exceeds the maximum length: flash an image of this version, `cargo xtask flash \
         BOARD`"
    )]
    ListTooLong,
    /// The answer does not fit the request.
    #[error("unexpected answer from the device: use a `dimsart` and an image of the same version")]
    UnexpectedAnswer,
    /// An unknown name or an invalid value.
    #[error("{0}")]
    InvalidWord(String),
    /// The device refused the command; nothing has changed.
    #[error("refused: {0}")]
    Command(String),
    /// The scheme cannot be read.
    #[error(transparent)]
    SchemeFile(#[from] SchemeFileError),
    /// An invalid row of a scheme; no row is applied.
    #[error("{name}:{row}:{column}: {message}; nothing has changed{hint}")]
    InvalidRow {
        /// The scheme.
        name: String,
        /// Row, from 1.
        row: usize,
        /// Column, from 1.
        column: usize,
        /// Description of the error.
        message: String,
        /// A hint; starts with its separator.
        hint: String,
    },
}
