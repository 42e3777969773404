//! The angle of a joint from that of its rotor, which wraps at every turn.

use core::f32::consts::TAU;

/// Parts of a turn.
const TURN: f32 = 4_294_967_296.0;

/// Follows a rotor.
#[derive(Debug, Clone, Default)]
pub struct Shaft {
    last: Option<u32>,
    /// Since the start, in 2³² of a turn.
    turned: i64,
}

impl Shaft {
    /// One whose angle is 0 where it is first seen.
    #[must_use]
    pub const fn new() -> Self {
        Self { last: None, turned: 0 }
    }

    /// Takes in where the rotor is: share of a turn, which is 2³². Right as long as it makes less than half a turn between two
    /// calls.
    pub fn update(&mut self, angle: u32) {
        let last = *self.last.get_or_insert(angle);
        self.turned += i64::from(angle.wrapping_sub(last).cast_signed());
        self.last = Some(angle);
    }

    /// Angle since the start, `rad`; not wrapped at a turn.
    #[must_use]
    pub fn angle_rad(&self) -> f32 {
        self.turned as f32 * (TAU / TURN)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_go_on_across_turns_in_both_directions() {
        let mut shaft = Shaft::new();
        assert_eq!(shaft.angle_rad().to_bits(), 0);
        let mut angle = 0xF000_0000_u32;
        shaft.update(angle);
        assert_eq!(shaft.angle_rad().to_bits(), 0, "it begins where it is");
        for _ in 0..30 {
            angle = angle.wrapping_add(0x4000_0000);
            shaft.update(angle);
        }
        assert!((shaft.angle_rad() - 7.5 * TAU).abs() < 1e-4);
        for _ in 0..40 {
            angle = angle.wrapping_sub(0x7000_0000);
            shaft.update(angle);
        }
        assert!((shaft.angle_rad() + 10.0 * TAU).abs() < 1e-4);
    }
}
