//! Choices: parameters with named values.

/// A set of names for the values of a module's own enum; declared by [`choice!`](crate::choice). The first
/// name is the default.
pub trait Choice: Copy {
    /// Names, `UPPER_CASE`.
    const NAMES: &'static [&'static str];

    /// Returns the value at an index; the first one if the index is out of range.
    fn from_index(index: u32) -> Self;

    /// Returns the index of the value.
    fn index(self) -> u32;
}

/// Declares an enum of named values, the first of which is the default; see [`Choice`](crate::Choice).
#[macro_export]
macro_rules! choice {
    ($(#[$meta:meta])* $visibility:vis enum $name:ident {
        $(#[$first_meta:meta])* $first:ident = $first_text:literal
        $(, $(#[$variant_meta:meta])* $variant:ident = $text:literal)* $(,)?
    }) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
        $visibility enum $name {
            #[doc = concat!("`", $first_text, "`")] $(#[$first_meta])* #[default] $first
            $(, #[doc = concat!("`", $text, "`")] $(#[$variant_meta])* $variant)*
        }

        impl $crate::Choice for $name {
            const NAMES: &'static [&'static str] = &[$first_text $(, $text)*];

            #[inline(always)]
            fn from_index(index: u32) -> Self {
                $(if index == Self::$variant as u32 { return Self::$variant; })*
                Self::$first
            }

            #[inline(always)]
            fn index(self) -> u32 {
                self as u32
            }
        }

        impl $crate::Words for $name {
            const COUNT: usize = 1;

            #[inline(always)]
            fn load(words: &[::core::cell::Cell<u32>]) -> Self {
                $crate::Choice::from_index(<u32 as $crate::Words>::load(words))
            }

            #[inline(always)]
            fn store(self, words: &[::core::cell::Cell<u32>]) {
                $crate::Words::store($crate::Choice::index(self), words);
            }
        }
    };
}
