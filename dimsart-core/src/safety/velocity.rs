//! The velocity of each axis, for damping.

use crate::device::DeviceDescriptor;
use crate::limits::MAX_DOF;
use crate::signal::types;
use crate::signal::word::{Scalar as _, Word};

/// Measured where the device does so, otherwise the difference between two ticks' positions. Fresh, it is all zero bits.
#[derive(Debug)]
pub(super) struct Velocity {
    source: Source,
    /// Of the last tick.
    position: [f32; MAX_DOF],
    /// Whether the last tick measured them.
    has_position: bool,
}

/// Where the first axis' word is in a measured frame.
#[derive(Debug, Clone, Copy)]
enum Source {
    None,
    Velocity { place: usize },
    Position { place: usize },
}

impl Velocity {
    /// That of an axis that never moves.
    pub(super) const NONE: Self =
        Self { source: Source::None, position: [0.0; MAX_DOF], has_position: false };

    pub(super) fn new(device: &DeviceDescriptor) -> Self {
        let velocity = device.output_place(types::VELOCITY).map(|place| Source::Velocity { place });
        let position = || device.output_place(types::POSITION).map(|place| Source::Position { place });
        Self { source: velocity.or_else(position).unwrap_or(Source::None), ..Self::NONE }
    }

    /// That of an axis, `m/s` or `rad/s`; 0 when it is not known.
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

    /// Keeps what the next tick's velocity takes; `measured` is empty in a tick whose measurement was refused.
    pub(super) fn keep(&mut self, measured: &[Word]) {
        if let Source::Position { place } = self.source {
            self.has_position = !measured.is_empty();
            for (position, word) in self.position.iter_mut().zip(measured.iter().skip(place)) {
                *position = f32::from_word(*word);
            }
        }
    }
}
