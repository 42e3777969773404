//! The chip on each real board, as the flashing tool names it.

/// What a tool needs to know to flash a board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Chip {
    /// The board's name: its feature.
    pub board: &'static str,
    /// Name in probe-rs, for `probe-rs run --chip NAME`.
    pub name: &'static str,
    /// The linker's memory map that images for the board are laid out by.
    pub memory_map: &'static str,
}

/// Every board that can be flashed. Emulated boards have no chip.
pub const CHIPS: &[Chip] = &[
    Chip {
        board: "nucleo-g474re",
        name: "STM32G474RETx",
        memory_map: include_str!("../memory/nucleo-g474re.x"),
    },
    Chip {
        board: "b-g431b-esc1",
        name: "STM32G431CBUx",
        memory_map: include_str!("../memory/b-g431b-esc1.x"),
    },
];
