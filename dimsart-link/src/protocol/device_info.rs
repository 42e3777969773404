//! State of a controller that the caller of its tick maintains.

use super::LawAction;
use super::blocked::{FirstFault, NotCommandedReason};
use super::heartbeat::Heartbeat;
use super::law::{answer_law, refuse_law};
use super::lease::Lease;
use super::refusal::Refusal;
use super::response::Response;
use super::telemetry::{MAX_TELEMETRY_SIGNALS, Sample, Stream, Wanted};
use crate::event_log::{Event, EventKind, EventLog};
use dimsart_core::{
    DataBase, Dimsart, Engine, FaultCause, FrameError, ModuleFault, SafetyReason, TickResult, Timing,
};

const LEASES_PER_S: u32 = 5;
/// Telemetry ends after this silence of its client.
const PATIENCE_S: u32 = 5;

/// State that the caller of [`Dimsart::tick`](dimsart_core::Dimsart::tick) maintains: name of the image,
/// outcomes of ticks, rights of the clients. `STREAMS` is the number of telemetry streams, for example one
/// per client.
#[derive(Debug, Clone, Copy)]
pub struct DeviceInfo<const STREAMS: usize = 1> {
    pub(super) image: &'static str,
    pub(super) ticks: u64,
    /// Why the last tick did not command the device.
    blocked: Option<NotCommandedReason>,
    pub(super) first_fault: Option<FirstFault>,
    pub(super) timing: Option<Timing>,
    pub(super) lease: Lease,
    /// Permitted silence of a client; 0 without telemetry.
    patience_ticks: u32,
    pub(super) events: Option<&'static EventLog>,
    /// Last reason that was logged as an [event](EventLog); `None` after a reset of a fault.
    reason: Option<SafetyReason>,
    failed: u32,
    /// Number of the last event of the board's CAN bus.
    bus: u8,
    /// A pointer, so that an image without laws does not contain the responses.
    pub(super) answer_law: fn(&Engine, LawAction) -> Response<'static>,
    streams: [Stream; STREAMS],
}

impl<const STREAMS: usize> DeviceInfo<STREAMS> {
    /// Creates the state before the first tick. `image` must identify the image, for example by board,
    /// version and commit; a host may cache descriptions by it. At most 100 bytes.
    ///
    /// By default motion needs no lease and there is no telemetry.
    #[must_use]
    pub const fn new(image: &'static str) -> Self {
        Self {
            image,
            ticks: 0,
            blocked: Some(NotCommandedReason::Tick(TickResult::Idle)),
            first_fault: None,
            timing: None,
            lease: Lease::new(0),
            patience_ticks: 0,
            events: None,
            reason: Some(SafetyReason::Stopped),
            failed: 0,
            bus: EventKind::BusRejoined as u8,
            answer_law: refuse_law,
            streams: [Stream::NONE; STREAMS],
        }
    }

    /// Adds an event log.
    #[must_use]
    pub const fn with_events(self, events: &'static EventLog) -> Self {
        Self { events: Some(events), ..self }
    }

    /// Adds responses to [requests about laws](super::Request::Law), for a controller with laws.
    #[must_use]
    pub const fn with_laws(self) -> Self {
        Self { answer_law, ..self }
    }

    /// Enables telemetry and requires a lease of 200 ms for motion.
    #[must_use]
    pub const fn with_client_lease(self, tick_hz: u32) -> Self {
        let patience_ticks = tick_hz.saturating_mul(PATIENCE_S);
        Self { lease: Lease::new(tick_hz / LEASES_PER_S), patience_ticks, ..self }
    }

    /// Sets the timing of the ticks, if it is measured.
    pub fn set_timing(&mut self, timing: Timing) {
        self.timing = Some(timing);
    }

    /// Logs an event of the board's CAN bus by the number of its [`EventKind`], unless it is the last one
    /// again.
    pub fn log_bus_event(&mut self, what: u8) {
        if core::mem::replace(&mut self.bus, what) != what {
            self.log(Event::of(what));
        }
    }

    /// Begins a tick and advances the lease. Returns whether motion is permitted in this tick, for
    /// [`Dimsart::set_motion_allowed`](dimsart_core::Dimsart::set_motion_allowed).
    #[must_use]
    pub fn begin_tick(&mut self) -> bool {
        self.lease.tick()
    }

    /// Ends the lease; motion needs a new one.
    pub fn end_lease(&mut self) {
        self.lease.end();
    }

    /// Counts a skipped tick after an overrun, so that the lease does not last longer.
    pub fn skip_tick(&mut self) {
        let _ = self.lease.tick();
    }

    /// Ends a tick: counts it and records its outcome.
    pub fn end_tick(&mut self, tick: TickResult, dimsart: &Dimsart) {
        self.ticks = self.ticks.saturating_add(1);
        let (reason, failed) = (Some(tick.reason()), dimsart.engine().failed());
        if (reason, failed) != (self.reason, self.failed) {
            let faults = dimsart.engine().module_faults(failed & !self.failed);
            self.log_tick(tick, faults);
            (self.reason, self.failed) = (reason, failed);
        }
        self.blocked = (!matches!(tick, TickResult::Ran)).then_some(NotCommandedReason::Tick(tick));
        // An armed client waits for a link's first packet: a peer that starts later is no fault.
        let reason = tick.reason();
        if reason.is_fault() && reason != SafetyReason::LinkDown {
            // After a fault, motion needs a reset and a new lease.
            self.lease.end();
            let first = FirstFault { tick: self.ticks, reason: NotCommandedReason::Tick(tick) };
            self.first_fault.get_or_insert(first);
        }
    }

    /// Logs the changes of a tick.
    #[cold]
    #[inline(never)]
    fn log_tick(&self, tick: TickResult, faults: impl Iterator<Item = ModuleFault>) {
        let reason = tick.reason();
        let is_new = self.reason != Some(reason);
        for ModuleFault { module, cause } in faults {
            let is_why = tick == TickResult::ModuleFailed(module) && is_new;
            let what = if is_why { reason.number() } else { EventKind::ModuleIsolated as u8 };
            let event = Event { module: Some(module), ..Event::of(what) };
            self.log(match cause {
                FaultCause::InvalidOutput { signal, word, bits } => {
                    Event { signal: Some(signal), word, detail: bits, ..event }
                }
                FaultCause::TimeExceeded { budget_cycles } => Event { detail: budget_cycles, ..event },
            });
        }
        let event = Event::of(reason.number());
        match tick {
            _ if !is_new => {}
            TickResult::ModuleFailed(_) => {}
            TickResult::LinkLost { link } | TickResult::LinkDown { link } => {
                self.log(Event { detail: link.into(), ..event });
            }
            TickResult::MeasurementRefused(FrameError::NotFinite { signal, word }) => {
                self.log(Event { signal: Some(signal), word, detail: f32::NAN.to_bits(), ..event });
            }
            TickResult::MeasurementRefused(FrameError::Implausible { signal, word, bits }) => {
                self.log(Event { signal: Some(signal), word, detail: bits, ..event });
            }
            _ => self.log(event),
        }
    }

    /// Adds an event of this tick.
    pub(super) fn log(&self, event: Event) {
        if let Some(events) = self.events {
            events.add(u32::try_from(self.ticks & u64::from(u32::MAX)).unwrap_or_default(), event);
        }
    }

    /// Returns the heartbeat of the last tick. `dropped` is counted by the caller; the receiver of the line
    /// counts damaged frames.
    #[must_use]
    pub fn heartbeat(&self, dropped: u32) -> Heartbeat {
        let Self { ticks, blocked, first_fault, lease, .. } = self;
        let (ticks, blocked, first_fault) = (*ticks, *blocked, *first_fault);
        let events = self.events.map_or(0, EventLog::last);
        Heartbeat { ticks, blocked, first_fault, lease: lease.status(), dropped, damaged: 0, events }
    }

    /// Returns the telemetry samples that are due in the last tick.
    pub fn samples<'a>(&'a mut self, data_base: &'a DataBase) -> impl Iterator<Item = Sample> {
        let tick = u32::try_from(self.ticks & u64::from(u32::MAX)).unwrap_or_default();
        self.streams.iter_mut().filter_map(move |stream| stream.sample(tick, data_base))
    }

    pub(super) fn hear(&mut self, id: u16) {
        self.streams.iter_mut().for_each(|stream| stream.hear(id, self.patience_ticks));
    }

    pub(super) fn send(&mut self, wanted: Wanted, data_base: &DataBase) -> Result<u8, Refusal> {
        let place = usize::from(wanted.place);
        let stream = self.streams.get_mut(place / MAX_TELEMETRY_SIGNALS).ok_or(Refusal::TooLong)?;
        stream.ask(wanted, place % MAX_TELEMETRY_SIGNALS, self.patience_ticks, data_base)
    }

    /// Returns why a running scheme will not command the device in the next tick, if known.
    pub(super) fn keeps_still(&self) -> Option<NotCommandedReason> {
        let fault = self.blocked.filter(|blocked| blocked.reason().is_fault());
        fault.or_else(|| (!self.lease.is_armed()).then_some(NotCommandedReason::Tick(TickResult::Disarmed)))
    }

    /// Clears the recorded fault after a reset.
    pub(super) fn forget_fault(&mut self) {
        self.reason = self.reason.filter(|reason| !reason.is_fault());
        self.failed = 0;
        self.blocked = self.blocked.filter(|reason| !reason.reason().is_fault());
    }
}
