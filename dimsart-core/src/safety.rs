//! The safety stage, last before the actuators.

mod drive_fault;
mod drive_state;
mod limited;
mod reason;
mod velocity;

pub use drive_fault::DriveFault;
pub use drive_state::{DriveEvent, DriveState};
pub use reason::{Reason, ReasonCounts};

use heapless::Vec;

use crate::data_base::{Frame, FrameError};
use crate::device::{DeviceDescriptor, SafeValue};
use crate::engine::Engine;
use crate::limits::MAX_LIMITED_WORDS;
use crate::module::ModuleRef;
use crate::signal::word::{Scalar as _, Word};
use limited::{Held, Limited};
use velocity::Velocity;

/// What a tick came to. It always leaves a usable frame for the device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Tick {
    /// The scheme ran and commands the device.
    Ran,
    /// The scheme does not run; the device gets its safe value.
    Idle,
    /// The measurement was refused and nothing was computed; the device gets its safe value.
    MeasurementRefused(FrameError),
    /// The scheme ran, but the caller's frame for the device has another length; the device gets its safe value.
    CommandRefused(FrameError),
    /// The scheme ran and would command the device, but motion is
    /// [not allowed](crate::Dimsart::allow_motion): no client holds the lease. The device gets its safe value.
    Disarmed,
    /// The scheme ran, but nothing has come over a link for too long: the device gets its safe value until a reset.
    LinkLost {
        /// The link.
        link: u8,
    },
    /// The scheme ran, but what it is commanded by from outside is [too old](crate::Dimsart::hold_back): the device gets
    /// its safe value, until a reset if it was moved before.
    CommandsLate,
    /// The scheme ran, but the device's drive [says](crate::Dimsart::drive_fault) that its bridge is off: the device gets its
    /// safe value, until a reset if it was moved before.
    DriveFailed(DriveFault),
    /// The scheme ran, but no packet has come over a link since it started or was reset, for too long: the device gets its
    /// safe value until the first one.
    LinkDown {
        /// The link.
        link: u8,
    },
    /// A module that the device depends on has [failed](crate::Engine::module_fault) and is cut out: the device gets its
    /// safe value until a reset.
    ModuleFailed(ModuleRef),
}

impl Tick {
    /// Why the scheme does not command the device; [`Reason::None`] when it does.
    #[must_use]
    pub const fn reason(self) -> Reason {
        match self {
            Self::Ran => Reason::None,
            Self::Idle => Reason::Stopped,
            Self::MeasurementRefused(_) => Reason::MeasurementRefused,
            Self::CommandRefused(_) => Reason::CommandRefused,
            Self::Disarmed => Reason::Disarmed,
            Self::CommandsLate => Reason::CommandsLate,
            Self::LinkLost { .. } => Reason::LinkLost,
            Self::LinkDown { .. } => Reason::LinkDown,
            Self::DriveFailed(fault) => fault.reason(),
            Self::ModuleFailed(_) => Reason::ModuleFailed,
        }
    }
}

/// The safety stage: it alone decides what the actuators get.
///
/// | Tick | What a device's input gets |
/// |---|---|
/// | nothing is wrong | the scheme's command, held to the input's range and rate |
/// | scheme stopped, motion not allowed | its safe value, held to the same |
/// | a link's first packet is missing | its safe value, until that packet |
/// | frame refused, commands late, link lost, module failed | the same, until a reset and until motion is allowed again |
///
/// Range, rate and safe value are [declared](DeviceDescriptor::with_limits) with the device; an input without them gets
/// any finite command, and zero as its safe value. The rate holds on the way to the safe value and back, too: motion
/// begins where the actuator is, whatever integrators have wound up meanwhile. Why a device did not get what the scheme
/// commanded is a [`Reason`], with a number and a name. What the drive is in is a [`DriveState`] of CiA 402.
#[derive(Debug)]
pub struct Safety {
    state: DriveState,
    is_motion_forbidden: bool,
    /// What has failed, in a state of fault, and its reason.
    failed: (Tick, Reason),
    refused_ticks: u32,
    reason: Reason,
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
            failed: (Tick::Ran, Reason::None),
            refused_ticks: 0,
            reason: Reason::None,
            counts: ReasonCounts::new(),
            limited: Vec::new(),
            velocity: Velocity::NONE,
            has_commanded: false,
        }
    }

    /// Starts anew for a device. Whether motion is allowed stays.
    pub(crate) fn connect(&mut self, device: &DeviceDescriptor) {
        *self = Self { is_motion_forbidden: self.is_motion_forbidden, ..Self::new() };
        for word in (0..device.input_words()).filter_map(|place| device.limited_word(place)) {
            // As many as there is room for: the descriptor has no more.
            let _ = self.limited.push(Limited::new(&word, device));
            if matches!(word.limits.safe_value, SafeValue::Damping { .. }) {
                self.velocity = Velocity::new(device);
            }
        }
        self.meet(DriveEvent::Initialized);
    }

    pub(crate) fn allow_motion(&mut self, is_allowed: bool) {
        self.is_motion_forbidden = !is_allowed;
        if !is_allowed {
            self.meet(DriveEvent::QuickStop);
        }
    }

    fn meet(&mut self, event: DriveEvent) {
        self.state = self.state.after(event).unwrap_or(self.state);
    }

    /// Enables operation, where motion is allowed and nothing has failed; says whether the scheme commands the device.
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

    /// Whether a fault cannot be reset yet.
    pub(crate) fn reacts_to_fault(&self) -> bool {
        self.state == DriveState::FaultReactionActive
    }

    pub(crate) fn reset(&mut self) {
        self.meet(DriveEvent::FaultReset);
    }

    pub(crate) fn forbids_motion(&self) -> bool {
        self.is_motion_forbidden
    }

    /// What the device's words with limits got last, with their places.
    pub(crate) fn given(&self) -> impl Iterator<Item = (usize, Word)> + '_ {
        self.limited.iter().map(|limited| (limited.place, limited.given))
    }

    /// The state of the drive.
    #[must_use]
    pub fn state(&self) -> DriveState {
        self.state
    }

    /// Ticks in which a frame was refused, since the device was connected.
    #[must_use]
    pub fn refused_ticks(&self) -> u32 {
        self.refused_ticks
    }

    /// Why the device did not get what the scheme commanded, in the last tick.
    #[must_use]
    pub fn reason(&self) -> Reason {
        self.reason
    }

    /// Ticks by reason, since the device was connected.
    #[must_use]
    pub fn counts(&self) -> &ReasonCounts {
        &self.counts
    }

    /// Decides what the device gets, and puts it into `commanded`.
    ///
    /// `computed` says why no scheme commands the device, as far as the tick has come. A `drive_fault` is the cause of a
    /// measurement that is refused in the same tick.
    #[inline]
    pub(crate) fn decide(
        &mut self,
        computed: Result<(), Tick>,
        drive_fault: Option<DriveFault>,
        engine: &Engine,
        frame: &Frame,
        measured: &[Word],
        commanded: &mut [Word],
    ) -> Tick {
        // Written out: results chained by `and_then` are copied on the way, in the usual tick, too.
        let tick = match computed {
            Err(tick) => tick,
            Ok(()) => match frame.read(engine.data_base(), commanded) {
                Err(error) => Tick::CommandRefused(error),
                Ok(()) if self.state != DriveState::OperationEnabled && !self.enable() => Tick::Disarmed,
                Ok(()) => {
                    self.reason = Reason::None;
                    if !self.limited.is_empty() {
                        if !self.has_commanded {
                            self.hold_position(measured);
                            self.has_commanded = true;
                        }
                        self.limit(measured, commanded);
                    }
                    return Tick::Ran;
                }
            },
        };
        let cause = match (tick, drive_fault) {
            (Tick::MeasurementRefused(_), Some(fault)) => Tick::DriveFailed(fault),
            _ => tick,
        };
        self.give_safe_values((tick, cause), engine, measured, commanded)
    }

    #[inline(never)]
    fn give_safe_values(
        &mut self,
        (tick, cause): (Tick, Tick),
        engine: &Engine,
        measured: &[Word],
        commanded: &mut [Word],
    ) -> Tick {
        let (told, reason) = self.tell(tick, cause, engine.is_running());
        let period_s = engine.device().sample_period_s();
        self.reason = reason;
        self.counts.count(self.reason);
        commanded.fill(Word(0));
        let measured = if matches!(tick, Tick::MeasurementRefused(_)) { &[] } else { measured };
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
            self.counts.count(Reason::RateLimited);
        } else {
            self.meet(DriveEvent::Stopped);
        }
        self.velocity.keep(measured);
        told
    }

    /// Before the first command a position that is held is where the device stands.
    #[cold]
    #[inline(never)]
    fn hold_position(&mut self, measured: &[Word]) {
        for limited in &mut self.limited {
            if let Some(position) = measured.get(limited.stands_at) {
                limited.begin(f32::from_word(*position));
            }
        }
    }

    /// The result of a tick in which no scheme commands the device, and of its cause: the one that has failed, until a reset.
    fn tell(&mut self, tick: Tick, cause: Tick, is_running: bool) -> (Tick, Reason) {
        let told = (cause, cause.reason());
        let is_refused = matches!(tick, Tick::MeasurementRefused(_) | Tick::CommandRefused(_));
        self.refused_ticks = self.refused_ticks.saturating_add(is_refused.into());
        // What is refused or late while nothing moves is over with the next one; the first command may be waited for.
        let fails = match tick {
            _ if is_refused => is_running && self.enable(),
            Tick::CommandsLate | Tick::DriveFailed(_) => self.state == DriveState::OperationEnabled,
            Tick::LinkDown { .. } => false,
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

    /// Holds what a scheme commands to range and rate.
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
        for (reason, is_so) in [(Reason::RateLimited, held.by_rate), (Reason::RangeLimited, held.by_range)] {
            if is_so {
                self.counts.count(reason);
                self.reason = reason;
            }
        }
    }
}
