//! A drive as a joint of a controller that ticks.

use super::{MoteusAddress, MoteusFrame, MoteusMode, MoteusReplyError, MoteusState, MoteusTrouble};

/// Ticks that a drive has from its first command until it is under torque: it makes itself ready for some milliseconds.
const STARTING_TICKS: u8 = 50;

/// One drive: a frame to it in every tick, and what its replies say.
///
/// ```text
///   tick: read ─▶ scheme ─▶ safety stage ─▶ frame ─▶ bus ─▶ drive
///         receive ◀────────────────────────────────  bus ◀──┘     until the next tick
/// ```
/// The frame of a tick commands and asks; its reply is read in the next one. So a controller sees the joint as it was when
/// it took the last command, a tick before it takes the one that comes of it.
///
/// | Drive | What is read |
/// |---|---|
/// | replies, and does what it is commanded | the reply |
/// | has not replied for fewer than `missing_ticks` | its last reply |
/// | does not reply, or went off or does something else under command | once more, with the [trouble](MoteusTrouble); then nothing but NaN |
/// | is not commanded | the reply, with the drive's fault |
///
/// A safety stage refuses what is no number, and so stops what is left of the robot; the tick before has told it why. A
/// joint that is off has its drive stopped in every tick, but for one with a fault: that keeps it, to be seen, until the
/// joint is commanded again. Then a stop comes first, and clears it, once.
#[derive(Debug, Clone)]
pub struct MoteusJoint {
    address: MoteusAddress,
    timeout_s: f32,
    missing_ticks: u8,
    /// By the last reply.
    state: Option<MoteusState>,
    /// Whether a reply has come since the last tick.
    has_replied: bool,
    silent_ticks: u8,
    phase: Phase,
}

/// How far a joint and its drive agree.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// It is not commanded.
    Off,
    /// It is commanded, and its drive has to be stopped before, for so many ticks.
    Clearing(u8),
    /// It is commanded, and its drive was not yet seen under torque, for so many ticks.
    Starting(u8),
    /// The drive does what it is commanded.
    On,
    /// It does not, and has been told of once.
    Refused,
}

/// What a joint shows in a tick: all NaN where it shows nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MoteusReading {
    /// Of the output, `rad`; not wrapped.
    pub position_rad: f32,
    /// Of the output, `rad/s`.
    pub velocity_rad_per_s: f32,
    /// By the measured currents, at the output, `N m`.
    pub torque_nm: f32,
    /// Of the supply, `V`.
    pub voltage_v: f32,
    /// Of the drive's board, `°C`.
    pub temperature_c: f32,
    /// What is wrong with it, or limits it.
    pub trouble: Option<MoteusTrouble>,
}

impl MoteusReading {
    /// The [number](MoteusTrouble::number) of its trouble as a signal has it; 0 for none.
    #[must_use]
    pub fn fault(&self) -> f32 {
        self.trouble.map_or(0.0, |trouble| trouble.number().into())
    }
}

impl MoteusJoint {
    /// A joint that has not been commanded and whose drive is unknown. Each torque holds for `timeout_s`, > 0, if no other
    /// comes; a reply may be missing in `missing_ticks` ticks in a row, 254 at most.
    #[must_use]
    pub fn new(address: MoteusAddress, timeout_s: f32, missing_ticks: u8) -> Self {
        Self {
            address,
            timeout_s,
            missing_ticks: missing_ticks.min(254),
            state: None,
            has_replied: false,
            silent_ticks: 0,
            phase: Phase::Off,
        }
    }

    /// The drive and its host.
    #[must_use]
    pub fn address(&self) -> MoteusAddress {
        self.address
    }

    /// Takes a frame off the bus; false if it is not this drive's.
    ///
    /// # Errors
    /// [`MoteusReplyError`] of a reply that says nothing: it counts as none.
    pub fn receive(&mut self, arbitration_id: u32, data: &[u8]) -> Result<bool, MoteusReplyError> {
        if arbitration_id != self.address.reply_id() {
            return Ok(false);
        }
        self.state = Some(MoteusState::from_reply(data)?);
        self.has_replied = true;
        Ok(true)
    }

    /// What the joint shows. Once per tick, before [`frame`](Self::frame).
    pub fn read(&mut self) -> MoteusReading {
        let is_new = core::mem::take(&mut self.has_replied);
        self.silent_ticks = if is_new { 0 } else { self.silent_ticks.saturating_add(1) };
        let was_refused = self.phase == Phase::Refused;
        if let Some(state) = self.state.filter(|_| is_new) {
            self.follow(state.mode);
        }
        self.wait();
        let is_silent = self.silent_ticks != 0 && self.silent_ticks == self.missing_ticks;
        let is_gone = self.silent_ticks > self.missing_ticks;
        let Some(state) = self.state.filter(|_| !is_gone && !was_refused) else { return NOTHING };
        let trouble = match state.fault.map(MoteusTrouble::Fault) {
            _ if is_silent => Some(MoteusTrouble::Silent),
            None if self.phase == Phase::Refused => Some(MoteusTrouble::Disobeys(state.mode)),
            fault => fault,
        };
        MoteusReading {
            position_rad: state.position_rad,
            velocity_rad_per_s: state.velocity_rad_per_s,
            torque_nm: state.torque_nm,
            voltage_v: state.voltage_v,
            temperature_c: state.temperature_c,
            trouble,
        }
    }

    /// What to send to the drive's [address](MoteusAddress::command_id): for a torque, `N m` at the output, or for none, where
    /// the joint is off. Once per tick.
    pub fn frame(&mut self, torque_nm: Option<f32>) -> MoteusFrame {
        let mode = self.state.map(|state| state.mode);
        self.phase = match (torque_nm, self.phase) {
            (None, _) => Phase::Off,
            (Some(_), Phase::Off) if mode.is_none_or(needs_stop) => Phase::Clearing(0),
            (Some(_), Phase::Off) => Phase::Starting(0),
            (Some(_), phase) => phase,
        };
        match (torque_nm, self.phase) {
            (Some(torque_nm), Phase::Starting(_) | Phase::On) => {
                MoteusFrame::torque(torque_nm, self.timeout_s)
            }
            // It is off by itself: a stop would take away what it has to say. So it could of one that is unknown.
            (_, Phase::Off | Phase::Refused) if mode.is_none_or(|mode| mode == MoteusMode::Fault) => {
                MoteusFrame::query()
            }
            _ => MoteusFrame::stop(),
        }
    }

    /// Compares what the drive is at with what it should be.
    fn follow(&mut self, mode: MoteusMode) {
        self.phase = match (self.phase, mode) {
            (Phase::Clearing(_), mode) if !needs_stop(mode) => Phase::Starting(0),
            (Phase::Starting(_), MoteusMode::Position) => Phase::On,
            (Phase::Starting(_), mode) if needs_stop(mode) => Phase::Refused,
            (Phase::On, mode) if mode != MoteusMode::Position => Phase::Refused,
            (phase, _) => phase,
        };
    }

    /// Counts the ticks of what must not last.
    fn wait(&mut self) {
        self.phase = match self.phase {
            Phase::Clearing(STARTING_TICKS) | Phase::Starting(STARTING_TICKS) => Phase::Refused,
            Phase::Clearing(ticks) => Phase::Clearing(ticks.saturating_add(1)),
            Phase::Starting(ticks) => Phase::Starting(ticks.saturating_add(1)),
            phase => phase,
        };
    }
}

/// Of a joint that shows nothing.
const NOTHING: MoteusReading = MoteusReading {
    position_rad: f32::NAN,
    velocity_rad_per_s: f32::NAN,
    torque_nm: f32::NAN,
    voltage_v: f32::NAN,
    temperature_c: f32::NAN,
    trouble: None,
};

/// Whether a drive obeys no torque before it was stopped.
fn needs_stop(mode: MoteusMode) -> bool {
    matches!(mode, MoteusMode::Fault | MoteusMode::Timeout | MoteusMode::Other(_))
}
