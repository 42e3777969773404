//! State machine of a drive: statusword and controlword.

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
    /// Not defined by the standard.
    Unknown,
}

/// Command of a controlword.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "the standard's names")]
pub enum Cia402Command {
    DisableVoltage,
    QuickStop,
    Shutdown,
    SwitchOn,
    EnableOperation,
    /// Takes effect on the rising edge of its bit.
    FaultReset,
}

impl Cia402Command {
    /// Returns the value for object 6040.
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
    /// All states, by their number in a signal.
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

    /// Decodes object 6041.
    #[must_use]
    pub fn from_statusword(statusword: u16) -> Self {
        // The quick stop bit, 0x20, is undefined in some states.
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

    /// Returns the command that leads one state closer to *operation enabled*; a fault must be reset first.
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
            Self::Unknown => "unknown",
        })
    }
}
