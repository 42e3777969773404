//! Typed handles: a module's access to the Data Base.
//!
//! A handle holds the location of its signal's words. The [`wiring`](crate::scheme::wiring) resolves it when
//! the module is plugged in, and again whenever words move, so access in a tick needs no lookup. An
//! unconnected handle reads zero, and writes to it are dropped.

use core::cell::Cell;
use core::marker::PhantomData;

use crate::data_base::storage::Block;
use crate::signal::{Format, Scalar, Shape, Words};

/// Format and shape of the signals that a handle accepts.
pub trait Signal {
    /// Format of each word; none for any format.
    const FORMAT: Option<Format>;
    /// Returns whether the handle accepts words of `shape`.
    fn takes(shape: Shape) -> bool;
    /// Returns the number of words on a device with `dof` axes; `bound` is the number of words of the bound
    /// signal.
    fn words(dof: usize, bound: u16) -> usize;
}

/// A signal with rows and columns.
pub trait MatrixSignal: Signal {
    /// Type of an element.
    type Value: Scalar;
    /// Returns rows and columns on a device with `dof` axes.
    fn size(dof: usize) -> (usize, usize);
}

/// One value per degree of freedom.
#[derive(Debug, Clone, Copy, Default)]
pub struct Vector<T = f32>(PhantomData<T>);

/// A single value.
#[derive(Debug, Clone, Copy, Default)]
pub struct ScalarSignal<T = f32>(PhantomData<T>);

/// `R × C` values, row by row.
#[derive(Debug, Clone, Copy, Default)]
pub struct Matrix<const R: u8, const C: u8, T = f32>(PhantomData<T>);

/// One row and one column per degree of freedom, row by row.
#[derive(Debug, Clone, Copy, Default)]
pub struct Square<T = f32>(PhantomData<T>);

/// Words of any format and shape, which the module copies unread.
#[derive(Debug, Clone, Copy, Default)]
pub struct Untyped;

impl<T: Scalar> Signal for Vector<T> {
    const FORMAT: Option<Format> = Some(T::FORMAT);
    fn takes(shape: Shape) -> bool {
        shape == Shape::Vector
    }
    #[inline]
    fn words(dof: usize, _: u16) -> usize {
        dof
    }
}

impl<T: Scalar> Signal for ScalarSignal<T> {
    const FORMAT: Option<Format> = Some(T::FORMAT);
    fn takes(shape: Shape) -> bool {
        shape == Shape::Scalar
    }
    #[inline]
    fn words(_: usize, _: u16) -> usize {
        1
    }
}

impl<const R: u8, const C: u8, T: Scalar> Signal for Matrix<R, C, T> {
    const FORMAT: Option<Format> = Some(T::FORMAT);
    fn takes(shape: Shape) -> bool {
        shape == Shape::Matrix(R, C)
    }
    #[inline]
    fn words(_: usize, _: u16) -> usize {
        usize::from(R) * usize::from(C)
    }
}

impl<const R: u8, const C: u8, T: Scalar> MatrixSignal for Matrix<R, C, T> {
    type Value = T;
    #[inline]
    fn size(_: usize) -> (usize, usize) {
        (R.into(), C.into())
    }
}

impl<T: Scalar> Signal for Square<T> {
    const FORMAT: Option<Format> = Some(T::FORMAT);
    fn takes(shape: Shape) -> bool {
        shape == Shape::Square
    }
    #[inline]
    fn words(dof: usize, _: u16) -> usize {
        dof * dof
    }
}

impl<T: Scalar> MatrixSignal for Square<T> {
    type Value = T;
    #[inline]
    fn size(dof: usize) -> (usize, usize) {
        (dof, dof)
    }
}

impl Signal for Untyped {
    const FORMAT: Option<Format> = None;
    fn takes(_: Shape) -> bool {
        true
    }
    #[inline]
    fn words(_: usize, bound: u16) -> usize {
        bound.into()
    }
}

macro_rules! handle {
    ($name:ident, $doc:literal) => {
        #[doc = $doc]
        #[derive(Debug)]
        pub struct $name<S = Vector> {
            pub(crate) block: Block,
            signal: PhantomData<S>,
        }

        impl<S> $name<S> {
            pub(crate) const fn new(block: Block) -> Self {
                Self { block, signal: PhantomData }
            }
        }

        impl $name<Untyped> {
            /// Returns the same words as a vector, for a signal with one word per axis.
            #[must_use]
            #[inline(always)]
            pub const fn as_vector(self) -> $name {
                $name::new(self.block)
            }
        }

        impl<S> Words for $name<S> {
            const COUNT: usize = 1;

            #[inline(always)]
            fn load(words: &[Cell<u32>]) -> Self {
                Self::new(Block::from_word(u32::load(words)))
            }

            #[inline(always)]
            fn store(self, words: &[Cell<u32>]) {
                self.block.to_word().store(words);
            }
        }

        impl<S> Default for $name<S> {
            fn default() -> Self {
                Self::new(Block::FREE)
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

handle!(Input, "Handle of a signal that a module reads.");
handle!(Output, "Handle of a signal that a module writes.");

impl<S> Output<S> {
    /// Returns the last written value, even if another module wrote it: for [`begin`](crate::Module::begin)
    /// of a module that [takes over](crate::Context::takes_over). If the device's input was
    /// [limited](crate::Data::is_limited), it is the value that the device got.
    #[inline(always)]
    #[must_use]
    pub const fn last(self) -> Input<S> {
        Input::new(self.block)
    }
}

/// A module's own block of words in the Data Base, for large data.
#[derive(Debug, Clone, Copy)]
pub struct Memory {
    pub(crate) block: Block,
}

impl Memory {
    /// Returns the memory as a signal, for a module that computes a signal in it.
    #[must_use]
    pub const fn as_input(self) -> Input<Untyped> {
        Input::new(self.block)
    }
}

impl Default for Memory {
    fn default() -> Self {
        Self { block: Block::FREE }
    }
}

impl Words for Memory {
    const COUNT: usize = 1;

    #[inline(always)]
    fn load(words: &[Cell<u32>]) -> Self {
        Self { block: Block::from_word(u32::load(words)) }
    }

    #[inline(always)]
    fn store(self, words: &[Cell<u32>]) {
        self.block.to_word().store(words);
    }
}
