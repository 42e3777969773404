//! What happened on a device, in the order in which it happened.

use std::fmt;
use std::io::{Read, Write};

use dimsart_core::{FaultCause, ModuleFault, Reason, Vocabulary as _};
use dimsart_link::protocol::{Request, Response};
use dimsart_link::{Event, EventKind, MAX_EVENTS, StartCause};
use serde::Serialize;

use super::device::take;
use super::kept::known;
use super::{ConnectError, Device};

/// An event of a device.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct EventText {
    /// Counts events, from 1; over restarts of the device, too.
    pub number: u32,
    /// Tick, from the device's start.
    pub tick: u32,
    /// Number of what happened; `docs/faults.md` says what to do next.
    pub what: u8,
    /// Its name.
    pub name: &'static str,
    /// What it is about, in words; empty where there is nothing more to say.
    pub text: String,
    /// A link, a cause, a register, or the word's bits.
    #[serde(skip)]
    pub detail: u32,
}

/// The last events of a device, the oldest first.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Events(pub Vec<EventText>);

impl fmt::Display for Events {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.is_empty() {
            return write!(f, "no events: nothing has happened, or the device keeps none");
        }
        for (place, EventText { number, tick, what, name, text, .. }) in self.0.iter().enumerate() {
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
    /// The last events, the oldest first.
    ///
    /// # Errors
    /// [`ConnectError`] when the device does not answer.
    pub fn events(&mut self) -> Result<Events, ConnectError> {
        let mut events = Vec::<Event>::new();
        let mut back = 0;
        while usize::from(back) < MAX_EVENTS {
            let answer: Option<Event> = known(self.ask(&Request::Event { back }, take!(Event)))?;
            let Some(event) = answer else { break };
            // Others may have happened since the last question: then this one is among them already.
            if events.last().is_none_or(|last| event.number < last.number) {
                events.push(event);
            }
            back += 1;
        }
        let texts = events.into_iter().rev().map(|event| self.event_text(&event));
        Ok(Events(texts.collect::<Result<_, _>>()?))
    }

    fn event_text(&mut self, event: &Event) -> Result<EventText, ConnectError> {
        let Event { number, tick, what, module, signal, word, detail } = *event;
        let is = |kind: EventKind| what == kind as u8;
        let is_reason = |reason: Reason| what == reason.number();
        let text = match (module, signal) {
            (Some(module), _) => {
                let cause = signal.map_or(FaultCause::TookTooLong { budget_cycles: detail }, |signal| {
                    FaultCause::Wrote { signal, word, bits: detail }
                });
                self.module_fault_text(ModuleFault { module, cause })?
            }
            (None, Some(signal)) => self.know(|known| {
                let (name, value) = (known.name_of_signal(signal), f32::from_bits(detail));
                match value.is_finite() {
                    true => format!("word {word} of {name} shows {value}, which its sensor cannot"),
                    false => format!("word {word} of {name} is not a finite number"),
                }
            })?,
            _ if is_reason(Reason::LinkLost) || is_reason(Reason::LinkDown) => format!("link {detail}"),
            _ if is(EventKind::Started) => start_cause(detail).to_owned(),
            _ if is(EventKind::Exception) => format!("CFSR {detail:#010x}"),
            _ => String::new(),
        };
        let name = match event.name() {
            Some("none") => "the scheme commands the device",
            Some(name) => name,
            None => "unknown to this version",
        };
        Ok(EventText { number, tick, what, name, text, detail })
    }
}

fn start_cause(detail: u32) -> &'static str {
    let causes = [
        (StartCause::Power, "its supply came"),
        (StartCause::Pin, "by its reset pin"),
        (StartCause::Program, "by its own program"),
        (
            StartCause::Watchdog,
            "by its watchdog: ticks did not keep their time, or the communication stood still",
        ),
    ];
    let found = causes.into_iter().find(|(cause, _)| *cause as u32 == detail);
    found.map_or("for a cause that it cannot tell", |(_, text)| text)
}
