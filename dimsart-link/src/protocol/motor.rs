//! The motor of a board that has a drive: a configuration that it keeps, and what it finds out about its motor.
//!
//! ```text
//! put, put, ... ──keep──▶ kept: read by the next start, checked again    forget: the next start takes the image's
//! identify, under the lease ──▶ under way ──▶ found, or failed
//! ```
//! What the words mean is the drive's and its host's matter: they have a layout number.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use dimsart_core::Reason;
use dimsart_core::checksum::CRC;

/// Most words of a configuration.
pub const MAX_MOTOR_WORDS: usize = 32;

/// Words of a configuration.
pub type MotorWords = Vec<u32, MAX_MOTOR_WORDS>;

/// What is wanted of a board's motor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum MotorAction {
    /// What the motor is run by; answered, as the next three, by a [`MotorReport`].
    Look,
    /// A word of the configuration that is to be kept.
    Put {
        /// Its place, below [`MAX_MOTOR_WORDS`].
        place: u8,
        /// The word.
        word: u32,
    },
    /// Keeps what was put: the next start runs the motor by it. Refused while motion is allowed.
    Keep {
        /// What the words mean.
        layout: u16,
        /// How many they are.
        count: u8,
        /// Their [`motor_checksum`].
        checksum: u32,
    },
    /// Keeps nothing: the next start runs the motor by the image's configuration. Refused while motion is allowed.
    Forget,
    /// Has the scheme that runs give the motor over, until motion ends: the motor is turned and what it is found out, under
    /// the client's lease. Answered, as the next one, by an [`Identification`].
    Identify {
        /// Peak of a phase, `A`, > 0; no more than the configuration's limit is made.
        current_a: f32,
    },
    /// How the identification stands.
    Found,
}

/// What a board's motor is run by.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct MotorReport {
    /// What the words mean.
    pub layout: u16,
    /// Whether they were kept, and are not the image's.
    pub is_kept: bool,
    /// Why what is kept was not taken, or may not be the newest, if so.
    pub fallback: Option<MotorFallback>,
    /// Whether something else was kept, or forgotten, since: the next start takes that.
    pub waits: bool,
    /// The configuration.
    pub words: MotorWords,
}

/// Why a start did not take the configuration that is kept, or may have taken an old one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum MotorFallback {
    /// It cannot be read.
    Storage,
    /// It has another layout than the image knows.
    Layout,
    /// A value is out of its range, or not for this board.
    Value,
    /// A damaged entry of the storage may be a newer configuration; a kept one that is valid is taken all the same.
    Damaged,
}

/// How an identification stands.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Identification {
    /// There was none since the start.
    #[default]
    None,
    /// It goes on.
    UnderWay,
    /// It has found the motor.
    Found(FoundMotor),
    /// It has found nothing.
    Failed(IdentificationFailure),
}

/// What was found of a motor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FoundMotor {
    /// Of a phase, `ohm`.
    pub resistance_ohm: f32,
    /// Along the magnets, `H`.
    pub direct_inductance_h: f32,
    /// Across them, `H`.
    pub quadrature_inductance_h: f32,
    /// Pairs of poles.
    pub pole_pairs: u8,
    /// Whether the encoder counts down when the phases turn the rotor up.
    pub is_encoder_reversed: bool,
    /// Angle that the encoder shows where the magnets point along phase U, `rad`.
    pub encoder_offset_rad: f32,
}

/// Why nothing was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum IdentificationFailure {
    /// Motion was not allowed any more.
    Ended,
    /// The supply's voltage makes no such current.
    NoCurrent,
    /// The currents are not where the voltage is.
    WrongPhases,
    /// The rotor did not turn.
    DidNotMove,
    /// It turned, and not as a whole number of pole pairs does.
    Slipped,
    /// What turns off the drive, too: the number of a [`Reason`](dimsart_core::Reason).
    Drive(u8),
    /// Dead time, or the rotor's own voltage, changes so small a current by over a quarter: at least this one is needed, in
    /// 0.1 A.
    TooLittleCurrent(u16),
}

impl core::fmt::Display for IdentificationFailure {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Ended => f.write_str("motion ended before it was done: the scheme was stopped, or the lease is over"),
            Self::NoCurrent => {
                f.write_str("the supply makes no such current: look at the motor's wires, or ask for less")
            }
            Self::WrongPhases => f.write_str(
                "the currents are not where the voltage is: a phase is open, or the wires or signs of the current sensors \
                 are swapped",
            ),
            Self::TooLittleCurrent(tenths) => write!(
                f,
                "too little current: dead time and the rotor's motion change it by over a \
                 quarter; request at least {}.{} A, and set limits.current_a at least as high",
                tenths / 10,
                tenths % 10
            ),
            Self::DidNotMove => f.write_str(
                "the rotor did not turn: take its load off or ask for more current; is the encoder on this motor?",
            ),
            Self::Slipped => f.write_str(
                "the rotor turned as no whole number of pole pairs does: take its load off or ask for more current",
            ),
            Self::Drive(number) => match Reason::by_number(*number) {
                Some(reason) => write!(f, "{reason}"),
                None => write!(f, "reason {number}, unknown to this version"),
            },
        }
    }
}

impl core::error::Error for IdentificationFailure {}

/// Why nothing was done to a board's motor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum MotorRefusal {
    /// Motion is allowed: somebody holds the lease.
    InUse,
    /// What was put is not what is to be kept.
    Incomplete,
    /// The board would not take it at its next start.
    NotTaken(MotorFallback),
    /// No scheme runs that could give the motor over.
    NothingRuns,
    /// No current that can be made.
    Current,
}

impl core::fmt::Display for MotorRefusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::InUse => "a motor's configuration is changed at rest: let whoever armed the board end that",
            Self::Incomplete => "not all of the configuration has come: do it again",
            Self::NotTaken(MotorFallback::Layout) => {
                "the board knows another layout of configurations: use the `dimsart` that its image was built with"
            }
            Self::NotTaken(_) => "a value is out of its range, or not for this board, such as an encoder that it does not read",
            Self::NothingRuns => "no scheme runs that could give the motor over: `check` lets it run",
            Self::Current => "it has to be a current above 0",
        })
    }
}

impl core::error::Error for MotorRefusal {}

/// By which a board knows that it has all words of a configuration.
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
