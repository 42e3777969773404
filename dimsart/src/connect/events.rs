//! Event log of a device, oldest event first.

use std::fmt;
use std::io::{Read, Write};

use dimsart_core::{FaultCause, ModuleFault, SafetyReason, Vocabulary as _};
use dimsart_link::protocol::{Request, Response};
use dimsart_link::{Event, EventKind, MAX_EVENTS, StartCause};
use serde::Serialize;

use super::device::take;
use super::stored_schemes::known;
use super::{ConnectError, Device};

/// An event of a device.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct EventReport {
    /// Event number, from 1; continues after a restart of the device.
    pub number: u32,
    /// Tick since the start of the device.
    pub tick: u32,
    /// Event code; see `docs/faults.md`.
    pub what: u8,
    /// Event name.
    pub name: &'static str,
    /// Details; may be empty.
    pub text: String,
    /// A link, a cause, a register, or the bits of a word.
    #[serde(skip)]
    pub detail: u32,
}

/// The last events of a device, oldest first.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Events(pub Vec<EventReport>);

impl fmt::Display for Events {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.is_empty() {
            return write!(f, "no events, or the device has no event log");
        }
        for (place, EventReport { number, tick, what, name, text, .. }) in self.0.iter().enumerate() {
            let line = if place == 0 { "" } else { "\n" };
            write!(f, "{line}{number:>6}  tick {tick:>9}  {what:>3} {name}")?;
            if !text.is_empty() {
                write!(f, ": {text}")?;
            }
        }
        Ok(())
    }
}

impl<S: Read + Write> Device<S> {
    /// Reads the last events, oldest first.
    ///
    /// # Errors
    /// [`ConnectError`] when the device does not answer.
    pub fn events(&mut self) -> Result<Events, ConnectError> {
        let mut events = Vec::<Event>::new();
        let mut back = 0;
        while usize::from(back) < MAX_EVENTS {
            let answer: Option<Event> = known(self.ask(&Request::Event { back }, take!(Event)))?;
            let Some(event) = answer else { break };
            // New events shift the log between two requests: skip an event that was read already.
            if events.last().is_none_or(|last| event.number < last.number) {
                events.push(event);
            }
            back += 1;
        }
        let texts = events.into_iter().rev().map(|event| self.event_text(&event));
        Ok(Events(texts.collect::<Result<_, _>>()?))
    }

    fn event_text(&mut self, event: &Event) -> Result<EventReport, ConnectError> {
        let Event { number, tick, what, module, signal, word, detail } = *event;
        let is = |kind: EventKind| what == kind as u8;
        let is_reason = |reason: SafetyReason| what == reason.number();
        let text = match (module, signal) {
            (Some(module), _) => {
                let cause = signal.map_or(FaultCause::TimeExceeded { budget_cycles: detail }, |signal| {
                    FaultCause::InvalidOutput { signal, word, bits: detail }
                });
                self.module_fault_text(ModuleFault { module, cause })?
            }
            (None, Some(signal)) => self.know(|known| {
                let (name, value) = (known.signal_name(signal), f32::from_bits(detail));
                match value.is_finite() {
                    true => format!("word {word} of {name} is {value}, outside the sensor's range"),
                    false => format!("word {word} of {name} is NaN or infinite"),
                }
            })?,
            _ if is_reason(SafetyReason::LinkLost) || is_reason(SafetyReason::LinkDown) => {
                format!("link {detail}")
            }
            _ if is(EventKind::Started) => start_cause(detail).to_owned(),
            _ if is(EventKind::Exception) => format!("CFSR {detail:#010x}"),
            _ => String::new(),
        };
        let name = match event.name() {
            Some("none") => "the scheme commands the device",
            Some(name) => name,
            None => "unknown event of a newer version",
        };
        Ok(EventReport { number, tick, what, name, text, detail })
    }
}

fn start_cause(detail: u32) -> &'static str {
    let causes = [
        (StartCause::Power, "power-on"),
        (StartCause::Pin, "reset pin"),
        (StartCause::Program, "software reset"),
        (StartCause::Watchdog, "watchdog: ticks overran, or the communication stalled"),
    ];
    let found = causes.into_iter().find(|(cause, _)| *cause as u32 == detail);
    found.map_or("unknown cause", |(_, text)| text)
}
