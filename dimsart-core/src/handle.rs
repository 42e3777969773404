//! Typed handles: what a module holds of the Data Base.
//!
//! A handle is resolved when its module is plugged in and is one byte wide; using it involves no
//! name and no search. A handle that was never resolved reads nothing and writes nothing.

use core::marker::PhantomData;

use crate::data_type::Shape;
use crate::word::{Format, Scalar};

/// What a handle gives access to: format and shape of a signal.
pub trait Signal {
    /// Format of each word.
    const FORMAT: Format;
    /// Whether words of `shape` are what this handle expects.
    fn takes(shape: Shape) -> bool;
}

/// One value per degree of freedom.
#[derive(Debug, Clone, Copy, Default)]
pub struct Vector<T = f32>(PhantomData<T>);

/// A single value.
#[derive(Debug, Clone, Copy, Default)]
pub struct Single<T = f32>(PhantomData<T>);

/// `R × C` values, row by row.
#[derive(Debug, Clone, Copy, Default)]
pub struct Matrix<const R: u8, const C: u8, T = f32>(PhantomData<T>);

impl<T: Scalar> Signal for Vector<T> {
    const FORMAT: Format = T::FORMAT;
    fn takes(shape: Shape) -> bool {
        shape == Shape::Vector
    }
}

impl<T: Scalar> Signal for Single<T> {
    const FORMAT: Format = T::FORMAT;
    fn takes(shape: Shape) -> bool {
        shape == Shape::Scalar
    }
}

impl<const R: u8, const C: u8, T: Scalar> Signal for Matrix<R, C, T> {
    const FORMAT: Format = T::FORMAT;
    fn takes(shape: Shape) -> bool {
        shape == Shape::Matrix(R, C)
    }
}

/// Slot index of a handle that is not resolved.
pub(crate) const NO_SLOT: u8 = u8::MAX;

macro_rules! handle {
    ($name:ident, $doc:literal) => {
        #[doc = $doc]
        #[derive(Debug)]
        pub struct $name<S = Vector> {
            pub(crate) slot: u8,
            signal: PhantomData<S>,
        }

        impl<S> $name<S> {
            pub(crate) const fn new(slot: u8) -> Self {
                Self { slot, signal: PhantomData }
            }
        }

        impl<S> Default for $name<S> {
            fn default() -> Self {
                Self::new(NO_SLOT)
            }
        }

        impl<S> Clone for $name<S> {
            fn clone(&self) -> Self {
                *self
            }
        }

        impl<S> Copy for $name<S> {}
    };
}

handle!(Input, "A signal that a module reads.");
handle!(Output, "A signal that a module writes.");

/// A module's own block of words in the Data Base, for what is too large to sit in every module.
#[derive(Debug, Clone, Copy)]
pub struct Memory {
    pub(crate) slot: u8,
}

impl Default for Memory {
    fn default() -> Self {
        Self { slot: NO_SLOT }
    }
}
