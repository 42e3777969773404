//! The angle of a shaft from the wrapping counter of an incremental encoder.
//!
//! angle = 2 pi / counts per turn · counts since the start

use core::f32::consts::TAU;

/// An incremental encoder behind a 16-bit counter.
#[derive(Debug, Clone)]
pub struct Encoder {
    last: u16,
    counts: i64,
    counts_per_turn: u16,
}

impl Encoder {
    /// An encoder whose counter stands at `count` and that makes `counts_per_turn` (above 0) counts per
    /// turn, all four edges counted. The angle is 0 where it stands now.
    #[must_use]
    pub const fn new(count: u16, counts_per_turn: u16) -> Self {
        Self { last: count, counts: 0, counts_per_turn }
    }

    /// Takes the counter in. Right as long as the shaft makes less than 32 768 counts between two calls.
    pub fn update(&mut self, count: u16) {
        self.counts += i64::from(count.wrapping_sub(self.last).cast_signed());
        self.last = count;
    }

    /// Angle since the start, `rad`; not wrapped at a turn.
    #[must_use]
    pub fn angle_rad(&self) -> f32 {
        self.counts as f32 * (TAU / f32::from(self.counts_per_turn))
    }

    /// Electrical angle of a rotor with `pole_pairs` pole pairs, `rad`, 0 to 2 pi; 0 at the start.
    #[must_use]
    pub fn electrical_angle_rad(&self, pole_pairs: u8) -> f32 {
        let per_turn = i64::from(self.counts_per_turn);
        let within_turn = (self.counts * i64::from(pole_pairs)).checked_rem_euclid(per_turn).unwrap_or(0);
        within_turn as f32 * (TAU / f32::from(self.counts_per_turn))
    }

    /// Makes this the place where the angles are 0.
    pub fn set_zero(&mut self) {
        self.counts = 0;
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

    #[test]
    fn the_electrical_angle_turns_once_per_pole_pair_also_after_many_turns_backwards() {
        let mut encoder = Encoder::new(0, 4096);
        let mut count = 0u16;
        for _ in 0..1_000_001 {
            count = count.wrapping_sub(1024);
            encoder.update(count);
        }
        // 250 000 turns and a quarter of one, backwards, with 7 pole pairs: 1/4 of an electrical turn.
        let angle = encoder.electrical_angle_rad(7);
        assert!((angle - PI / 2.0).abs() < 1e-5, "{angle}");
    }

    #[test]
    fn zero_is_where_it_was_set() {
        let mut encoder = Encoder::new(10, 4096);
        encoder.update(1034);
        encoder.set_zero();
        encoder.update(2058);
        assert!((encoder.angle_rad() - PI / 2.0).abs() < 1e-6);
    }
}
