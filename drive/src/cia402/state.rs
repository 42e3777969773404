//! The state machine of a drive as its statusword shows it, and what leads through it.

use core::fmt;

/// State of a drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "the standard's names")]
pub enum Cia402State {
    NotReadyToSwitchOn,
    SwitchOnDisabled,
    ReadyToSwitchOn,
    SwitchedOn,
    OperationEnabled,
    QuickStopActive,
    FaultReactionActive,
    Fault,
    /// None that the standard has.
    Unknown,
}

/// What a controlword commands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "the standard's names")]
pub enum Cia402Command {
    DisableVoltage,
    QuickStop,
    Shutdown,
    SwitchOn,
    EnableOperation,
    /// It is obeyed as its bit rises.
    FaultReset,
}

impl Cia402Command {
    /// For object 6040.
    #[must_use]
    pub fn controlword(self) -> u16 {
        match self {
            Self::DisableVoltage => 0x00,
            Self::QuickStop => 0x02,
            Self::Shutdown => 0x06,
            Self::SwitchOn => 0x07,
            Self::EnableOperation => 0x0f,
            Self::FaultReset => 0x80,
        }
    }
}

impl Cia402State {
    /// All, by their number as part of a signal.
    pub(super) const ALL: [Self; 9] = [
        Self::NotReadyToSwitchOn,
        Self::SwitchOnDisabled,
        Self::ReadyToSwitchOn,
        Self::SwitchedOn,
        Self::OperationEnabled,
        Self::QuickStopActive,
        Self::FaultReactionActive,
        Self::Fault,
        Self::Unknown,
    ];

    /// Of object 6041.
    #[must_use]
    pub fn from_statusword(statusword: u16) -> Self {
        // In some states the bit of quick stop, 0x20, says nothing.
        match (statusword & 0x4f, statusword & 0x20) {
            (0x00, _) => Self::NotReadyToSwitchOn,
            (0x40, _) => Self::SwitchOnDisabled,
            (0x01, 0x20) => Self::ReadyToSwitchOn,
            (0x03, 0x20) => Self::SwitchedOn,
            (0x07, 0x20) => Self::OperationEnabled,
            (0x07, _) => Self::QuickStopActive,
            (0x0f, _) => Self::FaultReactionActive,
            (0x08, _) => Self::Fault,
            _ => Self::Unknown,
        }
    }

    /// What leads on to *operation enabled*, a state at a time; a fault has to be reset before.
    #[must_use]
    pub fn next_command(self) -> Cia402Command {
        match self {
            Self::SwitchOnDisabled => Cia402Command::Shutdown,
            Self::ReadyToSwitchOn => Cia402Command::SwitchOn,
            Self::SwitchedOn | Self::OperationEnabled => Cia402Command::EnableOperation,
            _ => Cia402Command::DisableVoltage,
        }
    }
}

impl fmt::Display for Cia402State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotReadyToSwitchOn => "not ready to switch on",
            Self::SwitchOnDisabled => "switch on disabled",
            Self::ReadyToSwitchOn => "ready to switch on",
            Self::SwitchedOn => "switched on",
            Self::OperationEnabled => "operation enabled",
            Self::QuickStopActive => "quick stop active",
            Self::FaultReactionActive => "fault reaction active",
            Self::Fault => "fault",
            Self::Unknown => "in a state that is unknown here",
        })
    }
}
