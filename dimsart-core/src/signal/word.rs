//! A 32-bit word of the Data Base and its formats.

/// Format of a 32-bit word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Format {
    /// IEEE 754 single precision.
    F32,
    /// Signed integer.
    I32,
    /// Unsigned integer.
    U32,
    /// `0` is false, any other value true.
    Bool,
}

/// The bits of one value; the data type's [`Format`] defines their meaning.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(transparent)]
pub struct Word(pub u32);

impl Word {
    /// Returns whether the word is valid in `format`: an `f32` must be finite.
    #[must_use]
    pub fn is_valid(self, format: Format) -> bool {
        format != Format::F32 || f32::from_bits(self.0).is_finite()
    }
}

/// A Rust type that fits one word.
pub trait Scalar: Copy + Default {
    /// Format in the Data Base.
    const FORMAT: Format;
    /// Converts from a word.
    fn from_word(word: Word) -> Self;
    /// Converts to a word.
    fn into_word(self) -> Word;
}

impl Scalar for f32 {
    const FORMAT: Format = Format::F32;
    #[inline]
    fn from_word(word: Word) -> Self {
        Self::from_bits(word.0)
    }
    #[inline]
    fn into_word(self) -> Word {
        Word(self.to_bits())
    }
}

impl Scalar for i32 {
    const FORMAT: Format = Format::I32;
    #[inline]
    fn from_word(word: Word) -> Self {
        word.0.cast_signed()
    }
    #[inline]
    fn into_word(self) -> Word {
        Word(self.cast_unsigned())
    }
}

impl Scalar for u32 {
    const FORMAT: Format = Format::U32;
    #[inline]
    fn from_word(word: Word) -> Self {
        word.0
    }
    #[inline]
    fn into_word(self) -> Word {
        Word(self)
    }
}

impl Scalar for bool {
    const FORMAT: Format = Format::Bool;
    #[inline]
    fn from_word(word: Word) -> Self {
        word.0 != 0
    }
    #[inline]
    fn into_word(self) -> Word {
        Word(u32::from(self))
    }
}

impl<T: Scalar> From<T> for Word {
    #[inline]
    fn from(value: T) -> Self {
        value.into_word()
    }
}
