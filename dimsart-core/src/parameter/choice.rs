//! Sets of names that a parameter can take.

/// A set of names a parameter can take, each standing for a value of the module's own enum; made by
/// [`choice!`](crate::choice). The first one is the default.
pub trait Choice: Copy {
    /// Their names, `UPPER_CASE`.
    const NAMES: &'static [&'static str];

    /// The value of a name, by its place; the first one for a place that no name has.
    fn from_index(index: u32) -> Self;

    /// Place of its name.
    fn index(self) -> u32;
}

/// Makes a set of names that a parameter can take, the first one its default; see [`Choice`](crate::Choice).
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
