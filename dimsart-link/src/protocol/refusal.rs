//! Reasons for refusing a request.

use serde::{Deserialize, Serialize};

use super::key::KeyRefusal;
use super::motor::MotorRefusal;
use super::schemes::StoreError;
use dimsart_core::{CommandError, SafetyReason, TooManyChoices};

/// Why a request was refused.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Refusal {
    /// Unknown request.
    Unsupported,
    /// No item has this index or number; the end of a list.
    NotFound,
    /// The response does not fit a frame.
    TooLong,
    /// Refused by the engine.
    Engine(CommandError),
    /// Refused by the scheme storage.
    Store(StoreError),
    /// The request needs the lease, or another client holds it.
    Lease {
        /// The client that holds it, 0 if it is free.
        holder: u8,
    },
    /// Another client receives the telemetry.
    Telemetry {
        /// That client.
        client: u8,
    },
    /// Refused because of the board's key.
    Key(KeyRefusal),
    /// A fault is latched; motion needs a reset. Contains the number of a [`SafetyReason`].
    Fault(u8),
    /// Refused by the board's motor.
    Motor(MotorRefusal),
}

impl From<TooManyChoices> for Refusal {
    fn from(_: TooManyChoices) -> Self {
        Self::TooLong
    }
}

impl core::fmt::Display for Refusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Unsupported => write!(
                f,
                "unknown request: the device uses another protocol version. \
                 Flash an image of this version, or use the `dimsart` that the device's image was built with"
            ),
            Self::NotFound => write!(f, "the device has no entry with this index"),
            Self::TooLong => write!(f, "the response does not fit a frame: shorten the texts in the image"),
            Self::Engine(error) => error.fmt(f),
            Self::Store(error) => error.fmt(f),
            Self::Key(refusal) => refusal.fmt(f),
            Self::Motor(refusal) => refusal.fmt(f),
            Self::Lease { holder: 0 } => {
                write!(
                    f,
                    "STOP, a fault or a timeout ended the lease, and the outputs moved to their safe values: `arm` again"
                )
            }
            Self::Lease { holder } => {
                write!(
                    f,
                    "client {holder} holds the lease; other clients can only read and stop: \
                     disarm that client, or `stop` the scheme"
                )
            }
            Self::Fault(number) => {
                let name = SafetyReason::from_number(*number).map_or("unknown reason", SafetyReason::name);
                write!(f, "fault latched ({name}): remove the cause (see `faults`), then `reset`")
            }
            Self::Telemetry { client } => {
                write!(f, "client {client} already receives the telemetry: poll the signals instead")
            }
        }
    }
}

impl core::error::Error for Refusal {}
