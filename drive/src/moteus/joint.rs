//! A drive as a joint of a controller that ticks.

use super::{MoteusAddress, MoteusFrame, MoteusMode, MoteusReplyError, MoteusState, MoteusTrouble};
use crate::DriveReading;
use crate::agreement::{Agreement, Phase, Says, Shows};

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
    /// By the last reply.
    state: Option<MoteusState>,
    /// Whether a reply has come since the last tick.
    has_replied: bool,
    agreement: Agreement,
}

/// What a joint shows in a tick.
pub type MoteusReading = DriveReading<MoteusTrouble>;

impl MoteusJoint {
    /// A joint that has not been commanded and whose drive is unknown. Each torque holds for `timeout_s`, > 0, if no other
    /// comes; a reply may be missing in `missing_ticks` ticks in a row, 254 at most.
    #[must_use]
    pub fn new(address: MoteusAddress, timeout_s: f32, missing_ticks: u8) -> Self {
        Self {
            address,
            timeout_s,
            state: None,
            has_replied: false,
            agreement: Agreement::new(missing_ticks, STARTING_TICKS),
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
        let shows = self.agreement.read(self.state.filter(|_| is_new).map(|state| says(state.mode)));
        let Some(state) = self.state.filter(|_| shows != Shows::Nothing) else {
            return MoteusReading::NOTHING;
        };
        let trouble = match (shows, state.fault.map(MoteusTrouble::Fault)) {
            (Shows::Silent, _) => Some(MoteusTrouble::Silent),
            (Shows::Disobeys, None) => Some(MoteusTrouble::Disobeys(state.mode)),
            (_, fault) => fault,
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
        let phase = self.agreement.command(torque_nm.is_some(), mode.map(says));
        match (torque_nm, phase) {
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
}

/// A drive that went off by itself obeys no torque before it was stopped.
fn says(mode: MoteusMode) -> Says {
    match mode {
        MoteusMode::Position => Says::Obeys,
        MoteusMode::Stopped | MoteusMode::Preparing => Says::Ready,
        MoteusMode::Fault | MoteusMode::Timeout | MoteusMode::Other(_) => Says::Stuck,
    }
}
