//! Converts angle, speed and torque between a joint and its rotor, over multiple turns.
//!
//! q = zero + rotor / ratio; torque of the rotor = torque of the joint / ratio

use core::f32::consts::TAU;

use drive::Joint;

/// Angle units per turn.
const TURN: f32 = 4_294_967_296.0;

/// Tracks a rotor.
#[derive(Debug, Clone)]
pub struct Shaft {
    joint: Joint,
    last: Option<u32>,
    /// Angle from the encoder's zero, in 2⁻³² of a turn.
    turned: i64,
}

impl Shaft {
    /// Creates a shaft for a joint. An incremental encoder starts at 0; an absolute one within half a turn of
    /// its zero.
    #[must_use]
    pub fn new(joint: Joint, is_absolute: bool) -> Self {
        Self { joint, last: is_absolute.then_some(0), turned: 0 }
    }

    /// Updates the rotor angle in 2⁻³² of a turn. The rotor must turn less than half a turn between two
    /// calls.
    pub fn update(&mut self, angle: u32) {
        let last = *self.last.get_or_insert(angle);
        self.turned += i64::from(angle.wrapping_sub(last).cast_signed());
        self.last = Some(angle);
    }

    /// Returns the joint angle, `rad`, over multiple turns.
    #[must_use]
    pub fn angle_rad(&self) -> f32 {
        self.turned as f32 * (TAU / TURN / self.joint.gear_ratio) + self.joint.zero_rad
    }

    /// Returns the joint speed, `rad/s`, for a rotor speed.
    #[must_use]
    pub fn speed_rad_per_s(&self, rotor_rad_per_s: f32) -> f32 {
        rotor_rad_per_s / self.joint.gear_ratio
    }

    /// Returns the rotor torque, `N m`, for a joint torque without losses.
    #[must_use]
    pub fn rotor_torque_nm(&self, joint_nm: f32) -> f32 {
        joint_nm / self.joint.gear_ratio
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_go_on_across_turns_in_both_directions() {
        let mut shaft = Shaft::new(Joint { gear_ratio: 1.0, zero_rad: 0.0 }, false);
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

    #[test]
    fn a_gear_divides_the_angle_and_the_speed_and_multiplies_the_torque() {
        for gear_ratio in [50.0, -50.0] {
            let mut shaft = Shaft::new(Joint { gear_ratio, zero_rad: 0.5 }, false);
            let mut angle = 0x1234_0000_u32;
            shaft.update(angle);
            assert_eq!(shaft.angle_rad().to_bits(), 0.5_f32.to_bits(), "its zero is where it starts");
            for _ in 0..100 {
                angle = angle.wrapping_add(0x4000_0000);
                shaft.update(angle);
            }
            let turned_rad = shaft.angle_rad() - 0.5;
            assert!((turned_rad - 25.0 * TAU / gear_ratio).abs() < 1e-5, "{turned_rad}");
            assert!((shaft.speed_rad_per_s(100.0) - 100.0 / gear_ratio).abs() < 1e-6);
            // Power is conserved.
            let (rotor_torque_nm, joint_rad_per_s) =
                (shaft.rotor_torque_nm(3.0), shaft.speed_rad_per_s(100.0));
            assert!((rotor_torque_nm * 100.0 - 3.0 * joint_rad_per_s).abs() < 1e-4);
        }
    }

    #[test]
    fn an_absolute_encoder_has_its_zero_where_it_says_so() {
        for (angle, expected_rad) in [(0x4000_0000, TAU / 8.0), (0xC000_0000, -TAU / 8.0)] {
            let mut shaft = Shaft::new(Joint { gear_ratio: 2.0, zero_rad: 0.5 }, true);
            shaft.update(angle);
            assert!((shaft.angle_rad() - 0.5 - expected_rad).abs() < 1e-6, "{}", shaft.angle_rad());
        }
    }
}
