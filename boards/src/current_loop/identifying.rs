//! Lock-free exchange of identification requests and results between the command task and the current loop,
//! with atomics only. The loop can interrupt the task, but not the reverse.

use core::sync::atomic::Ordering::{Acquire, Relaxed, Release};
use core::sync::atomic::{AtomicU32, compiler_fence};

use dimsart_link::protocol::{Identification, IdentificationFailure, IdentifiedMotor};

/// No request.
const NOTHING: u32 = 0;

/// States. After these: failures by index in [`FAILURES`], then drive faults by reason number; for
/// insufficient current, the required current is in the upper half.
const NONE: u32 = 0;
const UNDER_WAY: u32 = 1;
const FOUND: u32 = 2;
const FAILED: u32 = 3;
const DRIVE: u32 = 0x100;
const FAILURES: [IdentificationFailure; 5] = [
    IdentificationFailure::Ended,
    IdentificationFailure::SupplyTooLow,
    IdentificationFailure::PhaseMismatch,
    IdentificationFailure::DidNotMove,
    IdentificationFailure::Slipped,
];

/// The exchange between a requester and a current loop.
#[derive(Debug, Default)]
pub struct IdentificationMailbox {
    asked_a: AtomicU32,
    state: AtomicU32,
    found: [AtomicU32; 5],
}

impl IdentificationMailbox {
    /// Creates an exchange without a request.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            asked_a: AtomicU32::new(NOTHING),
            state: AtomicU32::new(NONE),
            found: [const { AtomicU32::new(0) }; 5],
        }
    }

    /// Requests an identification with a current above 0, `A`.
    pub fn request(&self, current_a: f32) {
        self.state.store(UNDER_WAY, Relaxed);
        compiler_fence(Release);
        self.asked_a.store(current_a.to_bits(), Relaxed);
    }

    /// Returns whether an identification is requested.
    #[inline]
    #[must_use]
    pub fn is_requested(&self) -> bool {
        self.asked_a.load(Relaxed) != NOTHING
    }

    /// Takes the request; returns its current.
    pub fn take_request(&self) -> f32 {
        let asked_a = f32::from_bits(self.asked_a.load(Relaxed));
        self.asked_a.store(NOTHING, Relaxed);
        asked_a
    }

    /// Publishes the result.
    pub fn publish(&self, end: Identification) {
        let state = match end {
            Identification::Found(motor) => {
                let poles = u32::from(motor.pole_pairs) | u32::from(motor.is_encoder_reversed) << 8;
                let words = [
                    motor.resistance_ohm.to_bits(),
                    motor.direct_inductance_h.to_bits(),
                    motor.quadrature_inductance_h.to_bits(),
                    poles,
                    motor.encoder_offset_rad.to_bits(),
                ];
                for (cell, word) in self.found.iter().zip(words) {
                    cell.store(word, Relaxed);
                }
                FOUND
            }
            Identification::Failed(IdentificationFailure::Drive(number)) => DRIVE | u32::from(number),
            Identification::Failed(IdentificationFailure::TooLittleCurrent(tenths)) => {
                u32::from(tenths) << 16
            }
            Identification::Failed(failure) => (FAILED..)
                .zip(FAILURES)
                .find(|(_, known)| *known == failure)
                .map_or(FAILED, |(state, _)| state),
            _ => return,
        };
        self.state.store(state, Release);
    }

    /// Returns the state.
    #[must_use]
    pub fn state(&self) -> Identification {
        let state = self.state.load(Acquire);
        let [resistance, direct, quadrature, poles, offset] =
            self.found.each_ref().map(|cell| cell.load(Relaxed));
        let [pole_pairs, is_encoder_reversed, ..] = poles.to_le_bytes();
        match state {
            NONE => Identification::None,
            UNDER_WAY => Identification::Running,
            FOUND => Identification::Found(IdentifiedMotor {
                resistance_ohm: f32::from_bits(resistance),
                direct_inductance_h: f32::from_bits(direct),
                quadrature_inductance_h: f32::from_bits(quadrature),
                pole_pairs,
                is_encoder_reversed: is_encoder_reversed != 0,
                encoder_offset_rad: f32::from_bits(offset),
            }),
            state if state >> 16 != 0 => {
                Identification::Failed(IdentificationFailure::TooLittleCurrent((state >> 16) as u16))
            }
            state => {
                let [number, ..] = state.to_le_bytes();
                let known = (FAILED..).zip(FAILURES).find(|(known, _)| *known == state);
                Identification::Failed(
                    known.map_or(IdentificationFailure::Drive(number), |(_, failure)| failure),
                )
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_told_comes_through() {
        let identifying = IdentificationMailbox::new();
        assert_eq!(identifying.state(), Identification::None);
        let motor = IdentifiedMotor {
            resistance_ohm: 0.6,
            direct_inductance_h: 1e-4,
            quadrature_inductance_h: 2e-4,
            pole_pairs: 7,
            is_encoder_reversed: true,
            encoder_offset_rad: -1.0,
        };
        let failures = FAILURES
            .into_iter()
            .chain([IdentificationFailure::Drive(57), IdentificationFailure::TooLittleCurrent(u16::MAX)]);
        for end in failures.map(Identification::Failed).chain([Identification::Found(motor)]) {
            identifying.request(2.5);
            assert!(identifying.is_requested());
            assert_eq!(identifying.state(), Identification::Running);
            assert_eq!(identifying.take_request().to_bits(), 2.5_f32.to_bits());
            assert!(!identifying.is_requested());
            identifying.publish(end);
            assert_eq!(identifying.state(), end);
        }
    }
}
