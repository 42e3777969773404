//! News of a station, decoded from the JSON of the [`connect`](crate::connect) reports.

use std::fmt;

use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

/// A piece of news.
#[derive(Debug)]
pub(super) enum Told {
    /// Why the line to the device is closed; `None` when it is open.
    Disconnected(Option<String>),
    Status(Status),
    Faults(Faults),
    Overview(Overview),
    Events(Vec<Event>),
    /// Why motion has ended unexpectedly.
    Lost(Lost),
}

#[derive(Debug, Clone, Deserialize)]
pub(super) struct Status {
    pub(super) live: Live,
    /// The client of this program that holds the lease: the terminal is its only client.
    pub(super) holder: Option<u64>,
}

#[derive(Debug, Clone, Deserialize)]
pub(super) struct Live {
    pub(super) ticks: u64,
    pub(super) is_commanded: bool,
    pub(super) state: String,
    pub(super) holder: Option<u8>,
    pub(super) silence_s: Option<f64>,
}

#[derive(Debug, Clone, Deserialize)]
pub(super) struct Faults {
    pub(super) first_fault: Option<FirstFault>,
    pub(super) drive: String,
    pub(super) cut_out: Option<String>,
    pub(super) findings: Vec<Finding>,
}

#[derive(Debug, Clone, Deserialize)]
pub(super) struct FirstFault {
    pub(super) tick: u64,
    pub(super) reason: String,
}

#[derive(Debug, Clone, Deserialize)]
pub(super) struct Finding {
    pub(super) is_fault: bool,
    pub(super) text: String,
}

#[derive(Debug, Clone, Deserialize)]
pub(super) struct Overview {
    pub(super) identity: Identity,
    pub(super) modules: Vec<Module>,
    pub(super) signals: Vec<Signal>,
}

#[derive(Debug, Clone, Deserialize)]
pub(super) struct Identity {
    pub(super) sample_period_s: f64,
}

#[derive(Debug, Clone, Deserialize)]
pub(super) struct Module {
    pub(super) name: String,
    /// Position in the plug-in order; `None` while it is unplugged.
    pub(super) place: Option<u16>,
    pub(super) parameters: Vec<Parameter>,
}

#[derive(Debug, Clone, Deserialize)]
pub(super) struct Parameter {
    pub(super) name: String,
    pub(super) values: Vec<Value>,
    pub(super) unit: String,
    pub(super) range: String,
    pub(super) summary: String,
    pub(super) default: Option<Value>,
}

#[derive(Debug, Clone, Deserialize)]
pub(super) struct Signal {
    pub(super) name: String,
    pub(super) unit: String,
    pub(super) values: Vec<Value>,
}

#[derive(Debug, Clone, Deserialize)]
pub(super) struct Event {
    pub(super) number: u32,
    pub(super) tick: u32,
    pub(super) name: String,
    pub(super) text: String,
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} tick {} {}", self.number, self.tick, self.name)?;
        if self.text.is_empty() { Ok(()) } else { write!(f, ": {}", self.text) }
    }
}

#[derive(Debug, Clone, Deserialize)]
pub(super) struct Lost {
    pub(super) reason: String,
}

impl Told {
    /// Decodes news; `None` for news that only the page uses.
    pub(super) fn read(text: &str) -> Option<Self> {
        #[derive(Deserialize)]
        struct Message {
            kind: String,
            content: Value,
        }
        let Message { kind, content } = serde_json::from_str(text).ok()?;
        Some(match kind.as_str() {
            "gone" => Self::Disconnected(read(content)?),
            "status" => Self::Status(read(content)?),
            "faults" => Self::Faults(read(content)?),
            "overview" => Self::Overview(read(content)?),
            "events" => Self::Events(read(content)?),
            "lost" => Self::Lost(read(content)?),
            _ => return None,
        })
    }
}

fn read<T: DeserializeOwned>(content: Value) -> Option<T> {
    serde_json::from_value(content).ok()
}
