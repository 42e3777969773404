//! Converts ADC counts to amperes, volts and degrees.

/// Maximum count of a 12-bit ADC.
pub const MAX_COUNTS: u16 = 4095;
/// Periods for averaging the zero-current offset: 51 ms.
const REST_PERIODS: u16 = 1 << 10;
/// Initial periods in which the amplifiers settle.
const SETTLE_PERIODS: u16 = 1 << 8;

/// Scaling of a board's measurements.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scaling {
    /// Current into the motor per count, `A`; the sign depends on the amplifier.
    pub a_per_count: f32,
    /// Nominal counts at zero current.
    pub zero_current_counts: f32,
    /// Tolerance of the zero-current counts.
    pub zero_current_tolerance_counts: f32,
    /// Supply voltage per count, `V`.
    pub v_per_count: f32,
    /// Temperatures at every 128th count, from 0 on, `°C`.
    pub temperature_c: &'static [f32; 33],
}

impl Scaling {
    /// Returns the bridge temperature, `°C`, by linear interpolation.
    #[inline]
    #[must_use]
    pub fn celsius(&self, count: u16) -> f32 {
        let place = usize::from(count.min(MAX_COUNTS) / 128);
        let share = f32::from(count % 128) / 128.0;
        match self.temperature_c.get(place..) {
            Some([low, high, ..]) => low + share * (high - low),
            _ => f32::NAN,
        }
    }
}

/// Zero-current offsets of the phases, measured with the bridge off.
#[derive(Debug, Clone, Default)]
pub struct ZeroCurrentOffsets {
    sums: [u32; 3],
    periods: u16,
}

/// A phase shows a current while the bridge is off.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OffsetError;

impl ZeroCurrentOffsets {
    /// Adds one period; returns the offsets when complete.
    ///
    /// # Errors
    /// [`OffsetError`] if an offset is out of tolerance: faulty wiring or amplifier.
    pub fn step(&mut self, counts: [u16; 3], scaling: &Scaling) -> Result<Option<[f32; 3]>, OffsetError> {
        if self.periods >= SETTLE_PERIODS {
            for (sum, count) in self.sums.iter_mut().zip(counts) {
                *sum += u32::from(count);
            }
        }
        self.periods += 1;
        if self.periods < SETTLE_PERIODS + REST_PERIODS {
            return Ok(None);
        }
        let means = self.sums.map(|sum| sum as f32 / f32::from(REST_PERIODS));
        let is_right =
            |mean: &f32| (mean - scaling.zero_current_counts).abs() <= scaling.zero_current_tolerance_counts;
        if means.iter().all(is_right) { Ok(Some(means)) } else { Err(OffsetError) }
    }
}

/// Returns the currents into the motor, `A`. A saturated ADC yields an infinite current.
#[inline]
#[must_use]
pub fn amperes(counts: [u16; 3], rest: [f32; 3], scaling: &Scaling) -> [f32; 3] {
    let [u, v, w] = counts;
    let [rest_u, rest_v, rest_w] = rest;
    let of = |count: u16, rest: f32| {
        let end_a = if (1..MAX_COUNTS).contains(&count) { 1.0 } else { f32::INFINITY };
        (f32::from(count) - rest) * scaling.a_per_count * end_a
    };
    [of(u, rest_u), of(v, rest_v), of(w, rest_w)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::{b_g431b_esc1, ihm08m1};

    const SCALING: Scaling = b_g431b_esc1::DRIVE.scaling;
    const SHIELD: Scaling = ihm08m1::DRIVE.scaling;

    #[test]
    fn offsets_are_the_mean_of_what_is_counted_at_rest() {
        let mut rest = ZeroCurrentOffsets::default();
        let mut found = None;
        for period in 0..SETTLE_PERIODS + REST_PERIODS {
            assert_eq!(found, None);
            // The amplifiers settle, then noise of ±1 count.
            let noise = if period % 2 == 0 { 1 } else { 0 };
            let counts =
                if period < SETTLE_PERIODS { [0, 4095, 17] } else { [2550 + noise, 2560, 2540 - noise] };
            found = rest.step(counts, &SCALING).unwrap();
        }
        assert_eq!(found.unwrap().map(f32::to_bits), [2550.5, 2560.0, 2539.5].map(f32::to_bits));
    }

    #[test]
    fn a_phase_that_shows_a_current_at_rest_is_told() {
        for wrong in [0, 2000, 4095] {
            let mut rest = ZeroCurrentOffsets::default();
            let ends = (0..2 * REST_PERIODS).find_map(|_| rest.step([2553, 2553, wrong], &SCALING).err());
            assert_eq!(ends, Some(OffsetError), "{wrong}");
        }
    }

    /// The board's schematic in `f64`: a 3 mOhm shunt, 1.5 kOhm in series, 22 kOhm pull-up and 2.2 kOhm
    /// pull-down, gain 16.
    fn counts(current_a: f64) -> f64 {
        // Out of the motor through the lower switch: current into the motor makes the shunt's upper end
        // negative.
        let shunt_v = -0.003 * current_a;
        let conductance = 1.0 / 1_500.0 + 1.0 / 22_000.0 + 1.0 / 2_200.0;
        let input_v = (shunt_v / 1_500.0 + 3.3 / 22_000.0) / conductance;
        16.0 * input_v / 3.3 * f64::from(MAX_COUNTS)
    }

    /// The shield: a 10 mOhm shunt, 680 Ohm in series, 6.8 kOhm to 3.3 V; an amplifier with 4.7 kOhm and 1
    /// kOhm.
    fn shield_counts(current_a: f64) -> f64 {
        let input_v = (-0.01 * current_a / 680.0 + 3.3 / 6_800.0) / (1.0 / 680.0 + 1.0 / 6_800.0);
        (1.0 + 4.7) * input_v / 3.3 * f64::from(MAX_COUNTS)
    }

    #[test]
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "counts of a converter")]
    fn currents_are_those_of_the_schematic() {
        for (scaling, counts, max_a) in
            [(SCALING, counts as fn(f64) -> f64, 40.0), (SHIELD, shield_counts, 28.0)]
        {
            assert!((f64::from(scaling.zero_current_counts) - counts(0.0)).abs() < 1.0, "{}", counts(0.0));
            let rest = [scaling.zero_current_counts; 3];
            for current_a in [-max_a, -1.0, 0.0, 3.0, max_a] {
                let shown = counts(current_a).round() as u16;
                for measured_a in amperes([shown; 3], rest, &scaling) {
                    assert!((f64::from(measured_a) - current_a).abs() < 0.06, "{current_a}: {measured_a}");
                }
            }
            assert!(
                amperes([0, 4095, 2553], rest, &scaling)[..2].iter().all(|current_a| current_a.is_infinite())
            );
        }
    }

    #[test]
    fn the_supply_is_behind_its_divider() {
        for (scaling, low_kohm, high_kohm) in [(SCALING, 18.0, 169.0), (SHIELD, 9.31, 169.0)] {
            for volts in [8.0_f32, 12.0, 24.0, 30.0] {
                let count = (volts * low_kohm / (low_kohm + high_kohm) / 3.3 * 4095.0).round();
                assert!((count * scaling.v_per_count - volts).abs() < 0.01);
            }
        }
    }

    #[test]
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "counts of a converter")]
    fn temperatures_are_those_of_the_thermistor() {
        for celsius in -30..=130 {
            let kelvin = f64::from(celsius) + 273.15;
            let ohm = 10_000.0 * (3_425.0 * (1.0 / kelvin - 1.0 / 298.15)).exp();
            let count = f64::from(MAX_COUNTS) * 4_700.0 / (4_700.0 + ohm);
            let found = SCALING.celsius(count.round() as u16);
            let tolerance = if celsius < 0 { 1.5 } else { 1.0 };
            assert!((found - celsius as f32).abs() < tolerance, "{celsius}: {found}");
        }
        assert!(SCALING.celsius(0) < -40.0, "a wire is open");
        assert!(SCALING.celsius(4095) > 200.0, "or short-circuited");
    }
}
