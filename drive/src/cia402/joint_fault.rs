//! Faults of a CiA 402 joint.

use core::fmt;

use super::{Cia402Abort, Cia402Emergency, Cia402State, TORQUE_MODE};

const STATE: u32 = 1024;
const SILENT: u32 = 1040;
const NO_HEARTBEAT: u32 = 1041;
const LEFT: u32 = 1042;
const MODE: u32 = 1280;
/// Factor of the abort index in a refusal; the object index is added.
const OBJECTS: u32 = 0x1_0000;

/// Fault of a joint. Its number in a signal: from 1024 the state of the drive, 1040 to 1042 bus faults, from 1280 the
/// mode of operation, from 4096 the drive's emergency, from 65536 a refused object.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cia402JointFault {
    /// Reported by the drive.
    Emergency(Cia402Emergency),
    /// Unexpected state under command, or a fault.
    State(Cia402State),
    /// Unexpected mode of operation under command.
    Mode(i8),
    /// No process data.
    Silent,
    /// No heartbeat.
    NoHeartbeat,
    /// Restarted, or left the NMT state *operational*.
    LeftOperation,
    /// Setup failed.
    Refused {
        /// Index of the refused object.
        object: u16,
        /// Reason.
        abort: Cia402Abort,
    },
}

impl Cia402JointFault {
    /// Converts the number of a signal; `None` for 0 and unknown numbers.
    #[must_use]
    pub fn from_number(number: u32) -> Option<Self> {
        let [low, high, ..] = number.to_le_bytes();
        let object = u16::from_le_bytes([low, high]);
        if let Some(place) = (number / OBJECTS).checked_sub(1) {
            return Cia402Abort::from_place(place).map(|abort| Self::Refused { object, abort });
        }
        let state = Cia402State::ALL.into_iter().zip(STATE..).find(|(_, of_state)| *of_state == number);
        match (number, state) {
            (_, Some((state, _))) => Some(Self::State(state)),
            (SILENT, _) => Some(Self::Silent),
            (NO_HEARTBEAT, _) => Some(Self::NoHeartbeat),
            (LEFT, _) => Some(Self::LeftOperation),
            (MODE..=1535, _) => Some(Self::Mode(low.cast_signed())),
            _ => Cia402Emergency::from_code(object).map(Self::Emergency),
        }
    }

    /// Returns the recommended action.
    #[must_use]
    pub fn remedy(self) -> &'static str {
        match self {
            Self::Emergency(emergency) => emergency.remedy(),
            Self::State(Cia402State::Fault | Cia402State::FaultReactionActive) => {
                "read the drive's error history, object 1003, with the manufacturer's tool"
            }
            Self::State(_) => {
                "check supply and enable inputs; make sure no other controller commands the drive"
            }
            Self::Mode(_) => {
                "make sure no other controller commands the drive; check that the drive supports mode 10"
            }
            Self::Silent => "check supply, node number, wiring, termination and bit rate",
            Self::NoHeartbeat => "check bus load and wiring",
            Self::LeftOperation => "check the drive's supply; make sure no other NMT master is on the bus",
            Self::Refused { .. } => {
                "look up this object in the drive's manual, and update the drive's firmware"
            }
        }
    }
}

impl From<Cia402JointFault> for u32 {
    /// Returns the number in a signal.
    fn from(trouble: Cia402JointFault) -> Self {
        match trouble {
            Cia402JointFault::Emergency(emergency) => emergency.code().into(),
            Cia402JointFault::State(state) => STATE + state as u32,
            Cia402JointFault::Mode(mode) => MODE + Self::from(mode.cast_unsigned()),
            Cia402JointFault::Silent => SILENT,
            Cia402JointFault::NoHeartbeat => NO_HEARTBEAT,
            Cia402JointFault::LeftOperation => LEFT,
            Cia402JointFault::Refused { object, abort } => {
                OBJECTS * (1 + Self::from(abort.place())) + Self::from(object)
            }
        }
    }
}

impl fmt::Display for Cia402JointFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Emergency(emergency) => emergency.fmt(f),
            Self::State(state) => write!(f, "unexpected state '{state}'"),
            Self::Mode(mode) => write!(f, "unexpected mode {mode} instead of {TORQUE_MODE}"),
            Self::Silent => f.write_str("no process data received"),
            Self::NoHeartbeat => f.write_str("heartbeat missing"),
            Self::LeftOperation => f.write_str("restarted, or left NMT state operational"),
            Self::Refused { object, abort } => write!(f, "refused object {object:#06x}: {abort}"),
        }
    }
}
