//! Virtual time of a medium, in whole nanoseconds.

/// Nanoseconds of a second.
pub const NS_PER_S: u64 = 1_000_000_000;

/// How long bits last at a rate in `bit/s`, to the next nanosecond.
#[must_use]
pub fn bits_ns(bits: impl Into<u64>, bits_per_s: u32) -> u64 {
    (bits.into() * NS_PER_S).div_ceil(u64::from(bits_per_s.max(1)))
}

/// A time in seconds as whole nanoseconds; 0 for what is below 0 or no number.
#[must_use]
pub fn seconds_ns(time_s: f64) -> u64 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a cast saturates")]
    let ns = (time_s * 1e9).round() as u64;
    ns
}

/// Nanoseconds in seconds, to be shown.
#[must_use]
pub fn ns_seconds(time_ns: u64) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "shown with a few digits")]
    let ns = time_ns as f64;
    ns * 1e-9
}
