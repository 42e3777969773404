//! Which pins of a board's chip an image uses, and for what: a plan per board, or per variant of its image.

/// What an image has a board's pins for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PinPlan {
    /// Variants of the image that it holds for; the plain one is the empty name.
    pub variants: &'static [&'static str],
    /// All its pins, those that belong together side by side.
    pub groups: &'static [PinGroup],
}

/// Pins that belong together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PinGroup {
    /// What they are for.
    pub title: &'static str,
    /// The pins.
    pub pins: &'static [Pin],
}

/// A pin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pin {
    /// Its name, as `PA8`.
    pub name: &'static str,
    /// How the chip has it.
    pub mode: PinMode,
    /// Which way its signal goes.
    pub direction: PinDirection,
    /// What it carries.
    pub signal: &'static str,
    /// Connector and label on the board, as far as they are known.
    pub at: &'static str,
    /// What else is to be known; empty where there is nothing.
    pub note: &'static str,
    /// What an oscilloscope shows; empty where nothing helps.
    pub scope: &'static str,
    /// Whether it is set only where the configuration asks for it, such as an encoder's.
    pub is_by_configuration: bool,
}

/// How a chip has a pin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PinMode {
    /// A peripheral's, by the number of its alternate function.
    Alternate(u8),
    /// The program's, to be driven.
    Output,
    /// A converter's or an amplifier's.
    Analog,
}

/// Which way a signal goes, seen from the chip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PinDirection {
    /// Into the chip.
    In,
    /// Out of it.
    Out,
    /// Both.
    Both,
}

impl Pin {
    /// A peripheral's input.
    pub(crate) const fn input(
        name: &'static str,
        function: u8,
        signal: &'static str,
        at: &'static str,
    ) -> Self {
        Self {
            name,
            mode: PinMode::Alternate(function),
            direction: PinDirection::In,
            signal,
            at,
            note: "",
            scope: "",
            is_by_configuration: false,
        }
    }

    /// A peripheral's output.
    pub(crate) const fn output(
        name: &'static str,
        function: u8,
        signal: &'static str,
        at: &'static str,
    ) -> Self {
        Self { direction: PinDirection::Out, ..Self::input(name, function, signal, at) }
    }

    /// An output of the program.
    pub(crate) const fn driven(name: &'static str, signal: &'static str, at: &'static str) -> Self {
        Self { mode: PinMode::Output, ..Self::output(name, 0, signal, at) }
    }

    /// What is measured.
    pub(crate) const fn analog(name: &'static str, signal: &'static str, at: &'static str) -> Self {
        Self { mode: PinMode::Analog, ..Self::input(name, 0, signal, at) }
    }

    /// Set only where the configuration asks for it.
    pub(crate) const fn by_configuration(self) -> Self {
        Self { is_by_configuration: true, ..self }
    }

    /// With something else to be known.
    pub(crate) const fn noting(self, note: &'static str) -> Self {
        Self { note, ..self }
    }

    /// With what an oscilloscope shows.
    pub(crate) const fn showing(self, scope: &'static str) -> Self {
        Self { scope, ..self }
    }
}

/// What an oscilloscope shows at pins that boards have in common.
pub(crate) const QUADRATURE: &str =
    "high when nothing is connected; while the shaft turns square waves, B a quarter of a period from A";
pub(crate) const HEARTBEATS: &str = "high; a burst of bytes ten times a second";
pub(crate) const RECESSIVE: &str =
    "high, with frames while the scheme runs; again and again the same one where nobody acknowledges";

/// The debug port, as every chip has it after a reset.
pub(crate) const DEBUG_PORT: PinGroup = PinGroup {
    title: "Debug port",
    pins: &[
        Pin { direction: PinDirection::Both, ..Pin::input("PA13", 0, "SWDIO", "ST-LINK") },
        Pin::input("PA14", 0, "SWCLK", "ST-LINK"),
    ],
};
