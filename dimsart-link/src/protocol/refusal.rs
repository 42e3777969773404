//! Refusals: why a request was not carried out.

use serde::{Deserialize, Serialize};

use super::key::KeyRefusal;
use super::motor::MotorRefusal;
use super::schemes::StoreError;
use dimsart_core::{CommandError, Reason, TooManyChoices};

/// Why a request was refused.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Refusal {
    /// This version knows no such request.
    NotUnderstood,
    /// Nothing has this index or number; a list ends here.
    NotThere,
    /// The answer does not fit a frame.
    TooLong,
    /// The engine refused.
    Engine(CommandError),
    /// Saving or loading of a scheme was refused.
    Store(StoreError),
    /// This client does not hold the lease, and what it asked for needs that, or that nobody else does.
    Lease {
        /// The client that holds it, 0 when nobody does.
        holder: u8,
    },
    /// Another client has the telemetry.
    Telemetry {
        /// The client that has it.
        client: u8,
    },
    /// The board holds a key, or held one.
    Key(KeyRefusal),
    /// Something has failed, and motion waits for a reset. The number is that of a [`Reason`].
    Fault(u8),
    /// Nothing was done to the board's motor.
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
            Self::NotUnderstood => write!(
                f,
                "the device knows no such request, as it speaks another protocol: flash it with an image of this \
                 version, or use the `dimsart` that its image was built with"
            ),
            Self::NotThere => write!(f, "the device has nothing of this number"),
            Self::TooLong => write!(f, "the answer does not fit a frame: shorten the texts in the image"),
            Self::Engine(error) => error.fmt(f),
            Self::Store(error) => error.fmt(f),
            Self::Key(refusal) => refusal.fmt(f),
            Self::Motor(refusal) => refusal.fmt(f),
            Self::Lease { holder: 0 } => {
                write!(
                    f,
                    "the lease was released by STOP, a fault or a timeout, outputs at their safe value: `arm` again"
                )
            }
            Self::Lease { holder } => {
                write!(
                    f,
                    "client {holder} holds the lease, only it may change something: let it give the lease back, or \
                     `stop` the scheme"
                )
            }
            Self::Fault(number) => {
                let name = Reason::by_number(*number).map_or("unknown to this version", Reason::name);
                write!(f, "something has failed ({name}): see to it (`faults` says more), then `reset`")
            }
            Self::Telemetry { client } => {
                write!(f, "the telemetry is sent to client {client}: ask for the signals")
            }
        }
    }
}

impl core::error::Error for Refusal {}
