//! A haptic device's axis: mass, viscous damping, Coulomb friction, encoder.

use super::parameter::{ParameterError, finite, not_negative, positive};
use serde::{Deserialize, Serialize};

/// One axis of a device, seen at its tip.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct DeviceParameters {
    /// Moving mass, `kg`, > 0. A `PHANToM` Premium 1.5 shows 0.03 to 0.08 at its tip.
    pub mass_kg: f64,
    /// Viscous damping to ground, `N s/m`, >= 0.
    pub damping_ns_per_m: f64,
    /// Coulomb friction, `N`, >= 0: opposes motion while sliding, holds up to this much while at rest.
    /// 0.04 is a usual figure for a `PHANToM` (from the literature, not measured here).
    pub coulomb_friction_n: f64,
    /// Length of one encoder count, `m`, >= 0; 0 is an ideal sensor. A `PHANToM` has 3e-5.
    pub encoder_step_m: f64,
    /// Where the axis stands at the start, `m`, at rest.
    pub start_position_m: f64,
}

impl Default for DeviceParameters {
    /// A light, frictionless device with an ideal sensor: 0.1 kg, 0.01 N s/m.
    fn default() -> Self {
        Self {
            mass_kg: 0.1,
            damping_ns_per_m: 0.01,
            coulomb_friction_n: 0.0,
            encoder_step_m: 0.0,
            start_position_m: 0.0,
        }
    }
}

impl DeviceParameters {
    /// Says whether a device like this can exist.
    ///
    /// # Errors
    /// The first parameter outside its range.
    pub fn check(&self) -> Result<(), ParameterError> {
        positive("mass_kg", self.mass_kg)?;
        not_negative("damping_ns_per_m", self.damping_ns_per_m)?;
        not_negative("coulomb_friction_n", self.coulomb_friction_n)?;
        not_negative("encoder_step_m", self.encoder_step_m)?;
        finite("start_position_m", self.start_position_m)
    }

    /// What the encoder reports at `position_m`: whole counts passed, so at most one step less than the truth.
    pub(super) fn encoder_m(&self, position_m: f64) -> f64 {
        if self.encoder_step_m > 0.0 {
            (position_m / self.encoder_step_m).floor() * self.encoder_step_m
        } else {
            position_m
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A steady ramp spends the same time in every count, every reading is a whole count, and velocity by
    /// differences comes in quanta of step/period.
    #[test]
    fn encoder_reports_whole_counts_each_equally_often() {
        let device = DeviceParameters { encoder_step_m: 3e-5, ..DeviceParameters::default() };
        let mut histogram = [0_u32; 11];
        let mut previous = 0.0;
        for k in 0..11_000_u32 {
            let position_m = f64::from(k).mul_add(3e-8, 1e-9);
            let reading_m = device.encoder_m(position_m);
            let counts = reading_m / 3e-5;
            assert!((counts - counts.round()).abs() < 1e-9, "{counts} is no whole count");
            assert!((0.0..3e-5).contains(&(position_m - reading_m)), "{position_m} read as {reading_m}");
            let jump = (reading_m - previous) / 3e-5;
            assert!(jump.abs() < 1e-9 || (jump - 1.0).abs() < 1e-9, "jumped by {jump} counts");
            previous = reading_m;
            let bin = (0..11).find(|bin| (counts - f64::from(*bin)).abs() < 0.5).unwrap();
            histogram[usize::try_from(bin).unwrap()] += 1;
        }
        assert!(histogram.iter().all(|count| count.abs_diff(1000) <= 1), "{histogram:?}");
        assert!((device.encoder_m(-1e-9) + 3e-5).abs() < 1e-12, "just below zero is count -1");
    }

    #[test]
    fn impossible_devices_are_refused_by_name_value_and_range() {
        for (parameters, field) in [
            (DeviceParameters { mass_kg: -0.1, ..DeviceParameters::default() }, "mass_kg"),
            (DeviceParameters { mass_kg: 0.0, ..DeviceParameters::default() }, "mass_kg"),
            (DeviceParameters { mass_kg: f64::NAN, ..DeviceParameters::default() }, "mass_kg"),
            (DeviceParameters { mass_kg: f64::INFINITY, ..DeviceParameters::default() }, "mass_kg"),
            (DeviceParameters { damping_ns_per_m: -1.0, ..DeviceParameters::default() }, "damping_ns_per_m"),
            (DeviceParameters { encoder_step_m: f64::NAN, ..DeviceParameters::default() }, "encoder_step_m"),
        ] {
            assert_eq!(parameters.check().unwrap_err().path, field);
        }
        let error = DeviceParameters { mass_kg: -0.1, ..DeviceParameters::default() }.check().unwrap_err();
        assert_eq!(
            error.within("device").to_string(),
            "parameter `device.mass_kg` is -0.1, allowed is > 0 and finite: set `device.mass_kg` to an allowed value"
        );
    }

    #[test]
    fn a_scenario_with_an_unknown_key_is_refused() {
        let error = toml::from_str::<DeviceParameters>("mass_kg = 0.1\nmas = 2.0").unwrap_err();
        assert!(error.to_string().contains("mas"), "{error}");
    }
}
