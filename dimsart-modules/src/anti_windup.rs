//! How an integral follows a force that is limited, by its module or by the device.

/// Share of the difference that a tick takes off the integral: `tracking`; none without an integral gain, as nothing would
/// ever take that off again.
#[inline(always)]
pub(super) fn follow(tracking: f32, integral_gain: f32) -> f32 {
    if integral_gain > 0.0 { tracking } else { 0.0 }
}
