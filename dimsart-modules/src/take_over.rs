//! Initial value of a module that can take over from another one.

/// Returns the last command on takeover if it is finite, otherwise the module's own initial value.
#[inline(always)]
pub(super) fn first(takes_over: bool, last: f32, own: f32) -> f32 {
    if takes_over && last.is_finite() { last } else { own }
}
