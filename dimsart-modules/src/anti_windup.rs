//! Anti-windup: how an integral follows a force that the module or the device limits.

/// Returns the share of the excess force that one tick removes from the integral: `tracking`, or 0 without an integral
/// gain, because a correction would then never decay.
#[inline(always)]
pub(super) fn follow(tracking: f32, integral_gain: f32) -> f32 {
    if integral_gain > 0.0 { tracking } else { 0.0 }
}
