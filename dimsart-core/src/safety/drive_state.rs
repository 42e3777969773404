//! The states of a drive, as CiA 402 (IEC 61800-7-201) names them.

/// What a drive is in. The numbers are those of the low byte of CiA 402's statusword, without the bits that are not
/// about the state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum DriveState {
    /// There is no device yet.
    NotReadyToSwitchOn = 0x00,
    /// The device gets its safe value: motion is not allowed, or no scheme runs.
    SwitchOnDisabled = 0x40,
    /// As [`SwitchOnDisabled`](Self::SwitchOnDisabled), on the way to be enabled.
    ReadyToSwitchOn = 0x21,
    /// The same.
    SwitchedOn = 0x23,
    /// The scheme commands the device.
    OperationEnabled = 0x27,
    /// Motion is not allowed any more: the device is on its way to its safe value.
    QuickStopActive = 0x07,
    /// Something has failed: the device is on its way to its safe value.
    FaultReactionActive = 0x0F,
    /// Something has failed, and the device has its safe value until a reset.
    Fault = 0x08,
}

/// What changes a [`DriveState`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DriveEvent {
    /// A device is there.
    Initialized,
    /// To be ready to switch on.
    Shutdown,
    /// To be switched on.
    SwitchOn,
    /// The scheme is to command the device.
    EnableOperation,
    /// The scheme is not to command it any more.
    DisableOperation,
    /// The device is to get its safe value at once.
    DisableVoltage,
    /// The device is to go to its safe value.
    QuickStop,
    /// It has its safe value.
    Stopped,
    /// Something has failed.
    Fault,
    /// A fault is over.
    FaultReset,
}

impl DriveState {
    /// Every state.
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

    /// The state that an event leads to; none where it changes nothing. There are the transitions 0 to 16 of CiA 402 and
    /// none other (0 and 1 are one: a device that is there has passed its own test).
    #[must_use]
    pub const fn after(self, event: DriveEvent) -> Option<Self> {
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

    /// Whether something has failed and waits for a reset.
    #[must_use]
    pub const fn is_fault(self) -> bool {
        matches!(self, Self::FaultReactionActive | Self::Fault)
    }

    /// Its name, for reports.
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
