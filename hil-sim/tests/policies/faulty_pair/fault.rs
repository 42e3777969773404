//! Faults at one side of a pair.

/// A fault of an axis sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Shows {
    /// This, whatever the position is.
    This(f32),
    /// So much more than the position, m.
    More(f32),
    /// Reading of the previous tick.
    Stuck,
    /// More than the position by so much in each tick, m.
    Drift(f32),
}

/// Output of a failing module.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Writes {
    /// No number.
    Nan,
    /// A number without bound.
    Infinity,
    /// A finite number that no signal of a scheme can be.
    Large,
}

/// A fault of a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Line {
    /// Nothing for so many ticks.
    Silent(u32),
    /// Every packet, or every other one, with wrong bits.
    Damaged {
        /// Ticks from one of these packets to the next.
        every: u32,
    },
    /// The last packet, over and over.
    Repeats,
    /// Every packet twice.
    Doubles,
}

/// Something that goes wrong at one side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Fault {
    /// Nothing: to compare with.
    None,
    /// The sensor of an axis.
    Sensor(Shows),
    /// The frame of the sensors has a word less.
    ShortFrame,
    /// It has a word more.
    LongFrame,
    /// The actuator of an axis gives what it gave in the tick before.
    ActuatorStuck,
    /// The module that can fail in one of three places writes something: behind the receiver (1), before the device (2)
    /// or before the sender (3).
    Writes(u8, Writes),
    /// Calls of a module take so many per cent longer than it costs.
    TakesLonger(&'static str, u32),
    /// The line to it.
    Line(Line),
    /// Its client renews the lease no more.
    LeaseNotRenewed,
}

impl Fault {
    /// What is to be named when it is noticed, where it is known.
    pub(crate) fn named(self, axis: usize) -> Option<String> {
        Some(match self {
            Self::Sensor(_) => format!("POSITION of axis {axis}"),
            Self::Writes(1, _) => "FAILING_MOD".to_owned(),
            Self::Writes(number, _) => format!("FAILING_MOD.{number}"),
            Self::TakesLonger(module, _) => module.to_owned(),
            Self::Line(_) => "link 0".to_owned(),
            Self::None | Self::ShortFrame | Self::LongFrame | Self::ActuatorStuck | Self::LeaseNotRenewed => {
                return None;
            }
        })
    }
}

/// A fault that lasts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Wrong {
    /// The fault.
    pub(crate) fault: Fault,
    /// The axis that it is about, if it is about one.
    pub(crate) axis: usize,
    /// Ticks that it has lasted.
    pub(crate) ticks: u32,
    /// Ticks after which it ends by itself.
    pub(crate) end_ticks: u32,
}
