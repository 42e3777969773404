//! The safety stage, last before the actuators.

mod reason;
mod velocity;

pub use reason::{Reason, ReasonCounts};

use crate::device::DeviceDescriptor;
use crate::engine::Engine;
use crate::frame::{Frame, FrameError};
use crate::input_limits::SafeValue;
use crate::kind::ModuleList;
use crate::limits::MAX_LIMITED_WORDS;
use crate::word::{Format, Scalar as _, Word};
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
    /// The scheme ran but a command is not a finite number; the device gets its safe value.
    CommandRefused(FrameError),
    /// The scheme ran and would command the device, but motion is
    /// [not allowed](crate::Dimsart::allow_motion): nobody holds the lease. The device gets its safe value.
    Disarmed,
    /// The scheme ran, but nothing has come over a link for too long: the device gets its safe value until a reset.
    LinkLost {
        /// The link.
        link: u8,
    },
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
            Self::LinkLost { .. } => Reason::LinkLost,
        }
    }
}

/// The safety stage: it alone decides what the actuators get.
///
/// | Tick | What a device's input gets |
/// |---|---|
/// | nothing is wrong | the scheme's command, held to the input's range and rate |
/// | scheme stopped, motion not allowed, frame refused, link lost | its safe value, held to the same |
///
/// Range, rate and safe value are [declared](DeviceDescriptor::with_limits) with the device; an input without them gets
/// any finite command, and zero as its safe value. The rate holds on the way to the safe value and back, too: motion
/// begins where the actuator is, whatever integrators have wound up meanwhile. Why a device did not get what the scheme
/// commanded is a [`Reason`], with a number and a name.
#[derive(Debug)]
pub struct Safety {
    is_motion_forbidden: bool,
    has_limits: bool,
    reason: Reason,
    counts: ReasonCounts,
    /// What the words with limits got last.
    given: [Word; MAX_LIMITED_WORDS],
    velocity: Velocity,
}

impl Safety {
    pub(crate) const fn new() -> Self {
        Self {
            is_motion_forbidden: false,
            has_limits: false,
            reason: Reason::None,
            counts: ReasonCounts::new(),
            given: [Word(0); MAX_LIMITED_WORDS],
            velocity: Velocity::NONE,
        }
    }

    /// Starts anew for a device. Whether motion is allowed stays.
    pub(crate) fn connect(&mut self, device: &DeviceDescriptor) {
        *self = Self { is_motion_forbidden: self.is_motion_forbidden, ..Self::new() };
        for (given, limited) in self.given.iter_mut().zip(device.limited_words()) {
            self.has_limits = true;
            let limits = limited.limits;
            if limited.data_type.format == Format::F32 {
                *given = between(0.0, limits.min, limits.max).into_word();
            }
            if matches!(limits.safe_value, SafeValue::Damping { .. }) {
                self.velocity = Velocity::new(device);
            }
        }
    }

    pub(crate) fn allow_motion(&mut self, is_allowed: bool) {
        self.is_motion_forbidden = !is_allowed;
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
    /// `computed` says why no scheme commands the device, as far as the tick has come.
    #[inline]
    pub(crate) fn decide<M: ModuleList, const WORDS: usize>(
        &mut self,
        computed: Result<(), Tick>,
        engine: &Engine<M, WORDS>,
        frame: &Frame,
        measured: &[Word],
        commanded: &mut [Word],
    ) -> Tick {
        // Written out: results chained by `and_then` are copied on the way, in the usual tick, too.
        let tick = match computed {
            Err(tick) => tick,
            Ok(()) => match frame.read(engine.data_base(), commanded) {
                Err(error) => Tick::CommandRefused(error),
                Ok(()) if self.is_motion_forbidden => Tick::Disarmed,
                Ok(()) => {
                    self.reason = Reason::None;
                    if self.has_limits {
                        self.limit(Tick::Ran, engine.device(), measured, commanded);
                    }
                    return Tick::Ran;
                }
            },
        };
        self.give_safe_values(tick, engine.device(), measured, commanded);
        tick
    }

    #[inline(never)]
    fn give_safe_values(
        &mut self,
        tick: Tick,
        device: &DeviceDescriptor,
        measured: &[Word],
        commanded: &mut [Word],
    ) {
        self.reason = tick.reason();
        self.counts.count(self.reason);
        commanded.fill(Word(0));
        if self.has_limits {
            self.limit(tick, device, measured, commanded);
        }
    }

    /// Gives the words that have limits their safe value, where the scheme commands nothing, and holds them to range
    /// and rate.
    #[inline(never)]
    fn limit(&mut self, tick: Tick, device: &DeviceDescriptor, measured: &[Word], commanded: &mut [Word]) {
        let period_s = device.sample_period_s();
        let is_commanded = tick == Tick::Ran;
        let is_measured = !matches!(tick, Tick::MeasurementRefused(_));
        let measured = if is_measured { measured } else { &[] };
        let (mut is_outside, mut is_too_fast) = (false, false);
        for (given, limited) in self.given.iter_mut().zip(device.limited_words()) {
            let Some(word) = commanded.get_mut(limited.place) else { continue };
            let limits = limited.limits;
            let wanted = match limits.safe_value {
                _ if is_commanded => *word,
                SafeValue::Zero => Word(0),
                SafeValue::Hold => *given,
                SafeValue::Damping { coefficient } => {
                    (-coefficient * self.velocity.of(limited.axis, measured, period_s)).into_word()
                }
            };
            *word = wanted;
            if limited.data_type.format == Format::F32 {
                let [wanted, last] = [wanted, *given].map(f32::from_word);
                let inside = between(wanted, limits.min, limits.max);
                let step = limits.rate_per_s * period_s;
                let reached = between(inside, last - step, last + step);
                is_outside |= is_commanded && inside.to_bits() != wanted.to_bits();
                is_too_fast |= reached.to_bits() != inside.to_bits();
                *word = reached.into_word();
            }
            *given = *word;
        }
        self.velocity.keep(measured);
        for (reason, is_so) in [(Reason::RateLimited, is_too_fast), (Reason::RangeLimited, is_outside)] {
            if is_so {
                self.counts.count(reason);
            }
            if is_so && is_commanded {
                self.reason = reason;
            }
        }
    }
}

/// `x`, or the nearest of `min` to `max`. `f32::clamp` would panic on wrong bounds.
fn between(x: f32, min: f32, max: f32) -> f32 {
    if x < min {
        min
    } else if x > max {
        max
    } else {
        x
    }
}
