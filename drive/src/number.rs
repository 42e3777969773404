//! The larger and the smaller of two numbers, by one comparison and no branch: `f32::max` is a call on a Cortex-M.

/// The larger one; the second where the first is no number.
#[inline(always)]
pub(crate) fn larger(one: f32, other: f32) -> f32 {
    if one > other { one } else { other }
}

/// The smaller one; the second where the first is no number.
#[inline(always)]
pub(crate) fn smaller(one: f32, other: f32) -> f32 {
    if one < other { one } else { other }
}

/// A number held within `±most`, `most` at least 0; `most` where it is none.
#[inline(always)]
pub(crate) fn within(number: f32, most: f32) -> f32 {
    larger(smaller(number, most), -most)
}
