//! What tools need to know of a board to build, check and flash its images.

/// A board as it is registered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BoardInfo {
    /// Its name: its feature, and that of its files.
    pub name: &'static str,
    /// The linker's memory map that images for the board are laid out by.
    pub memory_map: &'static str,
    /// What tools need beyond that.
    pub tooling: Tooling,
}

/// What is registered of a board beside its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Tooling {
    /// Name of the chip in probe-rs, for `probe-rs run --chip NAME`; none for an emulated board.
    pub chip: Option<&'static str>,
    /// What the plain image may take; none for an emulated board: it has room. A variant has all of the chip's memory.
    pub budget: Option<Size>,
    /// Features that make further images of it, next to the plain one.
    pub variants: &'static [&'static str],
}

/// Bytes of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Size {
    /// Code and data, as they lie in flash.
    pub flash: u64,
    /// Variables; the stack is apart.
    pub ram: u64,
}
