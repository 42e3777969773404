//! Writes recorded signals as MCAP (<https://mcap.dev>) during the run: one CDR message per source and row, with a ROS 2
//! message definition that contains the units. Foxglove and `PlotJuggler` open the file directly.
//!
//! Words of format f32 are `float32`, all others `float64`, which is exact for them; a missing signal is NaN. A source that
//! gets more signals continues under another topic: `/knee`, then `/knee/2`. The inputs of a controller for each tick are in
//! `/knee/inputs`, before the signals of the same ticks. Each message starts with number and time of the tick; `log_time` is
//! wall-clock time.
//!
//! Settings and schemes are attached before the first message. A killed run keeps them and all but the last 0.25 s of signals.

mod inputs;
mod signals;
#[cfg(test)]
mod tests;
mod wall_clock;
mod whole_file;

use std::collections::{BTreeMap, VecDeque};
use std::fs::File;
use std::io::{self, Write as _};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, Compression, McapError, WriteOptions, Writer};

use super::facts::{ControllerMetadata, RunMetadata};
use crate::cdr;
use hil_sim::recording::{RecordingChunk, TickInputs};
pub(crate) use inputs::{
    DEFINITION as INPUTS_DEFINITION, InputsMessage, PacketMessage, TOPIC as INPUTS_TOPIC,
};
use signals::Source;
pub(crate) use signals::{Field, STAMP_BYTES, STAMP_DEFINITION};
use wall_clock::WallClock;
use whole_file::WholeFile;

/// Size and age at which a chunk is written: limits the loss of a killed run.
const CHUNK_BYTES: usize = 256 * 1024;
const CHUNK_TIME: Duration = Duration::from_millis(250);
const SETTINGS_FILE: &str = "settings.toml";
/// Name suffixes of the attachments of each controller.
pub(crate) const SCHEME_END: &str = ".scheme";
pub(crate) const DEVICE_END: &str = ".device.json";

type McapFile<'a> = Writer<WholeFile<'a>>;

/// Writes received rows until the sender is dropped.
pub(crate) fn write(pieces: &Receiver<RecordingChunk>, file: &File, facts: &RunMetadata) -> io::Result<()> {
    let mut recording = Recording::begin(file, facts).map_err(io_error)?;
    loop {
        match pieces.recv_timeout(CHUNK_TIME.saturating_sub(recording.written.elapsed())) {
            Ok(piece) => recording.add(piece).map_err(io_error)?,
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break,
        }
        if recording.unwritten_bytes >= CHUNK_BYTES || recording.written.elapsed() >= CHUNK_TIME {
            recording.write_chunk().map_err(io_error)?;
        }
    }
    recording.add_inputs_until(f64::INFINITY).map_err(io_error)?;
    recording.mcap.finish().map_err(io_error)?;
    recording.mcap.into_inner().flush()
}

/// The file, and the message layout of each source.
struct Recording<'a> {
    mcap: McapFile<'a>,
    facts: &'a RunMetadata,
    clock: WallClock,
    sources: Vec<Source>,
    columns: usize,
    /// Inputs of ticks whose signals are still to be written: readers without an index need messages in order of time.
    waiting: VecDeque<TickInputs>,
    /// Channels of controller inputs, by controller index.
    inputs: BTreeMap<usize, u16>,
    sequence: u32,
    message: Vec<u8>,
    /// Number of unwritten bytes, and the time of the first of them.
    unwritten_bytes: usize,
    written: Instant,
}

impl<'a> Recording<'a> {
    fn begin(file: &'a File, facts: &'a RunMetadata) -> Result<Self, McapError> {
        let options = WriteOptions::new()
            .compression(Some(Compression::Lz4))
            .chunk_size(None)
            .disable_seeking(true)
            .profile("ros2")
            .library(concat!("dimsart ", env!("CARGO_PKG_VERSION")));
        let mut mcap = options.create(WholeFile::new(file))?;
        attach(&mut mcap, facts)?;
        let mut recording = Self {
            mcap,
            facts,
            clock: WallClock::new(facts.time_base),
            sources: Vec::new(),
            columns: 0,
            waiting: VecDeque::new(),
            inputs: BTreeMap::new(),
            sequence: 0,
            message: Vec::new(),
            unwritten_bytes: 0,
            written: Instant::now(),
        };
        recording.write_chunk()?;
        Ok(recording)
    }

    /// Closes the chunk and writes it.
    fn write_chunk(&mut self) -> Result<(), McapError> {
        (self.unwritten_bytes, self.written) = (0, Instant::now());
        self.mcap.flush()
    }

    fn add(&mut self, piece: RecordingChunk) -> Result<(), McapError> {
        match piece {
            RecordingChunk::Columns(columns) => {
                self.sources = Source::of_all(&mut self.mcap, &columns, std::mem::take(&mut self.sources))?;
                self.columns = columns.len();
                Ok(())
            }
            RecordingChunk::Inputs(inputs) => {
                self.waiting.extend(inputs);
                Ok(())
            }
            RecordingChunk::Rows(values) => {
                let mut rows = values.chunks_exact(2 + self.columns);
                let last_s = rows.clone().last().and_then(|row| row.get(1));
                last_s.into_iter().for_each(|time_s| self.clock.observe(*time_s));
                rows.try_for_each(|row| self.add_row(row))
            }
        }
    }

    /// Adds a message of each source; a row consists of tick, time in `s`, and a value per column.
    fn add_row(&mut self, row: &[f64]) -> Result<(), McapError> {
        let Some(([tick, time_s], values)) = row.split_first_chunk() else { return Ok(()) };
        self.add_inputs_until(*time_s)?;
        for source in &self.sources {
            self.message.clear();
            self.message.extend(cdr::MARK);
            signals::add_stamp(&mut self.message, *tick, *time_s);
            source.fields.iter().for_each(|field| field.add(&mut self.message, values));
            let header = header(source.channel(), self.sequence, self.clock.log_time(*time_s));
            self.mcap.write_to_known_channel(&header, &self.message)?;
            self.unwritten_bytes += self.message.len();
        }
        self.sequence = self.sequence.wrapping_add(1);
        Ok(())
    }

    fn add_inputs_until(&mut self, time_s: f64) -> Result<(), McapError> {
        while let Some(inputs) = self.waiting.pop_front_if(|inputs| inputs.time_s <= time_s) {
            self.add_inputs(inputs)?;
        }
        Ok(())
    }

    fn add_inputs(&mut self, inputs: TickInputs) -> Result<(), McapError> {
        let TickInputs { time_s, station, .. } = inputs;
        let channel = match self.inputs.get(&station) {
            Some(channel) => *channel,
            None => self.open_inputs(station)?,
        };
        // CDR supports all fields.
        let message = cdr::encode(&InputsMessage::from(inputs)).unwrap_or_default();
        self.unwritten_bytes += message.len();
        self.mcap
            .write_to_known_channel(&header(channel, self.sequence, self.clock.log_time(time_s)), &message)
    }

    fn open_inputs(&mut self, station: usize) -> Result<u16, McapError> {
        let name = self.facts.controllers.get(station).map_or("", |controller| &controller.name);
        let schema = self.mcap.add_schema(inputs::SCHEMA, "ros2msg", inputs::DEFINITION.as_bytes())?;
        let topic = format!("/{name}{INPUTS_TOPIC}");
        let channel = self.mcap.add_channel(schema, &topic, "cdr", &BTreeMap::new())?;
        self.inputs.insert(station, channel);
        Ok(channel)
    }
}

fn header(channel_id: u16, sequence: u32, log_time: u64) -> MessageHeader {
    MessageHeader { channel_id, sequence, log_time, publish_time: log_time }
}

/// Attaches settings and controllers of the run.
fn attach(mcap: &mut McapFile<'_>, facts: &RunMetadata) -> Result<(), McapError> {
    let scheme_file = |name: &str| format!("{name}{SCHEME_END}");
    let mut metadata = BTreeMap::from(
        [("settings", SETTINGS_FILE), ("version", env!("CARGO_PKG_VERSION"))]
            .map(|(name, value)| (name.to_owned(), value.to_owned())),
    );
    let mut files = vec![(SETTINGS_FILE.to_owned(), "application/toml", &facts.settings_toml)];
    for ControllerMetadata { name, scheme, device_json } in &facts.controllers {
        metadata.insert(format!("scheme of {name}"), scheme_file(name));
        files.push((scheme_file(name), "text/plain", scheme));
        files
            .extend(device_json.iter().map(|json| (format!("{name}{DEVICE_END}"), "application/json", json)));
    }
    mcap.write_metadata(&Metadata { name: "dimsart".to_owned(), metadata })?;
    for (name, media_type, text) in files {
        mcap.attach(&Attachment {
            log_time: 0,
            create_time: 0,
            name,
            media_type: media_type.to_owned(),
            data: text.as_bytes().into(),
        })?;
    }
    Ok(())
}

fn io_error(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        other => io::Error::other(other),
    }
}
