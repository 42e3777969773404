//! References to module instances.

use crate::module::kind_id::KindId;

/// One instance of a kind of module, written `PDCTRL_MOD`, `PDCTRL_MOD.2`, ...
///
/// An instance comes into being with the first command that names it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
// Copied as one word: half as large, it takes 1.6 KB more of an image.
#[repr(align(4))]
pub struct ModuleRef {
    /// Which kind.
    pub kind: KindId,
    /// 1 for the plain name.
    pub number: u8,
}

impl ModuleRef {
    /// Refers to no module.
    pub const NONE: Self = Self { kind: KindId::of(""), number: 0 };

    /// An instance of the kind with this name, such as `ModuleRef::new("PDCTRL_MOD", 2)`; its list need not be known.
    #[must_use]
    pub const fn new(kind: &str, number: u8) -> Self {
        Self { kind: KindId::of(kind), number }
    }
}
