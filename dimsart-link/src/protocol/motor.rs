//! The motor of a board with a drive: its stored configuration and its identification.
//!
//! ```text
//! put, put, ... ──keep──▶ stored: checked and used from the next start    forget: back to the image's configuration
//! identify, with the lease ──▶ in progress ──▶ found, or failed
//! ```
//! Only the drive and its host interpret the words, by a layout number.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use dimsart_core::SafetyReason;
use dimsart_core::checksum::CRC;

/// Maximum number of words in a configuration.
pub const MAX_MOTOR_WORDS: usize = 32;

/// Words of a configuration.
pub type MotorWords = Vec<u32, MAX_MOTOR_WORDS>;

/// Requests about a board's motor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum MotorAction {
    /// Reads the active configuration. This request and the next three are answered by a [`MotorReport`].
    Read,
    /// Transfers one word of a configuration.
    PutWord {
        /// Its index, below [`MAX_MOTOR_WORDS`].
        place: u8,
        /// The word.
        word: u32,
    },
    /// Stores the transferred words; the next start uses them. Refused while armed.
    Store {
        /// Layout of the words.
        layout: u16,
        /// Number of words.
        count: u8,
        /// Their [`motor_checksum`].
        checksum: u32,
    },
    /// Deletes the stored configuration; the next start uses the image's. Refused while armed.
    Delete,
    /// Identifies the motor, instead of running the scheme, until motion ends: turns the motor under the
    /// client's lease. This request and the next one are answered by an [`Identification`].
    Identify {
        /// Peak phase current, `A`, > 0; limited by the configuration.
        current_a: f32,
    },
    /// Reads the state of the identification.
    ReadIdentification,
}

/// The active motor configuration of a board.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct MotorReport {
    /// Layout of the words.
    pub layout: u16,
    /// Whether the words were stored, rather than the image's.
    pub is_stored: bool,
    /// Why the stored configuration is not in use, or may be outdated.
    pub fallback: Option<MotorFallback>,
    /// Whether the next start uses a different configuration.
    pub is_restart_pending: bool,
    /// The configuration.
    pub words: MotorWords,
}

/// Reasons why a start did not use the stored configuration, or may have used an old one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum MotorFallback {
    /// The storage cannot be read.
    Storage,
    /// Unknown layout.
    Layout,
    /// A value is out of range, or not supported by this board.
    Value,
    /// A corrupt entry of the storage may be a newer configuration; the last valid one is used.
    Damaged,
}

/// State of an identification.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Identification {
    /// None since the start.
    #[default]
    None,
    /// In progress.
    Running,
    /// Completed.
    Found(IdentifiedMotor),
    /// Failed.
    Failed(IdentificationFailure),
}

/// Identified motor data.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct IdentifiedMotor {
    /// Phase resistance, `ohm`.
    pub resistance_ohm: f32,
    /// d-axis inductance, `H`.
    pub direct_inductance_h: f32,
    /// q-axis inductance, `H`.
    pub quadrature_inductance_h: f32,
    /// Pole pairs.
    pub pole_pairs: u8,
    /// Whether the encoder counts down when the phase sequence turns the rotor up.
    pub is_encoder_reversed: bool,
    /// Encoder angle at which the d axis is aligned with phase U, `rad`.
    pub encoder_offset_rad: f32,
}

/// Reasons why an identification failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum IdentificationFailure {
    /// Motion was disabled.
    Ended,
    /// The supply voltage is too low for this current.
    SupplyTooLow,
    /// Current and voltage vectors have different directions.
    PhaseMismatch,
    /// The rotor did not turn.
    DidNotMove,
    /// The rotation does not match a whole number of pole pairs.
    Slipped,
    /// Fault of the drive: the number of a [`SafetyReason`](dimsart_core::SafetyReason).
    Drive(u8),
    /// Dead time or back-EMF changes the current by more than a quarter. Contains the minimum current, in 0.1
    /// A.
    TooLittleCurrent(u16),
}

impl core::fmt::Display for IdentificationFailure {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Ended => f.write_str(
                "the identification ended early, because the scheme was stopped or the lease ended: start it again",
            ),
            Self::SupplyTooLow => {
                f.write_str("the supply cannot drive this current: check the motor's wires, or request a lower current")
            }
            Self::PhaseMismatch => f.write_str(
                "the current does not follow the voltage: check for an open phase, and for swapped wires or \
                 signs of the current sensors",
            ),
            Self::TooLittleCurrent(tenths) => write!(
                f,
                "the current is too low: dead time and back-EMF change it by more than a \
                 quarter; request at least {}.{} A, and set limits.current_a to this value or above",
                tenths / 10,
                tenths % 10
            ),
            Self::DidNotMove => f.write_str(
                "the rotor did not turn: remove the load or request a higher current; \
                 check that the encoder is on this motor",
            ),
            Self::Slipped => f.write_str(
                "the measured rotation does not match a whole number of pole pairs: \
                 remove the load or request a higher current",
            ),
            Self::Drive(number) => match SafetyReason::from_number(*number) {
                Some(reason) => write!(f, "{reason}"),
                None => write!(f, "unknown drive fault {number}"),
            },
        }
    }
}

impl core::error::Error for IdentificationFailure {}

/// Reasons for refusing a motor request.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum MotorRefusal {
    /// A client holds the lease.
    InUse,
    /// The transferred words are incomplete.
    Incomplete,
    /// The board would reject it at the next start.
    Invalid(MotorFallback),
    /// No scheme runs.
    NotRunning,
    /// Invalid current.
    Current,
}

impl core::fmt::Display for MotorRefusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::InUse => {
                "the motor configuration can only be changed at rest: disarm the client that holds the lease"
            }
            Self::Incomplete => "the motor configuration arrived incomplete: send it again",
            Self::Invalid(MotorFallback::Layout) => {
                "unknown layout of the motor configuration: use the `dimsart` that the image was built with"
            }
            Self::Invalid(_) => {
                "a value of the motor configuration is out of range, or this board does not support it \
                 (for example the encoder type)"
            }
            Self::NotRunning => "identification needs a running scheme: `check` starts the scheme",
            Self::Current => "the identification current must be above 0 A",
        })
    }
}

impl core::error::Error for MotorRefusal {}

/// Computes the checksum by which a board detects missing words of a configuration.
#[must_use]
pub fn motor_checksum(words: &[u32]) -> u32 {
    let mut digest = CRC.digest();
    for word in words {
        digest.update(&word.to_le_bytes());
    }
    digest.finalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_that_is_missing_or_another_one_shows() {
        let words = [1, 2, 0x8000_0000, 0];
        let right = motor_checksum(&words);
        for place in 0..words.len() {
            let mut wrong = words;
            wrong[place] ^= 1;
            assert_ne!(motor_checksum(&wrong), right);
        }
        assert_ne!(motor_checksum(&words[..3]), right);
    }
}
