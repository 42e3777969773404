//! One sentence for help texts, which an image leaves out.

/// One sentence for help texts, of a data type, a kind of module or a parameter.
///
/// Without the feature `summaries` it is empty and takes no memory: an image goes without, and a host looks a
/// board's summaries up by their names in its own list of modules.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Summary {
    #[cfg(feature = "summaries")]
    text: &'static str,
}

#[cfg(feature = "summaries")]
impl Summary {
    /// This sentence.
    #[must_use]
    pub const fn new(text: &'static str) -> Self {
        Self { text: text.trim_ascii() }
    }

    /// The sentence.
    #[must_use]
    pub const fn text(self) -> &'static str {
        self.text
    }
}

#[cfg(not(feature = "summaries"))]
impl Summary {
    /// Nothing of the sentence.
    #[inline(always)]
    #[must_use]
    pub const fn new(_: &'static str) -> Self {
        Self {}
    }

    /// Empty.
    #[must_use]
    pub const fn text(self) -> &'static str {
        ""
    }
}
