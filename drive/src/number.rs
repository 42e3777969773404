//! Maximum and minimum by one comparison without a branch; `f32::max` is a function call on a Cortex-M.

/// Returns the maximum; `other` if `one` is NaN.
#[inline(always)]
pub(crate) fn larger(one: f32, other: f32) -> f32 {
    if one > other { one } else { other }
}

/// Returns the minimum; `other` if `one` is NaN.
#[inline(always)]
pub(crate) fn smaller(one: f32, other: f32) -> f32 {
    if one < other { one } else { other }
}

/// Clamps a number to `±most`, `most >= 0`; returns `most` for NaN.
#[inline(always)]
pub(crate) fn within(number: f32, most: f32) -> f32 {
    larger(smaller(number, most), -most)
}
