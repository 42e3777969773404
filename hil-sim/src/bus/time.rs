//! Virtual time of a medium, in whole nanoseconds.

/// Nanoseconds of a second.
pub const NS_PER_S: u64 = 1_000_000_000;

/// Duration of bits at a rate in `bit/s`, rounded to nanoseconds.
#[must_use]
pub fn bits_to_ns(bits: impl Into<u64>, bits_per_s: u32) -> u64 {
    (bits.into() * NS_PER_S).div_ceil(u64::from(bits_per_s.max(1)))
}

/// Converts seconds to nanoseconds; 0 for negative values and NaN.
#[must_use]
pub fn seconds_to_ns(time_s: f64) -> u64 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a cast saturates")]
    let ns = (time_s * 1e9).round() as u64;
    ns
}

/// Time of a tick, `s`. For a period of whole nanoseconds, the nearest number to the decimal value: 0.009 s after 9
/// ms.
#[must_use]
pub fn tick_time_s(tick: u64, period_s: f64) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "exact for 285 000 years of ticks")]
    let tick = tick as f64;
    let period_ns = period_s * 1e9;
    let is_whole = (period_ns - period_ns.round()).abs() < 1e-9 * period_ns;
    if is_whole { tick * period_ns.round() / 1e9 } else { tick * period_s }
}

/// Converts nanoseconds to seconds, for display.
#[must_use]
pub fn ns_to_seconds(time_ns: u64) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "shown with a few digits")]
    let ns = time_ns as f64;
    ns * 1e-9
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_has_no_more_digits_than_its_period() {
        for (period_s, digits) in [(0.001, 3), (0.0005, 4), (0.000_125, 6), (0.01, 2)] {
            for tick in 0..20_000_u32 {
                let text = tick_time_s(tick.into(), period_s).to_string();
                let count = text.split_once('.').map_or(0, |(_, digits)| digits.len());
                assert!(count <= digits, "tick {tick} of {period_s} s: {text}");
            }
        }
        assert_eq!(tick_time_s(6, 1.0 / 3000.0).to_bits(), (6.0_f64 / 3000.0).to_bits());
    }
}
