//! Why a joint does not do what it is commanded.

use core::fmt;

use super::{Cia402Abort, Cia402Emergency, Cia402State};

const STATE: u32 = 1024;
const SILENT: u32 = 1040;
const NO_HEARTBEAT: u32 = 1041;
const LEFT: u32 = 1042;
const MODE: u32 = 1280;
/// Of a refusal, behind its place in the list.
const OBJECTS: u32 = 0x1_0000;

/// What is wrong with a joint. As a signal it is a number: 1024 and more the state that the drive is in, 1040 to 1042 what is
/// wrong on the bus, 1280 and more the mode of operation, 4096 and more the drive's emergency, 65536 and more a refusal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cia402Trouble {
    /// The drive says so itself.
    Emergency(Cia402Emergency),
    /// It is in this state, under command or with a fault.
    State(Cia402State),
    /// It is in this mode of operation under command.
    Mode(i8),
    /// It says nothing in a tick.
    Silent,
    /// Its heartbeat stayed away.
    NoHeartbeat,
    /// It was started anew, or left the network state *operational*.
    LeftOperation,
    /// It cannot be set up.
    Refused {
        /// Index of the object that it refused.
        object: u16,
        /// Why.
        abort: Cia402Abort,
    },
}

impl Cia402Trouble {
    /// Of a number that a signal has; none for 0, and for what has no name.
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

    /// What to do about it.
    #[must_use]
    pub fn remedy(self) -> &'static str {
        match self {
            Self::Emergency(emergency) => emergency.remedy(),
            Self::State(Cia402State::Fault | Cia402State::FaultReactionActive) => {
                "look at its history of errors, object 1003, with its maker's program"
            }
            Self::State(_) => "look at its supply and its enabling inputs, and let nobody else command it",
            Self::Mode(_) => "let nobody else command it, and see whether it has the mode 10",
            Self::Silent => "look at its supply, its node number, the bus's wires, termination and bit rate",
            Self::NoHeartbeat => "look at the bus's load and wires",
            Self::LeftOperation => "look at its supply, and let nobody else manage the network",
            Self::Refused { .. } => "see its manual for this object, and whether its firmware is up to date",
        }
    }
}

impl From<Cia402Trouble> for u32 {
    /// As a signal has it.
    fn from(trouble: Cia402Trouble) -> Self {
        match trouble {
            Cia402Trouble::Emergency(emergency) => emergency.code().into(),
            Cia402Trouble::State(state) => STATE + state as u32,
            Cia402Trouble::Mode(mode) => MODE + Self::from(mode.cast_unsigned()),
            Cia402Trouble::Silent => SILENT,
            Cia402Trouble::NoHeartbeat => NO_HEARTBEAT,
            Cia402Trouble::LeftOperation => LEFT,
            Cia402Trouble::Refused { object, abort } => {
                OBJECTS * (1 + Self::from(abort.place())) + Self::from(object)
            }
        }
    }
}

impl fmt::Display for Cia402Trouble {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Emergency(emergency) => emergency.fmt(f),
            Self::State(state) => write!(f, "it is {state}"),
            Self::Mode(mode) => write!(f, "under command it is in mode {mode}"),
            Self::Silent => f.write_str("it says nothing"),
            Self::NoHeartbeat => f.write_str("its heartbeat stays away"),
            Self::LeftOperation => f.write_str("it was started anew, or is not operational"),
            Self::Refused { object, abort } => write!(f, "it refused object {object:#06x}: {abort}"),
        }
    }
}
