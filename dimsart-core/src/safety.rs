//! Safety stage, the last stage before the actuators.

mod drive_fault;
mod drive_state;
mod limited;
mod reason;
mod velocity;

pub use drive_fault::DriveFault;
pub use drive_state::{DriveEvent, DriveState};
pub use reason::{ReasonCounts, SafetyReason};

use heapless::Vec;

use crate::data_base::{Frame, FrameError};
use crate::device::{DeviceDescriptor, SafeValue};
use crate::engine::Engine;
use crate::limits::MAX_LIMITED_WORDS;
use crate::module::ModuleRef;
use crate::signal::word::{Scalar as _, Word};
use limited::{Held, Limited};
use velocity::Velocity;

/// Result of a tick. It always leaves a valid frame for the device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum TickResult {
    /// The scheme ran and commands the device.
    Ran,
    /// The scheme is stopped; the device gets its safe value.
    Idle,
    /// The measurement was refused, no module ran; the device gets its safe value.
    MeasurementRefused(FrameError),
    /// The scheme ran, but the caller's command frame has a wrong length; the device gets its safe value.
    CommandRefused(FrameError),
    /// The scheme ran, but motion is not [allowed](crate::Dimsart::set_motion_allowed): no client holds the lease.
    /// The device gets its safe value.
    Disarmed,
    /// The scheme ran, but a link has timed out: the device gets its safe value until a reset.
    LinkLost {
        /// The link.
        link: u8,
    },
    /// The scheme ran, but its external commands are [too old](crate::Dimsart::set_commands_stale): the device gets
    /// its safe value, until a reset if it was commanded before.
    CommandsLate,
    /// The scheme ran, but the device's drive [reports](crate::Dimsart::set_drive_fault) a fault and its bridge
    /// is off: the device gets its safe value, until a reset if it was commanded before.
    DriveFailed(DriveFault),
    /// The scheme ran, but no packet has arrived over a link since the start or the last reset, for longer
    /// than the timeout: the device gets its safe value until the first packet.
    LinkDown {
        /// The link.
        link: u8,
    },
    /// A module that the device depends on has [failed](crate::Engine::module_fault) and is isolated: the
    /// device gets its safe value until a reset.
    ModuleFailed(ModuleRef),
}

impl TickResult {
    /// Returns why the scheme does not command the device; [`SafetyReason::None`] if it does.
    #[must_use]
    pub const fn reason(self) -> SafetyReason {
        match self {
            Self::Ran => SafetyReason::None,
            Self::Idle => SafetyReason::Stopped,
            Self::MeasurementRefused(_) => SafetyReason::MeasurementRefused,
            Self::CommandRefused(_) => SafetyReason::CommandRefused,
            Self::Disarmed => SafetyReason::Disarmed,
            Self::CommandsLate => SafetyReason::CommandsLate,
            Self::LinkLost { .. } => SafetyReason::LinkLost,
            Self::LinkDown { .. } => SafetyReason::LinkDown,
            Self::DriveFailed(fault) => fault.reason(),
            Self::ModuleFailed(_) => SafetyReason::ModuleFailed,
        }
    }
}

/// Safety stage: decides in every tick what the actuators get.
///
/// | Tick | Input of the device |
/// |---|---|
/// | no fault | the scheme's command, within the input's range and rate limit |
/// | scheme stopped, or motion not allowed | the safe value, within the rate limit |
/// | first packet of a link missing | the safe value, until that packet |
/// | frame refused, commands late, link lost, drive or module failed | the safe value, until a reset and until motion is allowed again |
///
/// Range, rate and safe value are [declared](DeviceDescriptor::with_limits) with the device. An input without limits
/// gets any finite command; its safe value is zero. The rate limit also applies on the way to and from the safe value,
/// so motion starts at the actuator's current value, whatever integrators have wound up. [`SafetyReason`] is the reason why
/// the device did not get the scheme's command, [`DriveState`] the state of the drive as in CiA 402.
#[derive(Debug)]
pub struct Safety {
    state: DriveState,
    is_motion_forbidden: bool,
    /// The latched fault and its reason, in a fault state.
    failed: (TickResult, SafetyReason),
    refused_ticks: u32,
    reason: SafetyReason,
    counts: ReasonCounts,
    limited: Vec<Limited, MAX_LIMITED_WORDS>,
    velocity: Velocity,
    has_commanded: bool,
}

impl Safety {
    pub(crate) const fn new() -> Self {
        Self {
            state: DriveState::NotReadyToSwitchOn,
            is_motion_forbidden: false,
            failed: (TickResult::Ran, SafetyReason::None),
            refused_ticks: 0,
            reason: SafetyReason::None,
            counts: ReasonCounts::new(),
            limited: Vec::new(),
            velocity: Velocity::NONE,
            has_commanded: false,
        }
    }

    /// Restarts for a device; keeps whether motion is allowed.
    pub(crate) fn connect(&mut self, device: &DeviceDescriptor) {
        *self = Self { is_motion_forbidden: self.is_motion_forbidden, ..Self::new() };
        for word in (0..device.input_words()).filter_map(|place| device.limited_word(place)) {
            // Does not overflow: the descriptor checks the count.
            let _ = self.limited.push(Limited::new(&word, device));
            if matches!(word.limits.safe_value, SafeValue::Damping { .. }) {
                self.velocity = Velocity::new(device);
            }
        }
        self.meet(DriveEvent::Initialized);
    }

    pub(crate) fn set_motion_allowed(&mut self, is_allowed: bool) {
        self.is_motion_forbidden = !is_allowed;
        if !is_allowed {
            self.meet(DriveEvent::QuickStop);
        }
    }

    fn meet(&mut self, event: DriveEvent) {
        self.state = self.state.transition(event).unwrap_or(self.state);
    }

    /// Enables operation if motion is allowed and no fault is latched; returns whether the scheme commands
    /// the device.
    #[cold]
    #[inline(never)]
    fn enable(&mut self) -> bool {
        if !self.is_motion_forbidden {
            for event in [DriveEvent::Shutdown, DriveEvent::SwitchOn, DriveEvent::EnableOperation] {
                self.meet(event);
            }
        }
        self.state == DriveState::OperationEnabled
    }

    /// Returns whether a fault cannot be reset yet.
    pub(crate) fn reacts_to_fault(&self) -> bool {
        self.state == DriveState::FaultReactionActive
    }

    pub(crate) fn reset(&mut self) {
        self.meet(DriveEvent::FaultReset);
    }

    pub(crate) fn forbids_motion(&self) -> bool {
        self.is_motion_forbidden
    }

    /// Returns the last values of the device's limited words, with their indices in the frame.
    pub(crate) fn given(&self) -> impl Iterator<Item = (usize, Word)> + '_ {
        self.limited.iter().map(|limited| (limited.place, limited.given))
    }

    /// Returns the state of the drive.
    #[must_use]
    pub fn state(&self) -> DriveState {
        self.state
    }

    /// Returns the number of ticks with a refused frame since the device was connected.
    #[must_use]
    pub fn refused_ticks(&self) -> u32 {
        self.refused_ticks
    }

    /// Returns why the device did not get the scheme's command in the last tick.
    #[must_use]
    pub fn reason(&self) -> SafetyReason {
        self.reason
    }

    /// Returns the ticks by reason since the device was connected.
    #[must_use]
    pub fn counts(&self) -> &ReasonCounts {
        &self.counts
    }

    /// Decides what the device gets and writes it into `commanded`.
    ///
    /// `computed` is an error if the scheme does not command the device. If the measurement is refused in a
    /// tick with a `drive_fault`, the drive fault is reported.
    #[inline]
    pub(crate) fn decide(
        &mut self,
        computed: Result<(), TickResult>,
        drive_fault: Option<DriveFault>,
        engine: &Engine,
        frame: &Frame,
        measured: &[Word],
        commanded: &mut [Word],
    ) -> TickResult {
        // A match, not `and_then`: chained results are copied in every tick.
        let tick = match computed {
            Err(tick) => tick,
            Ok(()) => match frame.read(engine.data_base(), commanded) {
                Err(error) => TickResult::CommandRefused(error),
                Ok(()) if self.state != DriveState::OperationEnabled && !self.enable() => {
                    TickResult::Disarmed
                }
                Ok(()) => {
                    self.reason = SafetyReason::None;
                    if !self.limited.is_empty() {
                        if !self.has_commanded {
                            self.hold_position(measured);
                            self.has_commanded = true;
                        }
                        self.limit(measured, commanded);
                    }
                    return TickResult::Ran;
                }
            },
        };
        let cause = match (tick, drive_fault) {
            (TickResult::MeasurementRefused(_), Some(fault)) => TickResult::DriveFailed(fault),
            _ => tick,
        };
        self.give_safe_values((tick, cause), engine, measured, commanded)
    }

    #[inline(never)]
    fn give_safe_values(
        &mut self,
        (tick, cause): (TickResult, TickResult),
        engine: &Engine,
        measured: &[Word],
        commanded: &mut [Word],
    ) -> TickResult {
        let (told, reason) = self.tell(tick, cause, engine.is_running());
        let period_s = engine.device().sample_period_s();
        self.reason = reason;
        self.counts.count(self.reason);
        commanded.fill(Word(0));
        let measured = if matches!(tick, TickResult::MeasurementRefused(_)) { &[] } else { measured };
        if !self.has_commanded {
            self.hold_position(measured);
        }
        let mut held = Held::default();
        for limited in &mut self.limited {
            if let Some(word) = commanded.get_mut(limited.place) {
                let wanted = limited.safe_value(&self.velocity, measured, period_s);
                *word = limited.give(wanted, &mut held);
            }
        }
        if held.by_rate {
            self.counts.count(SafetyReason::RateLimited);
        } else {
            self.meet(DriveEvent::Stopped);
        }
        self.velocity.keep(measured);
        told
    }

    /// Before the first command, a held position starts at the measured position.
    #[cold]
    #[inline(never)]
    fn hold_position(&mut self, measured: &[Word]) {
        for limited in &mut self.limited {
            if let Some(position) = measured.get(limited.stands_at) {
                limited.begin(f32::from_word(*position));
            }
        }
    }

    /// Returns the result and reason of a tick in which no scheme commands the device; the latched fault
    /// until a reset.
    fn tell(&mut self, tick: TickResult, cause: TickResult, is_running: bool) -> (TickResult, SafetyReason) {
        let told = (cause, cause.reason());
        let is_refused = matches!(tick, TickResult::MeasurementRefused(_) | TickResult::CommandRefused(_));
        self.refused_ticks = self.refused_ticks.saturating_add(is_refused.into());
        // While nothing moves, a refused frame or a late command does not latch, nor does a link that is
        // down.
        let fails = match tick {
            _ if is_refused => is_running && self.enable(),
            TickResult::CommandsLate | TickResult::DriveFailed(_) => {
                self.state == DriveState::OperationEnabled
            }
            TickResult::LinkDown { .. } => false,
            _ => told.1.is_fault(),
        };
        if fails && !self.state.is_fault() {
            self.failed = told;
            self.meet(DriveEvent::Fault);
        } else {
            self.meet(DriveEvent::QuickStop);
        }
        if self.state.is_fault() { self.failed } else { told }
    }

    /// Limits the scheme's commands to their range and rate.
    #[inline(never)]
    fn limit(&mut self, measured: &[Word], commanded: &mut [Word]) {
        let mut held = Held::default();
        for limited in &mut self.limited {
            if let Some(word) = commanded.get_mut(limited.place) {
                *word = limited.give(*word, &mut held);
            }
        }
        if held.by_rate || held.by_range {
            self.count_held(held);
        }
        self.velocity.keep(measured);
    }

    #[cold]
    fn count_held(&mut self, held: Held) {
        for (reason, is_so) in
            [(SafetyReason::RateLimited, held.by_rate), (SafetyReason::RangeLimited, held.by_range)]
        {
            if is_so {
                self.counts.count(reason);
                self.reason = reason;
            }
        }
    }
}
