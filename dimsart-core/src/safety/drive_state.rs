//! Drive states of CiA 402 (IEC 61800-7-201).

/// State of a drive. The values are the state bits in the low byte of the CiA 402 statusword.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum DriveState {
    /// No device is connected.
    NotReadyToSwitchOn = 0x00,
    /// The device gets its safe value: motion is not allowed, or no scheme runs.
    SwitchOnDisabled = 0x40,
    /// As [`SwitchOnDisabled`](Self::SwitchOnDisabled), while being enabled.
    ReadyToSwitchOn = 0x21,
    /// As [`ReadyToSwitchOn`](Self::ReadyToSwitchOn).
    SwitchedOn = 0x23,
    /// The scheme commands the device.
    OperationEnabled = 0x27,
    /// Motion is no longer allowed: the device is moving to its safe value.
    QuickStopActive = 0x07,
    /// After a fault: the device is moving to its safe value.
    FaultReactionActive = 0x0F,
    /// A fault is latched: the device has its safe value until a reset.
    Fault = 0x08,
}

/// Event that changes a [`DriveState`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DriveEvent {
    /// A device is connected.
    Initialized,
    /// Become ready to switch on.
    Shutdown,
    /// Switch on.
    SwitchOn,
    /// Let the scheme command the device.
    EnableOperation,
    /// Stop commanding the device.
    DisableOperation,
    /// Apply the safe value at once.
    DisableVoltage,
    /// Move to the safe value.
    QuickStop,
    /// The safe value is reached.
    Stopped,
    /// A fault has occurred.
    Fault,
    /// Reset the fault.
    FaultReset,
}

impl DriveState {
    /// All states.
    pub const ALL: [Self; 8] = [
        Self::NotReadyToSwitchOn,
        Self::SwitchOnDisabled,
        Self::ReadyToSwitchOn,
        Self::SwitchedOn,
        Self::OperationEnabled,
        Self::QuickStopActive,
        Self::FaultReactionActive,
        Self::Fault,
    ];

    /// Returns the next state; none if the event has no effect in this state. Implements transitions 0 to 16
    /// of CiA 402 (0 and 1 combined: connecting the device includes its self-test).
    #[must_use]
    pub const fn transition(self, event: DriveEvent) -> Option<Self> {
        use DriveEvent as On;
        Some(match (self, event) {
            // 0, 1
            (Self::NotReadyToSwitchOn, On::Initialized) => Self::SwitchOnDisabled,
            // 2, 6, 8
            (Self::SwitchOnDisabled | Self::SwitchedOn | Self::OperationEnabled, On::Shutdown) => {
                Self::ReadyToSwitchOn
            }
            // 3, 5
            (Self::ReadyToSwitchOn, On::SwitchOn) | (Self::OperationEnabled, On::DisableOperation) => {
                Self::SwitchedOn
            }
            // 4, 16
            (Self::SwitchedOn | Self::QuickStopActive, On::EnableOperation) => Self::OperationEnabled,
            // 7, 9, 10, 12
            (
                Self::ReadyToSwitchOn | Self::SwitchedOn | Self::OperationEnabled | Self::QuickStopActive,
                On::DisableVoltage,
            )
            | (Self::ReadyToSwitchOn | Self::SwitchedOn, On::QuickStop)
            | (Self::QuickStopActive, On::Stopped) => Self::SwitchOnDisabled,
            // 11
            (Self::OperationEnabled, On::QuickStop) => Self::QuickStopActive,
            // 13
            (Self::Fault | Self::FaultReactionActive, On::Fault) => return None,
            (_, On::Fault) => Self::FaultReactionActive,
            // 14
            (Self::FaultReactionActive, On::Stopped) => Self::Fault,
            // 15
            (Self::Fault, On::FaultReset) => Self::SwitchOnDisabled,
            _ => return None,
        })
    }

    /// Returns whether a fault is latched.
    #[must_use]
    pub const fn is_fault(self) -> bool {
        matches!(self, Self::FaultReactionActive | Self::Fault)
    }

    /// Returns the name, for reports.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::NotReadyToSwitchOn => "not ready to switch on",
            Self::SwitchOnDisabled => "switch on disabled",
            Self::ReadyToSwitchOn => "ready to switch on",
            Self::SwitchedOn => "switched on",
            Self::OperationEnabled => "operation enabled",
            Self::QuickStopActive => "quick stop active",
            Self::FaultReactionActive => "fault reaction active",
            Self::Fault => "fault",
        }
    }
}
