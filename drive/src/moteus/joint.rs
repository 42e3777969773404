//! A moteus drive as a joint of a controller.

use super::{MoteusAddress, MoteusFrame, MoteusJointFault, MoteusMode, MoteusReplyError, MoteusState};
use crate::DriveReading;
use crate::agreement::{Agreement, Phase, Says, Shows};

/// Maximum ticks from the first command until the drive is under torque; it prepares for some milliseconds.
const STARTING_TICKS: u8 = 50;

/// One drive: commanded and read in every tick.
///
/// ```text
///   tick: read ─▶ scheme ─▶ safety stage ─▶ frame ─▶ bus ─▶ drive
///         receive ◀────────────────────────────────  bus ◀──┘     until the next tick
/// ```
/// Each frame commands and queries; its reply is read in the next tick. The controller therefore sees the joint as it
/// was when the last command arrived: a command based on a reading takes effect one tick after the reading was sampled.
///
/// | Drive | Reading |
/// |---|---|
/// | replies and follows its command | the reply |
/// | has not replied for fewer than `missing_ticks` | the last reply |
/// | does not reply; or, under command, is in another mode | once with the [fault](MoteusJointFault), then NaN |
/// | is not commanded | the reply, with the drive's fault |
///
/// The safety stage stops the robot on NaN; the reading before it has the reason. While a joint is off, its drive is
/// stopped in every tick. A faulted drive is only queried, so that the fault stays visible until the joint is commanded
/// again; a stop then clears it once.
#[derive(Debug, Clone)]
pub struct MoteusJoint {
    address: MoteusAddress,
    timeout_s: f32,
    /// State of the last reply.
    state: Option<MoteusState>,
    /// Whether a reply was received since the last tick.
    has_replied: bool,
    agreement: Agreement,
}

/// Reading of a joint in a tick.
pub type MoteusReading = DriveReading<MoteusJointFault>;

impl MoteusJoint {
    /// Creates a joint that is off and whose drive is unknown. Each torque command is valid for `timeout_s`, > 0;
    /// replies may be missing for `missing_ticks` consecutive ticks, at most 254.
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

    /// Returns the addresses of the drive and its host.
    #[must_use]
    pub fn address(&self) -> MoteusAddress {
        self.address
    }

    /// Processes a received frame; returns false if it is not from this drive.
    ///
    /// # Errors
    /// Returns [`MoteusReplyError`] for an invalid reply, which counts as missing.
    pub fn receive(&mut self, arbitration_id: u32, data: &[u8]) -> Result<bool, MoteusReplyError> {
        if arbitration_id != self.address.reply_id() {
            return Ok(false);
        }
        self.state = Some(MoteusState::from_reply(data)?);
        self.has_replied = true;
        Ok(true)
    }

    /// Returns the reading of the joint. Call once per tick, before [`frame`](Self::frame).
    pub fn read(&mut self) -> MoteusReading {
        let is_new = core::mem::take(&mut self.has_replied);
        let shows = self.agreement.read(self.state.filter(|_| is_new).map(|state| says(state.mode)));
        let Some(state) = self.state.filter(|_| shows != Shows::Nothing) else {
            return MoteusReading::NOTHING;
        };
        let fault = match (shows, state.fault.map(MoteusJointFault::Fault)) {
            (Shows::Silent, _) => Some(MoteusJointFault::Silent),
            (Shows::UnexpectedMode, None) => Some(MoteusJointFault::UnexpectedMode(state.mode)),
            (_, fault) => fault,
        };
        MoteusReading {
            position_rad: state.position_rad,
            velocity_rad_per_s: state.velocity_rad_per_s,
            torque_nm: state.torque_nm,
            voltage_v: state.voltage_v,
            temperature_c: state.temperature_c,
            fault,
        }
    }

    /// Returns the frame to send to the drive's [address](MoteusAddress::command_id) for a torque, `N m` at the output,
    /// or `None` for a joint that is off. Call once per tick.
    pub fn frame(&mut self, torque_nm: Option<f32>) -> MoteusFrame {
        let mode = self.state.map(|state| state.mode);
        let phase = self.agreement.command(torque_nm.is_some(), mode.map(says));
        match (torque_nm, phase) {
            (Some(torque_nm), Phase::Starting(_) | Phase::On) => {
                MoteusFrame::torque(torque_nm, self.timeout_s)
            }
            // A faulted drive is off; a stop would clear the fault. An unknown drive may have a fault.
            (_, Phase::Off | Phase::Refused) if mode.is_none_or(|mode| mode == MoteusMode::Fault) => {
                MoteusFrame::query()
            }
            _ => MoteusFrame::stop(),
        }
    }
}

/// Classifies a mode. A drive in fault or timeout ignores torque commands until it is stopped.
fn says(mode: MoteusMode) -> Says {
    match mode {
        MoteusMode::Position => Says::Operational,
        MoteusMode::Stopped | MoteusMode::Preparing => Says::Ready,
        MoteusMode::Fault | MoteusMode::Timeout | MoteusMode::Other(_) => Says::NeedsReset,
    }
}
