//! Supervision of a drive on a bus: compares its reported state with the command. Shared by all drive types.

/// State reported by a drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Says {
    /// It follows commands.
    Operational,
    /// It is off or starting.
    Ready,
    /// It ignores commands until it is cleared.
    NeedsReset,
}

/// Report of a joint in a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Shows {
    Nothing,
    /// The last state of the drive.
    State,
    /// The last state, and that the drive is silent.
    Silent,
    /// The last state, and that the drive does not follow its command.
    UnexpectedMode,
}

/// Phase of a joint and its drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Phase {
    /// Not commanded.
    Off,
    /// Commanded; clearing the drive for so many ticks.
    Clearing(u8),
    /// Commanded; waiting for so many ticks until the drive follows.
    Starting(u8),
    /// The drive follows its command.
    On,
    /// The drive does not follow; reported once.
    Refused,
}

/// Supervision of a joint and its drive.
#[derive(Debug, Clone)]
pub(crate) struct Agreement {
    missing_ticks: u8,
    starting_ticks: u8,
    silent_ticks: u8,
    phase: Phase,
}

impl Agreement {
    /// Creates the supervision: a drive may be silent for `missing_ticks`, at most 254, and must follow within
    /// `starting_ticks`.
    pub(crate) fn new(missing_ticks: u8, starting_ticks: u8) -> Self {
        Self { missing_ticks: missing_ticks.min(254), starting_ticks, silent_ticks: 0, phase: Phase::Off }
    }

    /// Checks whether the drive has been silent for too long.
    pub(crate) fn is_gone(&self) -> bool {
        self.silent_ticks > self.missing_ticks
    }

    /// Processes the state received since the last tick, if any. Call once per tick.
    pub(crate) fn read(&mut self, said: Option<Says>) -> Shows {
        self.silent_ticks = if said.is_some() { 0 } else { self.silent_ticks.saturating_add(1) };
        let was_refused = self.phase == Phase::Refused;
        self.phase = match (self.phase, said) {
            (Phase::Clearing(_), Some(Says::Operational | Says::Ready)) => Phase::Starting(0),
            (Phase::Starting(_), Some(Says::Operational)) => Phase::On,
            (Phase::Starting(_), Some(Says::NeedsReset)) => Phase::Refused,
            (Phase::On, Some(Says::Ready | Says::NeedsReset)) => Phase::Refused,
            (phase, _) => phase,
        };
        self.phase = match self.phase {
            Phase::Clearing(ticks) | Phase::Starting(ticks) if ticks == self.starting_ticks => Phase::Refused,
            Phase::Clearing(ticks) => Phase::Clearing(ticks.saturating_add(1)),
            Phase::Starting(ticks) => Phase::Starting(ticks.saturating_add(1)),
            phase => phase,
        };
        match self.phase {
            _ if was_refused || self.is_gone() => Shows::Nothing,
            _ if self.silent_ticks != 0 && self.silent_ticks == self.missing_ticks => Shows::Silent,
            Phase::Refused => Shows::UnexpectedMode,
            _ => Shows::State,
        }
    }

    /// Advances the phase by whether the joint is commanded and the last state of the drive. Call once per tick.
    pub(crate) fn command(&mut self, is_on: bool, said: Option<Says>) -> Phase {
        self.phase = match self.phase {
            _ if !is_on => Phase::Off,
            Phase::Off if said.is_none_or(|said| said == Says::NeedsReset) => Phase::Clearing(0),
            Phase::Off => Phase::Starting(0),
            phase => phase,
        };
        self.phase
    }
}
