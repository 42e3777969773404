//! Excitation of a reference of a live rig, for identification: added to the held value, for a limited time.

use std::str::FromStr;

use crate::motion::Motion;
use crate::rig_file::{Chirp, MoveSection, Prbs};

/// Requested state of a reference or a hand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Held {
    /// Returns it to the experiment.
    Released,
    /// Holds it at a value.
    At(f32),
    /// Moves it to a value at limited speed, and holds it there.
    GoTo(f32),
    /// Excites it around its present value, then releases it. Not for a hand.
    Excited(Excitation),
}

/// A waveform, such as `chirp 0.5 0.1 2.5 30` (amplitude, first and last frequency in Hz, duration in s) or
/// `prbs 0.1 0.02 20` (amplitude, duration of a bit in s, duration in s).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Excitation {
    /// Sine with a frequency that increases at a constant rate.
    Chirp {
        /// Amplitude, in the unit of the reference.
        amplitude: f64,
        /// First frequency, `Hz`.
        from_hz: f64,
        /// Last frequency, `Hz`.
        to_hz: f64,
        /// Duration, `s`.
        duration_s: f64,
    },
    /// Pseudo-random binary sequence.
    Prbs {
        /// Amplitude, in the unit of the reference.
        amplitude: f64,
        /// Duration of a bit, `s`.
        bit_s: f64,
        /// Duration, `s`.
        duration_s: f64,
    },
}

/// Maximum duration, `s`.
const MAX_S: f64 = 60.0;
/// Maximum frequency, `Hz`, and minimum duration of a bit, `s`.
const MAX_HZ: f64 = 500.0;
const MIN_BIT_S: f64 = 0.001;
/// Maximum amplitude, `rad` or `m`.
const MAX_AMPLITUDE: f64 = 10.0;

impl FromStr for Excitation {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut words = text.split_whitespace();
        let kind = words.next().unwrap_or_default();
        let numbers: Result<Vec<f64>, _> = words.map(str::parse).collect();
        let numbers = numbers.map_err(|_| "invalid excitation: not a number".to_owned())?;
        let excitation = match (kind, numbers.as_slice()) {
            ("chirp", &[amplitude, from_hz, to_hz, duration_s]) => {
                Self::Chirp { amplitude, from_hz, to_hz, duration_s }
            }
            ("prbs", &[amplitude, bit_s, duration_s]) => Self::Prbs { amplitude, bit_s, duration_s },
            _ => {
                return Err("invalid excitation: give `chirp AMPLITUDE FROM_HZ TO_HZ DURATION_S` or \
                            `prbs AMPLITUDE BIT_S DURATION_S`"
                    .to_owned());
            }
        };
        let (amplitude, duration_s) = (excitation.amplitude(), excitation.duration_s());
        let within = |name: &str, value: f64, min: f64, max: f64| match (min..=max).contains(&value) {
            true => Ok(()),
            false => Err(format!("{name} {value} is out of range: give {min} to {max}")),
        };
        within("amplitude", amplitude, 1e-9, MAX_AMPLITUDE)?;
        within("duration", duration_s, 0.1, MAX_S)?;
        match excitation {
            Self::Chirp { from_hz, to_hz, .. } => {
                within("first frequency", from_hz, 0.01, MAX_HZ)?;
                within("last frequency", to_hz, 0.01, MAX_HZ)?;
            }
            Self::Prbs { bit_s, .. } => within("duration of a bit", bit_s, MIN_BIT_S, duration_s)?,
        }
        Ok(excitation)
    }
}

impl Excitation {
    const fn amplitude(self) -> f64 {
        match self {
            Self::Chirp { amplitude, .. } | Self::Prbs { amplitude, .. } => amplitude,
        }
    }

    pub(super) const fn duration_s(self) -> f64 {
        match self {
            Self::Chirp { duration_s, .. } | Self::Prbs { duration_s, .. } => duration_s,
        }
    }

    /// Returns the waveform that starts at time 0.
    pub(super) fn motion(self) -> Option<Motion> {
        let section = match self {
            Self::Chirp { amplitude, from_hz, to_hz, duration_s } => MoveSection {
                chirp: Some(Chirp { at_s: 0.0, until_s: duration_s, amplitude, from_hz, to_hz }),
                ..MoveSection::nothing("", "")
            },
            Self::Prbs { amplitude, bit_s, duration_s } => MoveSection {
                prbs: Some(Prbs { at_s: 0.0, until_s: duration_s, amplitude, bit_s }),
                ..MoveSection::nothing("", "")
            },
        };
        // Only samples are read from a file.
        Motion::new(&section, "".as_ref()).ok().flatten()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_excitation_is_read_and_checked() {
        let chirp: Excitation = "chirp 0.5 0.1 2.5 30".parse().unwrap();
        assert_eq!(chirp, Excitation::Chirp { amplitude: 0.5, from_hz: 0.1, to_hz: 2.5, duration_s: 30.0 });
        assert!(chirp.motion().unwrap().at(0.0).abs() < 1e-12);
        let prbs: Excitation = "prbs 0.1 0.02 20".parse().unwrap();
        assert!((prbs.motion().unwrap().at(1.0).abs() - 0.1).abs() < 1e-12);
        for (text, reason) in [
            ("chirp 0.5 0.1 2.5", "give `chirp"),
            ("chirp x 0.1 2.5 30", "not a number"),
            ("chirp 0.5 0.1 2.5 3000", "duration 3000 is out of range: give 0.1 to 60"),
            ("chirp NaN 0.1 2.5 30", "amplitude NaN is out of range"),
            ("prbs 0.1 0 20", "duration of a bit 0 is out of range"),
            ("", "give `chirp"),
        ] {
            let error = text.parse::<Excitation>().unwrap_err();
            assert!(error.contains(reason), "{text}: {error}");
        }
    }
}
