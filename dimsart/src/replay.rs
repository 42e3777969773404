//! Replays a recording in the core: the same inputs must produce the same signals, bit by bit.
//!
//! ```text
//! signals.mcap ─▶ NAME.device.json, NAME.scheme ─▶ ReplayedController
//!                 /NAME/inputs, tick by tick    ─▶   commands, packets, frame ─▶ Dimsart::tick
//!                 /NAME                         ─▶   compared, word by word   ─▶ Divergence
//! ```

mod controller;
mod device;
mod divergence;
mod error;
mod layout;
mod records;
mod signals;

use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;

use dimsart_core::ModuleKinds;
use serde::Serialize;

pub use device::DeviceDescription;
pub use divergence::Divergence;
pub use error::ReplayError;
pub use signals::{RecordedSignal, RecordedSignals, read_signals};

use crate::cdr;
use crate::report::{DEVICE_END, INPUTS_DEFINITION, INPUTS_TOPIC, InputsMessage, SCHEME_END, STAMP_BYTES};
use controller::ReplayedController;
use hil_sim::untrusted_text::{escape_line, escape_lines};
use layout::Layout;
use records::{Record, Records};

/// Messages between two progress reports.
const PROGRESS_MESSAGES: u64 = 4096;

/// Result of a replay.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Replay {
    /// Controllers whose inputs are in the file, by name.
    pub controllers: Vec<ReplayOutcome>,
    /// Whether the recording is incomplete, for example of a killed run.
    pub is_cut: bool,
    /// Time from its first to its last tick, `s`.
    pub recorded_s: f64,
}

/// Result of one controller.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReplayOutcome {
    /// Name.
    pub name: String,
    /// Replayed ticks.
    pub ticks: u64,
    /// Replayed commands.
    pub commands: u64,
    /// Compared words.
    pub words: u64,
    /// Rows of signals with a difference.
    pub differing_rows: u64,
    /// The first different word in order of computation.
    pub divergence: Option<Divergence>,
}

impl Replay {
    /// Returns whether a signal differs.
    #[must_use]
    pub fn diverges(&self) -> bool {
        self.controllers.iter().any(|controller| controller.divergence.is_some())
    }
}

/// Kind of the messages of a channel.
enum Meaning {
    Inputs(String),
    Signals(String, Layout),
}

/// Replays a recording in controllers with these module kinds. Calls `progress` repeatedly with the time of the recording, `s`.
///
/// # Errors
/// [`ReplayError`] when the file cannot be read or has no inputs; a divergence is not an error.
pub fn replay(path: &Path, kinds: ModuleKinds, mut progress: impl FnMut(f64)) -> Result<Replay, ReplayError> {
    let file = File::open(path).map_err(|source| ReplayError::File { path: path.to_owned(), source })?;
    let mut records = Records::new(file).map_err(|error| error.of(path))?;
    let (mut devices, mut schemes) = (BTreeMap::new(), BTreeMap::new());
    let (mut schemas, mut channels) = (BTreeMap::new(), BTreeMap::new());
    let mut controllers: BTreeMap<String, ReplayedController> = BTreeMap::new();
    let (mut messages, mut last_s) = (0_u64, 0.0_f64);
    while let Some(record) = records.next().map_err(|error| error.of(path))? {
        match record {
            Record::Attachment { name, data } => {
                let text = escape_lines(&String::from_utf8_lossy(&data));
                if let Some(name) = name.strip_suffix(DEVICE_END) {
                    devices.insert(escape_line(name), text);
                } else if let Some(name) = name.strip_suffix(SCHEME_END) {
                    schemes.insert(escape_line(name), text);
                }
            }
            Record::Schema { id, data } => {
                schemas.insert(id, escape_lines(&String::from_utf8_lossy(&data)));
            }
            Record::Channel { id, schema, topic } => {
                channels.extend(meaning(&topic, schemas.get(&schema))?.map(|meaning| (id, meaning)));
            }
            Record::Message { channel, data } => {
                messages += 1;
                if messages % PROGRESS_MESSAGES == 0 {
                    progress(last_s);
                }
                match channels.get(&channel) {
                    Some(Meaning::Inputs(name)) => {
                        let found: InputsMessage = cdr::decode(&data).ok_or(ReplayError::OtherInputs)?;
                        last_s = last_s.max(found.time_s);
                        if !controllers.contains_key(name) {
                            let (device, scheme) = (devices.get(name), schemes.get(name));
                            let controller = ReplayedController::new(name, device, scheme, kinds)?;
                            controllers.insert(name.clone(), controller);
                        }
                        if let Some(controller) = controllers.get_mut(name) {
                            controller.expect(found);
                        }
                    }
                    Some(Meaning::Signals(name, layout)) => {
                        if let Some(controller) = controllers.get_mut(name) {
                            let (tick, time_s) = stamp(&data).ok_or(ReplayError::OtherInputs)?;
                            last_s = last_s.max(time_s);
                            controller.compare(tick, time_s, &data, layout)?;
                        }
                    }
                    None => {}
                }
            }
        }
    }
    if controllers.is_empty() {
        return Err(ReplayError::NoInputs { path: path.to_owned() });
    }
    let controllers = controllers.into_values().map(ReplayedController::finish).collect::<Result<_, _>>()?;
    Ok(Replay { controllers, is_cut: records.is_unfinished(), recorded_s: last_s })
}

/// Returns the kind of a channel: `/NAME/inputs` has inputs, `/NAME` and `/NAME/2` have signals.
fn meaning(topic: &str, schema: Option<&String>) -> Result<Option<Meaning>, ReplayError> {
    let Some((topic, schema)) = topic.strip_prefix('/').zip(schema) else { return Ok(None) };
    if let Some(name) = topic.strip_suffix(INPUTS_TOPIC) {
        let is_known = schema == INPUTS_DEFINITION;
        return if is_known {
            Ok(Some(Meaning::Inputs(escape_line(name))))
        } else {
            Err(ReplayError::OtherInputs)
        };
    }
    let name = match topic.rsplit_once('/') {
        Some((name, number)) if number.parse::<u32>().is_ok() => name,
        _ => topic,
    };
    Ok(Layout::of_schema(schema).map(|layout| Meaning::Signals(escape_line(name), layout)))
}

/// Reads tick and time of a message of signals.
fn stamp(message: &[u8]) -> Option<(u64, f64)> {
    let stamp: [u8; STAMP_BYTES] = *message.strip_prefix(&cdr::MARK)?.first_chunk()?;
    let (tick, time_s) = stamp.split_first_chunk()?;
    Some((u64::from_le_bytes(*tick), f64::from_le_bytes(*time_s.first_chunk()?)))
}
