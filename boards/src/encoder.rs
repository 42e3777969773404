//! The angle of a shaft from the wrapping counter of an incremental encoder.
//!
//! angle = 2 pi / counts per turn · counts since the start

use core::f32::consts::TAU;

/// An incremental encoder on a 16-bit counter.
#[derive(Debug, Clone)]
pub struct Encoder {
    last: u16,
    counts: i64,
    counts_per_turn: u16,
}

impl Encoder {
    /// Creates an encoder at counter value `count` with `counts_per_turn` > 0 (all four edges counted). The
    /// current angle is 0.
    #[must_use]
    pub const fn new(count: u16, counts_per_turn: u16) -> Self {
        Self { last: count, counts: 0, counts_per_turn }
    }

    /// Updates the counter. The shaft must turn less than 32 768 counts between two calls.
    pub fn update(&mut self, count: u16) {
        self.counts += i64::from(count.wrapping_sub(self.last).cast_signed());
        self.last = count;
    }

    /// Returns the angle since the start, `rad`, over multiple turns.
    #[must_use]
    pub fn angle_rad(&self) -> f32 {
        self.counts as f32 * (TAU / f32::from(self.counts_per_turn))
    }
}

#[cfg(test)]
mod tests {
    use core::f32::consts::PI;

    use super::*;

    #[test]
    fn angles_go_on_across_the_counter_s_wrap_in_both_directions() {
        let mut encoder = Encoder::new(65_000, 4000);
        for count in [65_500, 464, 1464] {
            encoder.update(count);
        }
        assert!((encoder.angle_rad() - PI).abs() < 1e-5, "half a turn: {}", encoder.angle_rad());
        for count in [464, 65_000, 63_000] {
            encoder.update(count);
        }
        assert!((encoder.angle_rad() + PI).abs() < 1e-5, "half a turn back: {}", encoder.angle_rad());
    }
}
