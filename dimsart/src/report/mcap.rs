//! Every recorded signal as MCAP (<https://mcap.dev>), while it is recorded: a message per source and row, in CDR, with its
//! schema as a ROS 2 message definition, which names each field's unit. So Foxglove and `PlotJuggler` open it as it is.
//!
//! Words of format f32 are `float32`, all others `float64`, which holds every one of them: a word of a row in which its
//! signal was not there is NaN. A source that gets more signals goes on under another topic: `/knee`, then `/knee/2`. What went
//! into a controller, tick by tick, is in `/knee/inputs`, before the signals of the same ticks.
//!
//! What the run was made of is attached, before the first message: a run that is killed leaves it, too.

mod inputs;
mod signals;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufWriter};
use std::sync::mpsc::Receiver;

use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, Compression, McapError, WriteOptions, Writer};

use super::RunFacts;
use super::signals::ControllerFacts;
use crate::cdr;
use hil_sim::recording::{Piece, TickInputs};
pub(crate) use inputs::{InputsMessage, PacketMessage, TOPIC as INPUTS_TOPIC};
pub(crate) use signals::Field;
use signals::Source;

/// What is lost at most when a run is killed: some hundred rows.
const CHUNK_BYTES: u64 = 256 * 1024;
const NS_PER_S: f64 = 1e9;
const SETTINGS_FILE: &str = "settings.toml";
/// Ends of the names of what is attached for each controller.
pub(crate) const SCHEME_END: &str = ".scheme";
pub(crate) const DEVICE_END: &str = ".device.json";

type McapFile<'a> = Writer<BufWriter<&'a File>>;

/// Writes what comes until the sender is gone.
pub(super) fn write(pieces: &Receiver<Piece>, file: &File, facts: &RunFacts) -> io::Result<()> {
    let mut recording = Recording::begin(file, facts).map_err(io_error)?;
    for piece in pieces {
        recording.add(piece).map_err(io_error)?;
    }
    recording.mcap.finish().map_err(io_error)?;
    Ok(())
}

/// The file, and what goes into a message of each source.
struct Recording<'a> {
    mcap: McapFile<'a>,
    facts: &'a RunFacts,
    sources: Vec<Source>,
    columns: usize,
    /// Channels with what went into controllers, by their places.
    inputs: BTreeMap<usize, u16>,
    sequence: u32,
    message: Vec<u8>,
}

impl<'a> Recording<'a> {
    fn begin(file: &'a File, facts: &'a RunFacts) -> Result<Self, McapError> {
        let options = WriteOptions::new()
            .compression(Some(Compression::Lz4))
            .chunk_size(Some(CHUNK_BYTES))
            .library(concat!("dimsart ", env!("CARGO_PKG_VERSION")));
        let mut mcap = options.create(BufWriter::new(file))?;
        attach(&mut mcap, facts)?;
        let (sources, inputs, message) = (Vec::new(), BTreeMap::new(), Vec::new());
        Ok(Self { mcap, facts, sources, columns: 0, inputs, sequence: 0, message })
    }

    fn add(&mut self, piece: Piece) -> Result<(), McapError> {
        match piece {
            Piece::Columns(columns) => {
                self.sources = Source::of_all(&mut self.mcap, &columns, std::mem::take(&mut self.sources))?;
                self.columns = columns.len();
                Ok(())
            }
            Piece::Inputs(inputs) => inputs.into_iter().try_for_each(|inputs| self.add_inputs(inputs)),
            Piece::Rows(values) => {
                values.chunks_exact(1 + self.columns).try_for_each(|row| self.add_row(row))
            }
        }
    }

    /// Adds a message of each source; a row is its time, `s`, and a value per column.
    fn add_row(&mut self, row: &[f64]) -> Result<(), McapError> {
        let Some((time_s, values)) = row.split_first() else { return Ok(()) };
        for source in &self.sources {
            self.message.clear();
            self.message.extend(cdr::MARK);
            source.fields.iter().for_each(|field| field.add(&mut self.message, values));
            let header = header(source.channel(), self.sequence, *time_s);
            self.mcap.write_to_known_channel(&header, &self.message)?;
        }
        self.sequence = self.sequence.wrapping_add(1);
        Ok(())
    }

    fn add_inputs(&mut self, TickInputs { time_s, station, inputs }: TickInputs) -> Result<(), McapError> {
        let channel = match self.inputs.get(&station) {
            Some(channel) => *channel,
            None => self.open_inputs(station)?,
        };
        // CDR has all that it is made of.
        let message = cdr::encode(&InputsMessage::from(inputs)).unwrap_or_default();
        self.mcap.write_to_known_channel(&header(channel, self.sequence, time_s), &message)
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

fn header(channel_id: u16, sequence: u32, time_s: f64) -> MessageHeader {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a run's time is positive")]
    let log_time = (time_s * NS_PER_S).round() as u64;
    MessageHeader { channel_id, sequence, log_time, publish_time: log_time }
}

/// Adds what the run is made of.
fn attach(mcap: &mut McapFile<'_>, facts: &RunFacts) -> Result<(), McapError> {
    let scheme_file = |name: &str| format!("{name}{SCHEME_END}");
    let mut metadata = BTreeMap::from(
        [("settings", SETTINGS_FILE), ("version", env!("CARGO_PKG_VERSION"))]
            .map(|(name, value)| (name.to_owned(), value.to_owned())),
    );
    let mut files = vec![(SETTINGS_FILE.to_owned(), "application/toml", &facts.settings_toml)];
    for ControllerFacts { name, scheme, device_json } in &facts.controllers {
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
