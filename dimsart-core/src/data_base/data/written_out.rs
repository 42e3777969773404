//! [`map_axes`](super::Data::map_axes) for each number of ports, without a loop over the ports.
//!
//! Optimised for size, the compiler keeps such a loop with the ports in memory: twice the instructions.

use core::cell::Cell;

use super::Data;
use crate::data_base::handle::{Input, Output, Vector};
use crate::signal::{Scalar, Word};

/// An array of at most 8 [`Input`]s of format `f32`, or a tuple of at most 4 of any formats.
pub trait Inputs {
    /// Words of the axes of each port.
    type Words<'a>;
    /// Values of one axis of each port.
    type Values;
    #[doc(hidden)]
    fn words<'a>(&self, data: &Data<'a>) -> Option<Self::Words<'a>>;
    #[doc(hidden)]
    fn read(words: &Self::Words<'_>, axis: usize) -> Self::Values;
}

/// An array of at most 8 [`Output`]s of format `f32`, or a tuple of at most 4 of any formats.
pub trait Outputs {
    /// Words of the axes of each port.
    type Words<'a>;
    /// Values of one axis of each port.
    type Values;
    #[doc(hidden)]
    fn words<'a>(&self, data: &Data<'a>) -> Option<Self::Words<'a>>;
    #[doc(hidden)]
    fn write(words: &Self::Words<'_>, axis: usize, values: Self::Values);
}

macro_rules! written_out {
    ($($length:literal: $(($port:ident, $value:ident))*;)+) => { $(
        impl Inputs for [Input<Vector>; $length] {
            type Words<'a> = [&'a [Cell<u32>]; $length];
            type Values = [f32; $length];

            #[inline(always)]
            fn words<'a>(&self, data: &Data<'a>) -> Option<Self::Words<'a>> {
                let [$($port),*] = self;
                let _ = data;
                Some([$(data.axes($port.block.offset)?),*])
            }

            #[inline(always)]
            fn read([$($port),*]: &Self::Words<'_>, axis: usize) -> Self::Values {
                let _ = axis;
                [$($port.get(axis).map_or(0.0, |word| f32::from_bits(word.get()))),*]
            }
        }

        impl Outputs for [Output<Vector>; $length] {
            type Words<'a> = [&'a [Cell<u32>]; $length];
            type Values = [f32; $length];

            #[inline(always)]
            fn words<'a>(&self, data: &Data<'a>) -> Option<Self::Words<'a>> {
                let [$($port),*] = self;
                let _ = data;
                Some([$(data.axes($port.block.offset)?),*])
            }

            #[inline(always)]
            fn write([$($port),*]: &Self::Words<'_>, axis: usize, [$($value),*]: Self::Values) {
                let _ = axis;
                $(if let Some(word) = $port.get(axis) {
                    word.set($value.to_bits());
                })*
            }
        }
    )+ };
}

written_out! {
    0: ;
    1: (a, a_value);
    2: (a, a_value) (b, b_value);
    3: (a, a_value) (b, b_value) (c, c_value);
    4: (a, a_value) (b, b_value) (c, c_value) (d, d_value);
    5: (a, a_value) (b, b_value) (c, c_value) (d, d_value) (e, e_value);
    6: (a, a_value) (b, b_value) (c, c_value) (d, d_value) (e, e_value) (f, f_value);
    7: (a, a_value) (b, b_value) (c, c_value) (d, d_value) (e, e_value) (f, f_value) (g, g_value);
    8: (a, a_value) (b, b_value) (c, c_value) (d, d_value) (e, e_value) (f, f_value) (g, g_value) (h, h_value);
}

macro_rules! mixed {
    ($($length:literal: $(($port:ident, $value:ident, $format:ident))+;)+) => { $(
        impl<$($format: Scalar),+> Inputs for ($(Input<Vector<$format>>,)+) {
            type Words<'a> = [&'a [Cell<u32>]; $length];
            type Values = ($($format,)+);

            #[inline(always)]
            fn words<'a>(&self, data: &Data<'a>) -> Option<Self::Words<'a>> {
                let ($($port,)+) = self;
                Some([$(data.axes($port.block.offset)?),+])
            }

            #[inline(always)]
            fn read([$($port),+]: &Self::Words<'_>, axis: usize) -> Self::Values {
                ($($port.get(axis).map_or_else($format::default, |word| $format::from_word(Word(word.get()))),)+)
            }
        }

        impl<$($format: Scalar),+> Outputs for ($(Output<Vector<$format>>,)+) {
            type Words<'a> = [&'a [Cell<u32>]; $length];
            type Values = ($($format,)+);

            #[inline(always)]
            fn words<'a>(&self, data: &Data<'a>) -> Option<Self::Words<'a>> {
                let ($($port,)+) = self;
                Some([$(data.axes($port.block.offset)?),+])
            }

            #[inline(always)]
            fn write([$($port),+]: &Self::Words<'_>, axis: usize, ($($value,)+): Self::Values) {
                $(if let Some(word) = $port.get(axis) {
                    word.set($value.into_word().0);
                })+
            }
        }
    )+ };
}

mixed! {
    1: (a, a_value, A);
    2: (a, a_value, A) (b, b_value, B);
    3: (a, a_value, A) (b, b_value, B) (c, c_value, C);
    4: (a, a_value, A) (b, b_value, B) (c, c_value, C) (d, d_value, D);
}
