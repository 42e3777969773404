//! Whether a drive on a bus does what its joint is commanded: the same for every kind of drive.

/// What a drive says of itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Says {
    /// It does what it is commanded.
    Obeys,
    /// It is off, or on its way.
    Ready,
    /// It obeys nothing before it was cleared.
    Stuck,
}

/// What a joint shows of its drive in a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Shows {
    Nothing,
    /// What the drive said last.
    State,
    /// The same, and that the drive is silent.
    Silent,
    /// The same, and that the drive does something else than is commanded.
    Disobeys,
}

/// How far a joint and its drive agree.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Phase {
    /// It is not commanded.
    Off,
    /// It is commanded, and its drive has to be cleared before, for so many ticks.
    Clearing(u8),
    /// It is commanded, and its drive was not yet seen to obey, for so many ticks.
    Starting(u8),
    /// The drive does what it is commanded.
    On,
    /// It does not, and has been told of once.
    Refused,
}

/// A joint and its drive from tick to tick.
#[derive(Debug, Clone)]
pub(crate) struct Agreement {
    missing_ticks: u8,
    starting_ticks: u8,
    silent_ticks: u8,
    phase: Phase,
}

impl Agreement {
    /// A drive may be silent for `missing_ticks` in a row, 254 at most, and has `starting_ticks` until it obeys.
    pub(crate) fn new(missing_ticks: u8, starting_ticks: u8) -> Self {
        Self { missing_ticks: missing_ticks.min(254), starting_ticks, silent_ticks: 0, phase: Phase::Off }
    }

    /// Whether the drive has been silent for too long.
    pub(crate) fn is_gone(&self) -> bool {
        self.silent_ticks > self.missing_ticks
    }

    /// Once per tick, with what has come of the drive since the last one.
    pub(crate) fn read(&mut self, said: Option<Says>) -> Shows {
        self.silent_ticks = if said.is_some() { 0 } else { self.silent_ticks.saturating_add(1) };
        let was_refused = self.phase == Phase::Refused;
        self.phase = match (self.phase, said) {
            (Phase::Clearing(_), Some(Says::Obeys | Says::Ready)) => Phase::Starting(0),
            (Phase::Starting(_), Some(Says::Obeys)) => Phase::On,
            (Phase::Starting(_), Some(Says::Stuck)) => Phase::Refused,
            (Phase::On, Some(Says::Ready | Says::Stuck)) => Phase::Refused,
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
            Phase::Refused => Shows::Disobeys,
            _ => Shows::State,
        }
    }

    /// Once per tick, with what the drive said last: whether the joint is commanded decides how to go on.
    pub(crate) fn command(&mut self, is_on: bool, said: Option<Says>) -> Phase {
        self.phase = match self.phase {
            _ if !is_on => Phase::Off,
            Phase::Off if said.is_none_or(|said| said == Says::Stuck) => Phase::Clearing(0),
            Phase::Off => Phase::Starting(0),
            phase => phase,
        };
        self.phase
    }
}
