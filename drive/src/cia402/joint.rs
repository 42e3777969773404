//! A CiA 402 drive as a joint of a controller.

use core::f32::consts::TAU;

use super::setup::Setup;
use super::{
    BOOTING, Cia402Command, Cia402Emergency, Cia402Frame, Cia402JointFault, Cia402Node, Cia402Settings,
    Cia402State, OPERATIONAL, TORQUE_MODE,
};
use crate::DriveReading;
use crate::agreement::{Agreement, Phase, Says, Shows};

/// Maximum ticks from the first command until the drive is under torque; it may need to release a brake.
const STARTING_TICKS: u8 = 250;

/// Reading of a joint in a tick; the temperature is NaN.
pub type Cia402Reading = DriveReading<Cia402JointFault>;

/// One drive: set up once, then commanded a torque and read in every tick.
///
/// ```text
///   tick: read ─▶ scheme ─▶ safety stage ─▶ frame of each joint, SYNC ─▶ bus ─▶ drives
///         receive ◀───────────────────────────────────────────────────  bus ◀──┘     until the next tick
/// ```
/// On SYNC, all drives apply the command received before it and sample their state. The controller therefore sees the
/// joint as it was when the last command took effect: a command based on a reading takes effect one tick after the
/// reading was sampled.
///
/// | Drive | Reading |
/// |---|---|
/// | was never set up | NaN; a refused object as the fault |
/// | follows its command | its process data |
/// | has been silent for fewer than `missing_ticks` | its last process data |
/// | is silent or lost; or, under command, sent an emergency or left *operation enabled* | once with the [fault](Cia402JointFault), then NaN |
/// | is not commanded | its process data, with its fault |
///
/// The safety stage stops the robot on NaN. While a joint is off, its drive receives *disable voltage* in every tick. A
/// fault stays visible until the joint is commanded again and is then reset once. A drive that was power-cycled, or
/// whose heartbeat is missing, is set up again.
#[derive(Debug, Clone)]
pub struct Cia402Joint {
    settings: Cia402Settings,
    setup: Setup,
    agreement: Agreement,
    statusword: u16,
    mode: i8,
    /// Reading of the last process data; NaN before the first.
    shown: Cia402Reading,
    /// Position counts of the last process data; they wrap. `None` before the first and after the drive was lost.
    last_counts: Option<i32>,
    /// Unwrapped position counts.
    counts: i64,
    emergency: Option<Cia402Emergency>,
    /// Why the drive is set up again.
    lost: Option<Cia402JointFault>,
    is_lost_now: bool,
    /// Which of the two process data objects were received since the last tick.
    news: [bool; 2],
    ticks_since_heartbeat: u16,
}

impl Cia402Joint {
    /// Creates a joint that is off and whose drive is unknown.
    #[must_use]
    pub fn new(settings: &Cia402Settings) -> Self {
        Self {
            settings: *settings,
            setup: Setup::new(settings),
            agreement: Agreement::new(settings.missing_ticks, STARTING_TICKS),
            statusword: 0,
            mode: 0,
            shown: Cia402Reading::NOTHING,
            last_counts: None,
            counts: 0,
            emergency: None,
            lost: None,
            is_lost_now: false,
            news: [false; 2],
            ticks_since_heartbeat: 0,
        }
    }

    /// Returns the node of the drive.
    #[must_use]
    pub fn node(&self) -> Cia402Node {
        self.settings.node
    }

    /// Checks that the drive is set up and present.
    #[must_use]
    pub fn is_set_up(&self) -> bool {
        self.setup.is_done
    }

    /// Processes a frame with a standard identifier; ignores frames of other nodes and malformed frames.
    pub fn receive(&mut self, id: u16, data: &[u8]) {
        let node = self.settings.node;
        match data {
            &[low, high, a, b, c, d, torque_low, torque_high] if id == node.tpdo_id(1) => {
                self.statusword = u16::from_le_bytes([low, high]);
                let torque = i16::from_le_bytes([torque_low, torque_high]);
                self.count(i32::from_le_bytes([a, b, c, d]));
                self.shown.position_rad = self.counts as f32 * self.rad_per_count();
                self.shown.torque_nm = f32::from(torque) * self.nm_per_thousandth();
                self.news[0] = true;
                self.setup.see_operational();
            }
            &[a, b, c, d, mode] if id == node.tpdo_id(2) => {
                self.shown.velocity_rad_per_s =
                    i32::from_le_bytes([a, b, c, d]) as f32 * self.rad_per_count();
                self.mode = i8::from_le_bytes([mode]);
                self.news[1] = true;
            }
            &[a, b, c, d] if id == node.tpdo_id(3) => {
                self.shown.voltage_v = 1e-3 * u32::from_le_bytes([a, b, c, d]) as f32;
            }
            &[low, high, ..] if id == node.emergency_id() => {
                self.emergency = Cia402Emergency::from_code(u16::from_le_bytes([low, high]));
            }
            &[state] if id == node.heartbeat_id() => self.see_heartbeat(state & 0x7f),
            answer if id == node.response_id() => self.setup.receive(answer),
            _ => {}
        }
    }

    /// Returns the reading of the joint. Call once per tick, before [`frame`](Self::frame).
    pub fn read(&mut self) -> Cia402Reading {
        self.ticks_since_heartbeat = self.ticks_since_heartbeat.saturating_add(1);
        if self.setup.is_done && self.ticks_since_heartbeat > self.settings.timeout_ticks() {
            self.lose(Cia402JointFault::NoHeartbeat);
        }
        let has_spoken = core::mem::take(&mut self.news) == [true; 2];
        // A silent drive is already reported.
        let is_lost = core::mem::take(&mut self.is_lost_now) && !self.agreement.is_gone();
        let said = if is_lost { Some(Says::NeedsReset) } else { has_spoken.then(|| self.says()) };
        let shows = self.agreement.read(said);
        let of_setup = self.setup.refusal.or(self.lost).filter(|_| !self.setup.is_done);
        let emergency = self.emergency.map(Cia402JointFault::Emergency);
        let state = Cia402State::from_statusword(self.statusword);
        let fault = match (shows, state) {
            _ if of_setup.is_some() || emergency.is_some() => emergency.or(of_setup),
            (Shows::Silent, _) => Some(Cia402JointFault::Silent),
            (Shows::UnexpectedMode, Cia402State::OperationEnabled) => Some(Cia402JointFault::Mode(self.mode)),
            (Shows::UnexpectedMode, _)
            | (Shows::State, Cia402State::Fault | Cia402State::FaultReactionActive) => {
                Some(Cia402JointFault::State(state))
            }
            _ => None,
        };
        let shown = if shows == Shows::Nothing { Cia402Reading::NOTHING } else { self.shown };
        Cia402Reading { fault, ..shown }
    }

    /// Returns the frame to send before SYNC, if any, for a torque, `N m` at the output, or `None` for a joint that is
    /// off. Call once per tick.
    pub fn frame(&mut self, torque_nm: Option<f32>) -> Option<Cia402Frame> {
        let said = self.shown.position_rad.is_finite().then(|| self.says());
        let phase = self.agreement.command(torque_nm.is_some(), said);
        if phase == Phase::Clearing(0) {
            self.emergency = None;
        }
        if !self.setup.is_done {
            return self.setup.frame();
        }
        let state = Cia402State::from_statusword(self.statusword);
        let (command, torque) = match (phase, torque_nm) {
            (Phase::On, Some(torque_nm))
                if torque_nm.is_finite() && state == Cia402State::OperationEnabled =>
            {
                (Cia402Command::EnableOperation, thousandths(torque_nm / self.nm_per_thousandth()))
            }
            (Phase::Clearing(_), _) => (Cia402Command::FaultReset, 0),
            (Phase::Starting(_), _) => (state.next_command(), 0),
            _ => (Cia402Command::DisableVoltage, 0),
        };
        let ([a, b], [c, d]) = (command.controlword().to_le_bytes(), torque.to_le_bytes());
        Some(Cia402Frame::new(self.settings.node.rpdo_id(1), [a, b, c, d]))
    }

    fn says(&self) -> Says {
        match Cia402State::from_statusword(self.statusword) {
            _ if self.emergency.is_some() => Says::NeedsReset,
            Cia402State::OperationEnabled if self.mode == TORQUE_MODE => Says::Operational,
            Cia402State::Fault | Cia402State::FaultReactionActive | Cia402State::Unknown => Says::NeedsReset,
            _ => Says::Ready,
        }
    }

    fn see_heartbeat(&mut self, state: u8) {
        self.ticks_since_heartbeat = 0;
        match state {
            OPERATIONAL => self.setup.see_operational(),
            _ if self.setup.is_done => self.lose(Cia402JointFault::LeftOperation),
            BOOTING => self.setup.begin(),
            _ => {}
        }
    }

    /// Restarts the setup of the drive.
    fn lose(&mut self, why: Cia402JointFault) {
        (self.lost, self.is_lost_now) = (Some(why), true);
        (self.statusword, self.last_counts) = (0, None);
        self.setup.begin();
    }

    /// Unwraps the drive's position counts.
    fn count(&mut self, counts: i32) {
        self.counts = match self.last_counts {
            Some(last) => self.counts.saturating_add(counts.wrapping_sub(last).into()),
            None => counts.into(),
        };
        self.last_counts = Some(counts);
    }

    fn rad_per_count(&self) -> f32 {
        TAU / (self.settings.counts_per_turn * self.settings.gear_ratio)
    }

    /// Returns a thousandth of the rated torque, at the output.
    fn nm_per_thousandth(&self) -> f32 {
        1e-3 * self.setup.rated_nm * self.settings.gear_ratio
    }
}

/// Rounds to the nearest integer.
#[expect(clippy::cast_possible_truncation, reason = "a cast saturates")]
fn thousandths(number: f32) -> i16 {
    (number + 0.5_f32.copysign(number)) as i16
}
