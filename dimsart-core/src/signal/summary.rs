//! Help texts, which images omit.

/// One sentence of help for a data type, a module kind or a parameter.
///
/// Without the feature `summaries` it is empty and takes no memory. A host looks up a board's summaries by
/// name in its own list of modules.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Summary {
    #[cfg(feature = "summaries")]
    text: &'static str,
}

#[cfg(feature = "summaries")]
impl Summary {
    /// Stores the sentence.
    #[must_use]
    pub const fn new(text: &'static str) -> Self {
        Self { text: text.trim_ascii() }
    }

    /// Returns the sentence.
    #[must_use]
    pub const fn text(self) -> &'static str {
        self.text
    }
}

#[cfg(not(feature = "summaries"))]
impl Summary {
    /// Drops the sentence.
    #[inline(always)]
    #[must_use]
    pub const fn new(_: &'static str) -> Self {
        Self {}
    }

    /// Returns an empty text.
    #[must_use]
    pub const fn text(self) -> &'static str {
        ""
    }
}
