//! Pin assignment of a board's chip: a plan per board or variant of its image.

/// Pin assignment of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PinPlan {
    /// Variants of the image; the default image has an empty name.
    pub variants: &'static [&'static str],
    /// Groups of related pins.
    pub groups: &'static [PinGroup],
}

/// Related pins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PinGroup {
    /// Purpose.
    pub title: &'static str,
    /// The pins.
    pub pins: &'static [Pin],
}

/// A pin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pin {
    /// Name, such as `PA8`.
    pub name: &'static str,
    /// Function on the chip.
    pub mode: PinMode,
    /// Direction of the signal.
    pub direction: PinDirection,
    /// Signal.
    pub signal: &'static str,
    /// Connector and label on the board, if known.
    pub at: &'static str,
    /// Note, or empty.
    pub note: &'static str,
    /// Signal on an oscilloscope, or empty.
    pub scope: &'static str,
    /// Whether the pin depends on the configuration, such as the encoder type.
    pub depends_on_configuration: bool,
}

/// Function of a pin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PinMode {
    /// Alternate function, with its number.
    Alternate(u8),
    /// General-purpose output.
    Output,
    /// Analog.
    Analog,
}

/// Direction of a signal, seen from the chip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PinDirection {
    /// Input.
    In,
    /// Output.
    Out,
    /// Bidirectional.
    Both,
}

impl Pin {
    /// Creates an input of a peripheral.
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
            depends_on_configuration: false,
        }
    }

    /// Creates an output of a peripheral.
    pub(crate) const fn output(
        name: &'static str,
        function: u8,
        signal: &'static str,
        at: &'static str,
    ) -> Self {
        Self { direction: PinDirection::Out, ..Self::input(name, function, signal, at) }
    }

    /// Creates a general-purpose output.
    pub(crate) const fn driven(name: &'static str, signal: &'static str, at: &'static str) -> Self {
        Self { mode: PinMode::Output, ..Self::output(name, 0, signal, at) }
    }

    /// Creates an analog input.
    pub(crate) const fn analog(name: &'static str, signal: &'static str, at: &'static str) -> Self {
        Self { mode: PinMode::Analog, ..Self::input(name, 0, signal, at) }
    }

    /// Marks the pin as dependent on the configuration.
    pub(crate) const fn by_configuration(self) -> Self {
        Self { depends_on_configuration: true, ..self }
    }

    /// Adds a note.
    pub(crate) const fn noting(self, note: &'static str) -> Self {
        Self { note, ..self }
    }

    /// Adds the signal on an oscilloscope.
    pub(crate) const fn showing(self, scope: &'static str) -> Self {
        Self { scope, ..self }
    }
}

/// Signals on an oscilloscope common to several boards.
pub(crate) const QUADRATURE: &str = "high when open; square waves while the shaft turns, A and B 90° apart";
pub(crate) const HEARTBEATS: &str = "high; a burst of bytes ten times per second";
pub(crate) const RECESSIVE: &str =
    "high; frames while the scheme runs, the same frame repeated if no node acknowledges";

/// The debug port, the default of every chip after reset.
pub(crate) const DEBUG_PORT: PinGroup = PinGroup {
    title: "Debug port",
    pins: &[
        Pin { direction: PinDirection::Both, ..Pin::input("PA13", 0, "SWDIO", "ST-LINK") },
        Pin::input("PA14", 0, "SWCLK", "ST-LINK"),
    ],
};
