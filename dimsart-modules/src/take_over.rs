//! Where a module begins that may take over from another one.

/// What was commanded last where a module takes over, otherwise what it begins with by itself.
#[inline(always)]
pub(super) fn first(takes_over: bool, last: f32, own: f32) -> f32 {
    if takes_over && last.is_finite() { last } else { own }
}
