//! Velocity of each axis, for damping.

use crate::device::DeviceDescriptor;
use crate::limits::MAX_DOF;
use crate::signal::types;
use crate::signal::word::{Scalar as _, Word};

/// The measured velocity if available, otherwise the difference of two positions. A new one is all zero bits.
#[derive(Debug)]
pub(super) struct Velocity {
    source: Source,
    /// Positions of the last tick.
    position: [f32; MAX_DOF],
    /// Whether the last tick measured positions.
    has_position: bool,
}

/// Index of the first axis in a measured frame.
#[derive(Debug, Clone, Copy)]
enum Source {
    None,
    Velocity { place: usize },
    Position { place: usize },
}

impl Velocity {
    /// Velocity source of a device at rest.
    pub(super) const NONE: Self =
        Self { source: Source::None, position: [0.0; MAX_DOF], has_position: false };

    pub(super) fn new(device: &DeviceDescriptor) -> Self {
        let velocity = device.output_place(types::VELOCITY).map(|place| Source::Velocity { place });
        let position = || device.output_place(types::POSITION).map(|place| Source::Position { place });
        Self { source: velocity.or_else(position).unwrap_or(Source::None), ..Self::NONE }
    }

    /// Returns the velocity of an axis, `m/s` or `rad/s`; 0 if unknown.
    pub(super) fn of(&self, axis: usize, measured: &[Word], period_s: f32) -> f32 {
        let word = |place: usize| measured.get(place + axis).map(|word| f32::from_word(*word));
        let velocity = match self.source {
            Source::Velocity { place } => word(place),
            Source::Position { place } if self.has_position => {
                word(place).zip(self.position.get(axis)).map(|(now, last)| (now - last) / period_s)
            }
            _ => None,
        };
        velocity.unwrap_or(0.0)
    }

    /// Stores the positions for the next tick; `measured` is empty if the measurement was refused.
    pub(super) fn keep(&mut self, measured: &[Word]) {
        if let Source::Position { place } = self.source {
            self.has_position = !measured.is_empty();
            for (position, word) in self.position.iter_mut().zip(measured.iter().skip(place)) {
                *position = f32::from_word(*word);
            }
        }
    }
}
