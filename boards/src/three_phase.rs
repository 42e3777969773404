//! Configuration of boards with a three-phase motor, without registers.

use dimsart_core::{InputLimits, OutputLimits, SafeValue};
use dimsart_link::protocol::{MotorFallback, MotorReport, MotorWords};
use drive::{Configuration, Encoder, ValidConfiguration};

use crate::motor::RISE_S;

/// Limit of measured speed relative to the rotor's speed limit; above it, a measurement is invalid.
const SHOWN_SPEED: f32 = 1.5;

/// Decodes a configuration on a board with `image`'s inverter and encoders accepted by `reads`.
///
/// # Errors
/// The reason if this board cannot use it.
#[inline(never)]
pub fn decode_configuration(
    layout: u16,
    words: &[u32],
    image: &Configuration,
    reads: fn(Encoder) -> bool,
) -> Result<ValidConfiguration, MotorFallback> {
    if layout != Configuration::LAYOUT {
        return Err(MotorFallback::Layout);
    }
    let told = Configuration::from_words(words).filter(|told| reads(told.encoder));
    let told = told.ok_or(MotorFallback::Value)?;
    Configuration { inverter: image.inverter, ..told }.checked().map_err(|_| MotorFallback::Value)
}

/// Returns the stored configuration if valid, or the image's. The report contains the active one and the
/// reason.
pub fn select_configuration(
    report: &mut MotorReport,
    image: &ValidConfiguration,
    reads: fn(Encoder) -> bool,
) -> ValidConfiguration {
    let mut runs_by = *image;
    if report.is_stored {
        match decode_configuration(report.layout, &report.words, image.get(), reads) {
            Ok(kept) => runs_by = kept,
            Err(fallback) => (report.is_stored, report.fallback) = (false, Some(fallback)),
        }
    }
    report.layout = Configuration::LAYOUT;
    report.words = MotorWords::from_slice(&runs_by.get().to_words()).unwrap_or_default();
    runs_by
}

/// Returns the limits of torque commands, `N m` of the joint: from the current limit, with 10 ms from zero to
/// maximum; safe value 0.
#[must_use]
pub const fn torque_limits(told: &Configuration) -> InputLimits {
    let Configuration { motor, joint, limits, .. } = told;
    let max = motor.torque_constant_nm_per_a() * limits.current_a * joint.gear_ratio.abs();
    InputLimits { min: -max, max, rate_per_s: max / RISE_S, safe_value: SafeValue::Zero }
}

/// Returns the limits of the joint angle: any angle, and 1.5 times the speed at which the bridge turns off.
#[must_use]
pub const fn position_limits(told: &Configuration) -> OutputLimits {
    let speed_rad_per_s = told.limits.speed_rad_per_s / told.joint.gear_ratio.abs();
    OutputLimits { rate_per_s: SHOWN_SPEED * speed_rad_per_s, ..OutputLimits::NONE }
}

#[cfg(test)]
mod tests {
    use drive::Joint;

    use super::*;
    use crate::catalogue::b_g431b_esc1::DRIVE;

    const IMAGE: Configuration = DRIVE.configuration;

    fn reads(encoder: Encoder) -> bool {
        !encoder.is_absolute()
    }

    fn kept(told: &Configuration) -> MotorReport {
        MotorReport {
            layout: Configuration::LAYOUT,
            is_stored: true,
            words: MotorWords::from_slice(&told.to_words()).unwrap(),
            ..MotorReport::default()
        }
    }

    fn taken(mut report: MotorReport) -> (Configuration, MotorReport) {
        let runs_by = select_configuration(&mut report, &IMAGE.checked().unwrap(), reads);
        assert_eq!(
            Configuration::from_words(&report.words),
            Some(*runs_by.get()),
            "the report equals the configuration in use"
        );
        assert_eq!(report.layout, Configuration::LAYOUT);
        (*runs_by.get(), report)
    }

    #[test]
    fn what_is_kept_is_taken_but_for_the_inverter() {
        let mut told = IMAGE;
        (told.motor.pole_pairs, told.joint.gear_ratio, told.inverter.period_s) = (11, -9.0, 1e-4);
        let (runs_by, report) = taken(kept(&told));
        assert_eq!(runs_by, Configuration { inverter: IMAGE.inverter, ..told });
        assert!(report.is_stored && report.fallback.is_none());
    }

    #[test]
    fn what_cannot_be_taken_falls_back_to_the_image_and_says_why() {
        let mut too_much = IMAGE;
        too_much.limits.current_a = 50.0;
        let no_number = Configuration { bandwidth_rad_per_s: f32::NAN, ..IMAGE };
        let other_encoder = Configuration { encoder: Encoder::As5047p, ..IMAGE };
        let other_layout = MotorReport { layout: 1, ..kept(&IMAGE) };
        let cut = MotorReport { words: MotorWords::from_slice(&[1, 2]).unwrap(), ..kept(&IMAGE) };
        for (report, fallback) in [
            (kept(&too_much), MotorFallback::Value),
            (kept(&no_number), MotorFallback::Value),
            (kept(&other_encoder), MotorFallback::Value),
            (other_layout, MotorFallback::Layout),
            (cut, MotorFallback::Value),
        ] {
            let (runs_by, report) = taken(report);
            assert_eq!(runs_by, IMAGE);
            assert_eq!((report.is_stored, report.fallback), (false, Some(fallback)));
        }
        let unreadable = MotorReport { fallback: Some(MotorFallback::Storage), ..MotorReport::default() };
        assert_eq!(taken(unreadable).1.fallback, Some(MotorFallback::Storage));
        assert_eq!(taken(MotorReport::default()), (IMAGE, MotorReport { is_stored: false, ..kept(&IMAGE) }));
    }

    #[test]
    fn limits_are_those_of_the_joint() {
        for gear_ratio in [1.0, 50.0, -50.0, 0.1] {
            let told = Configuration { joint: Joint { gear_ratio, zero_rad: 0.0 }, ..IMAGE };
            let (torque, ratio) = (torque_limits(&told), gear_ratio.abs());
            // 0.05 N m/A.
            assert!((torque.max - 0.25 * ratio).abs() < 1e-4 * ratio, "{torque:?}");
            assert_eq!(torque.min.to_bits(), (-torque.max).to_bits());
            assert!((torque.rate_per_s / torque.max - 100.0).abs() < 1e-3);
            let rate = position_limits(&told).rate_per_s;
            assert!((rate - 600.0 / ratio).abs() < 1e-3 * rate, "{rate}");
        }
    }
}
