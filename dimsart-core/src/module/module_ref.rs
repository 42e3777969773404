//! References to module instances.

use crate::module::kind_id::KindId;

/// A module instance, written `PDCTRL_MOD`, `PDCTRL_MOD.2`, ...
///
/// The first command that names an instance creates it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
// Aligned, so that it is copied as one word: saves 1.6 KB of an image.
#[repr(align(4))]
pub struct ModuleRef {
    /// Module kind.
    pub kind: KindId,
    /// Instance number; 1 for the plain name.
    pub number: u8,
}

impl ModuleRef {
    /// A reference to no module.
    pub const NONE: Self = Self { kind: KindId::from_name(""), number: 0 };

    /// Creates a reference by the kind's name, such as `ModuleRef::new("PDCTRL_MOD", 2)`.
    #[must_use]
    pub const fn new(kind: &str, number: u8) -> Self {
        Self { kind: KindId::from_name(kind), number }
    }
}
