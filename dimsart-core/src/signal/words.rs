//! Values stored in words of the Data Base.
//!
//! Parameters, state and handles of a module are stored in words of the Data Base, so an instance needs only
//! the memory of its own kind. [`words!`](crate::words!) declares a struct of such values,
//! [`choice!`](crate::choice!) a set of names.

use core::cell::Cell;

use crate::signal::word::{Scalar, Word};

/// A value of [`COUNT`](Self::COUNT) words. All zero is the initial state of a module.
pub trait Words: Copy {
    /// Number of words.
    const COUNT: usize;
    /// Reads the value; missing words count as zero.
    fn load(words: &[Cell<u32>]) -> Self;
    /// Writes the value; words beyond the end are dropped.
    fn store(self, words: &[Cell<u32>]);
}

/// Reads the value at the start of `words` and advances `words` past it.
#[inline(always)]
#[must_use]
pub fn read_next<T: Words>(words: &mut &[Cell<u32>]) -> T {
    let (own, behind) = words.split_at_checked(T::COUNT).unwrap_or((words, &[]));
    *words = behind;
    T::load(own)
}

/// Writes the value at the start of `words` and advances `words` past it.
#[inline(always)]
pub fn write_next<T: Words>(value: T, words: &mut &[Cell<u32>]) {
    let (own, behind) = words.split_at_checked(T::COUNT).unwrap_or((&[], &[]));
    *words = behind;
    value.store(own);
}

impl<T: Scalar> Words for T {
    const COUNT: usize = 1;

    #[inline(always)]
    fn load(words: &[Cell<u32>]) -> Self {
        Self::from_word(Word(words.first().map_or(0, Cell::get)))
    }

    #[inline(always)]
    fn store(self, words: &[Cell<u32>]) {
        if let Some(word) = words.first() {
            word.set(self.into_word().0);
        }
    }
}

impl Words for u16 {
    const COUNT: usize = 1;

    #[inline(always)]
    fn load(words: &[Cell<u32>]) -> Self {
        let [low, high, ..] = u32::load(words).to_le_bytes();
        Self::from_le_bytes([low, high])
    }

    #[inline(always)]
    fn store(self, words: &[Cell<u32>]) {
        u32::from(self).store(words);
    }
}

impl Words for () {
    const COUNT: usize = 0;

    #[inline(always)]
    fn load(_: &[Cell<u32>]) -> Self {}

    #[inline(always)]
    fn store(self, _: &[Cell<u32>]) {}
}

impl<A: Words, B: Words> Words for (A, B) {
    const COUNT: usize = A::COUNT + B::COUNT;

    #[inline(always)]
    fn load(mut words: &[Cell<u32>]) -> Self {
        (read_next(&mut words), read_next(&mut words))
    }

    #[inline(always)]
    fn store(self, mut words: &[Cell<u32>]) {
        write_next(self.0, &mut words);
        write_next(self.1, &mut words);
    }
}

impl<T: Words, const N: usize> Words for [T; N] {
    const COUNT: usize = N * T::COUNT;

    #[inline(always)]
    fn load(mut words: &[Cell<u32>]) -> Self {
        // A plain loop: `array::from_fn` is slower where code is optimised for size.
        let mut values = [T::load(&[]); N];
        for value in &mut values {
            *value = read_next(&mut words);
        }
        values
    }

    #[inline(always)]
    fn store(self, mut words: &[Cell<u32>]) {
        for value in self {
            write_next(value, &mut words);
        }
    }
}

/// Declares structs whose values are stored in words of the Data Base.
///
/// `struct` declares state. In `parameters` each field names a method of [`Parameters`](crate::Parameters),
/// and its doc comment is the help text; a field without a method is computed in
/// [`prepare`](crate::Module::prepare). In `ports` each field names a method of [`Declarations`](crate::Declarations);
/// a handle without one reads as zero until [`ports`](crate::Module::ports) declares it.
///
/// ```
/// use dimsart_core::{Input, Output, Unit, types, words};
///
/// words! {
///     pub parameters Gains {
///         /// Derivative gain.
///         damping: f32 = per_axis("D_PARAM", Unit::Damping, 0.0..=1e4, 0.0),
///         damping_per_tick: f32,
///     }
///     pub struct AxisState { previous_error: f32 }
///     pub ports Ports {
///         position: Input = input("POSITION", types::POSITION),
///         force: Output = output("DES_FORCE", types::DES_FORCE),
///     }
/// }
/// ```
#[macro_export]
macro_rules! words {
    () => {};
    ($(#[$meta:meta])* $visibility:vis struct $name:ident {
        $($(#[$field_meta:meta])* $field_visibility:vis $field:ident: $type:ty),* $(,)?
    } $($rest:tt)*) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, Default)]
        $visibility struct $name { $($(#[$field_meta])* $field_visibility $field: $type),* }

        impl $crate::Words for $name {
            const COUNT: usize = 0 $(+ <$type as $crate::Words>::COUNT)*;

            #[inline(always)]
            fn load(mut words: &[::core::cell::Cell<u32>]) -> Self {
                Self { $($field: $crate::words::read_next(&mut words)),* }
            }

            #[inline(always)]
            fn store(self, mut words: &[::core::cell::Cell<u32>]) {
                $($crate::words::write_next(self.$field, &mut words);)*
            }
        }

        $crate::words! { $($rest)* }
    };
    ($(#[$meta:meta])* $visibility:vis parameters $name:ident { $($fields:tt)* } $($rest:tt)*) => {
        $crate::parameters! { $(#[$meta])* $visibility struct $name { $($fields)* } }
        $crate::words! { $($rest)* }
    };
    ($(#[$meta:meta])* $visibility:vis ports $name:ident { $($fields:tt)* } $($rest:tt)*) => {
        $crate::ports! { $(#[$meta])* $visibility struct $name { $($fields)* } }
        $crate::words! { $($rest)* }
    };
}
