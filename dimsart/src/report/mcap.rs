//! Every recorded signal as MCAP (<https://mcap.dev>), while it is recorded: a message per source and row, in CDR, with its
//! schema as a ROS 2 message definition, which names each field's unit. So Foxglove and `PlotJuggler` open it as it is.
//!
//! Words of format f32 are `float32`, all others `float64`, which holds every one of them: a word of a row in which its
//! signal was not there is NaN.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{self, BufWriter, Seek as _};
use std::sync::mpsc::Receiver;

use dimsart_core::Format;
use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, Compression, McapError, WriteOptions, Writer};

use super::RunFacts;
use hil_sim::recording::{Column, Piece};

/// What is lost at most when a run is killed: some hundred rows.
const CHUNK_BYTES: u64 = 256 * 1024;
const NS_PER_S: f64 = 1e9;
/// What a CDR message in little endian begins with.
const CDR_LITTLE_ENDIAN: [u8; 4] = [0, 1, 0, 0];
const SETTINGS_FILE: &str = "settings.toml";

type McapFile<'a> = Writer<BufWriter<&'a File>>;

/// Writes what comes until the sender is gone.
pub(super) fn write(pieces: &Receiver<Piece>, file: &File, facts: &RunFacts) -> io::Result<()> {
    let mut signals = Signals::begin(file, &[], facts)?;
    for piece in pieces {
        match piece {
            Piece::Columns(columns) => {
                // Whatever waits is written before the file begins anew.
                drop(signals.mcap.into_inner());
                signals = Signals::begin(file, &columns, facts)?;
            }
            Piece::Rows(values) => {
                values.chunks_exact(1 + signals.columns).try_for_each(|row| signals.add(row))?;
            }
        }
    }
    attach(&mut signals.mcap, facts).and_then(|()| signals.mcap.finish()).map_err(io_error)?;
    Ok(())
}

/// The file, and what goes into a message of each source.
struct Signals<'a> {
    mcap: McapFile<'a>,
    sources: Vec<Source>,
    columns: usize,
    sequence: u32,
    message: Vec<u8>,
}

/// Who has signals: one channel.
struct Source {
    channel: u16,
    fields: Vec<Field>,
}

/// A signal, or what is recorded of it.
struct Field {
    /// Where its words are in a row.
    columns: Vec<usize>,
    is_single: bool,
}

impl<'a> Signals<'a> {
    /// Begins the file anew, with these columns.
    fn begin(mut file: &'a File, columns: &[Column], facts: &RunFacts) -> io::Result<Self> {
        file.rewind()?;
        file.set_len(0)?;
        let options = WriteOptions::new()
            .compression(Some(Compression::Lz4))
            .chunk_size(Some(CHUNK_BYTES))
            .library(concat!("dimsart ", env!("CARGO_PKG_VERSION")));
        let mut mcap = options.create(BufWriter::new(file)).map_err(io_error)?;
        let sources = sources(&mut mcap, columns).map_err(io_error)?;
        let metadata = [("settings", SETTINGS_FILE), ("version", env!("CARGO_PKG_VERSION"))];
        let metadata = metadata.map(|(name, value)| (name.to_owned(), value.to_owned()));
        let schemes = facts.schemes.iter().map(|(name, _)| (format!("scheme of {name}"), scheme_file(name)));
        let metadata =
            Metadata { name: "dimsart".to_owned(), metadata: metadata.into_iter().chain(schemes).collect() };
        mcap.write_metadata(&metadata).map_err(io_error)?;
        Ok(Self { mcap, sources, columns: columns.len(), sequence: 0, message: Vec::new() })
    }

    /// Adds a message of each source; a row is its time, `s`, and a value per column.
    fn add(&mut self, row: &[f64]) -> io::Result<()> {
        let Some((time_s, values)) = row.split_first() else { return Ok(()) };
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a run's time is positive"
        )]
        let log_time = (time_s * NS_PER_S).round() as u64;
        for source in &self.sources {
            self.message.clear();
            self.message.extend(CDR_LITTLE_ENDIAN);
            source.fields.iter().for_each(|field| field.add(&mut self.message, values));
            let header = MessageHeader {
                channel_id: source.channel,
                sequence: self.sequence,
                log_time,
                publish_time: log_time,
            };
            self.mcap.write_to_known_channel(&header, &self.message).map_err(io_error)?;
        }
        self.sequence = self.sequence.wrapping_add(1);
        Ok(())
    }
}

impl Field {
    /// Adds its words to a CDR message, aligned to their size.
    fn add(&self, message: &mut Vec<u8>, row: &[f64]) {
        let values = self.columns.iter().map(|column| row.get(*column).copied().unwrap_or(f64::NAN));
        let size = if self.is_single { size_of::<f32>() } else { size_of::<f64>() };
        let body = message.len() - CDR_LITTLE_ENDIAN.len();
        message.resize(CDR_LITTLE_ENDIAN.len() + body.next_multiple_of(size), 0);
        for value in values {
            if self.is_single {
                #[expect(clippy::cast_possible_truncation, reason = "it is an f32")]
                message.extend((value as f32).to_le_bytes());
            } else {
                message.extend(value.to_le_bytes());
            }
        }
    }
}

/// A channel for each source of these columns.
fn sources(mcap: &mut McapFile<'_>, columns: &[Column]) -> Result<Vec<Source>, McapError> {
    let mut by_source: BTreeMap<&str, Vec<(usize, &Column)>> = BTreeMap::new();
    for (place, column) in columns.iter().enumerate() {
        by_source.entry(&column.source).or_default().push((place, column));
    }
    let source = |(name, columns): (&str, Vec<(usize, &Column)>)| {
        let mut fields: Vec<(Field, &Column)> = Vec::new();
        for (place, column) in columns {
            // The energy in the channel is recorded as a sum and by axis.
            let is_same =
                |first: &Column| first.signal == column.signal && first.indices.len() == column.indices.len();
            match fields.iter_mut().find(|(_, first)| is_same(first)) {
                Some((field, _)) => field.columns.push(place),
                None => {
                    let is_single = column.format == Some(Format::F32);
                    fields.push((Field { columns: vec![place], is_single }, column));
                }
            }
        }
        let mut names = BTreeSet::new();
        let definition: String =
            fields.iter().map(|(field, first)| field_definition(field, first, &mut names)).collect();
        let schema_name = format!("dimsart/msg/{}", camel_case(name));
        let schema = mcap.add_schema(&schema_name, "ros2msg", definition.as_bytes())?;
        let channel = mcap.add_channel(schema, &format!("/{name}"), "cdr", &BTreeMap::new())?;
        Ok(Source { channel, fields: fields.into_iter().map(|(field, _)| field).collect() })
    };
    by_source.into_iter().map(source).collect()
}

/// A line of a message definition: `float32[3] position # POSITION (m)`; `names` are those of the lines before.
fn field_definition(field: &Field, first: &Column, names: &mut BTreeSet<String>) -> String {
    let format = if field.is_single { "float32" } else { "float64" };
    let count = if first.indices.is_empty() { String::new() } else { format!("[{}]", field.columns.len()) };
    let unit = if first.unit.is_empty() { String::new() } else { format!(" ({})", first.unit) };
    let mut name = snake_case(&first.signal);
    while !names.insert(name.clone()) {
        name.push_str(if first.indices.is_empty() { "_next" } else { "_by_axis" });
    }
    format!("{format}{count} {name} # {}{unit}\n", first.signal)
}

/// As ROS 2 wants the names of fields.
fn snake_case(name: &str) -> String {
    let letter =
        |letter: char| if letter.is_ascii_alphanumeric() { letter.to_ascii_lowercase() } else { '_' };
    let name: String = name.chars().map(letter).collect();
    if name.starts_with(|first: char| first.is_ascii_lowercase()) { name } else { format!("signal_{name}") }
}

/// As ROS 2 wants the names of messages.
fn camel_case(name: &str) -> String {
    let words = name.split(|letter: char| !letter.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    let word = |word: &str| {
        let (first, rest) = word.split_at(1);
        first.to_ascii_uppercase() + rest
    };
    words.map(word).collect()
}

/// Adds what the run was made of.
fn attach(mcap: &mut McapFile<'_>, facts: &RunFacts) -> Result<(), McapError> {
    let settings = (SETTINGS_FILE.to_owned(), "application/toml", &facts.settings_toml);
    let schemes = facts.schemes.iter().map(|(name, text)| (scheme_file(name), "text/plain", text));
    for (name, media_type, text) in std::iter::once(settings).chain(schemes) {
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

fn scheme_file(controller: &str) -> String {
    format!("{controller}.scheme")
}

fn io_error(error: McapError) -> io::Error {
    match error {
        McapError::Io(source) => source,
        other => io::Error::other(other),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;

    use super::*;

    fn column(source: &str, signal: &str, indices: &[usize], format: Option<Format>) -> Column {
        let (source, signal) = (source.to_owned(), signal.to_owned());
        Column { source, signal, indices: indices.to_vec(), unit: "m".to_owned(), format }
    }

    fn written(pieces: impl IntoIterator<Item = Piece>, facts: &RunFacts) -> Vec<u8> {
        let (sender, receiver) = channel();
        pieces.into_iter().for_each(|piece| sender.send(piece).unwrap());
        drop(sender);
        let file = tempfile::NamedTempFile::new().unwrap();
        write(&receiver, file.as_file(), facts).unwrap();
        std::fs::read(file.path()).unwrap()
    }

    #[test]
    fn a_message_has_the_words_of_its_source_aligned_to_their_size() {
        let columns = vec![
            column("knee joint", "POSITION", &[0], Some(Format::F32)),
            column("world", "knee.position", &[0], None),
            column("knee joint", "LINK_LOST", &[], Some(Format::U32)),
            column("knee joint", "POSITION", &[1], Some(Format::F32)),
            column("knee joint", "ON", &[], Some(Format::Bool)),
        ];
        let rows = Piece::Rows(vec![0.25, 0.5, 7.0, 3.0, -0.5, f64::NAN]);
        let bytes = written([Piece::Columns(columns), rows], &RunFacts::default());
        let messages: Vec<_> = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap).collect();
        let [knee, world] = messages.as_slice() else { panic!("{} messages", messages.len()) };
        assert_eq!((knee.channel.topic.as_str(), world.channel.topic.as_str()), ("/knee joint", "/world"));
        assert_eq!((knee.log_time, knee.publish_time, knee.sequence), (250_000_000, 250_000_000, 0));
        let schema = knee.channel.schema.as_ref().unwrap();
        assert_eq!((schema.name.as_str(), schema.encoding.as_str()), ("dimsart/msg/KneeJoint", "ros2msg"));
        assert_eq!(
            std::str::from_utf8(&schema.data).unwrap(),
            "float32[2] position # POSITION (m)\nfloat64 link_lost # LINK_LOST (m)\nfloat64 on # ON (m)\n"
        );
        let expected = [
            CDR_LITTLE_ENDIAN.as_slice(),
            &0.5_f32.to_le_bytes(),
            &(-0.5_f32).to_le_bytes(),
            &3.0_f64.to_le_bytes(),
            &f64::NAN.to_le_bytes(),
        ];
        assert_eq!(knee.data, expected.concat());
        assert_eq!(world.data, [CDR_LITTLE_ENDIAN.as_slice(), &7.0_f64.to_le_bytes()].concat());
    }

    #[test]
    fn fields_have_names_of_their_own() {
        let columns = [("energy", &[] as &[usize]), ("energy", &[0]), ("Energy", &[]), ("2nd.axis", &[])];
        let columns = columns.map(|(signal, indices)| column("world", signal, indices, None));
        let rows = Piece::Rows(vec![0.0; 5]);
        let bytes = written([Piece::Columns(columns.to_vec()), rows], &RunFacts::default());
        let message = mcap::MessageStream::new(&bytes).unwrap().next().unwrap().unwrap();
        let definition = String::from_utf8(message.channel.schema.as_ref().unwrap().data.to_vec()).unwrap();
        let names: Vec<&str> = definition.lines().filter_map(|line| line.split(' ').nth(1)).collect();
        assert_eq!(names, ["energy", "energy_by_axis", "energy_next", "signal_2nd_axis"]);
    }

    #[test]
    fn a_file_that_begins_anew_has_nothing_of_the_one_before_and_all_that_made_the_run() {
        let facts = RunFacts {
            settings_toml: "seed = 7\n".to_owned(),
            schemes: vec![("knee".to_owned(), "knee  MOD_ENG  MATCHING_CHECK\n".to_owned())],
        };
        let (one, other) = (column("knee", "ONE", &[], None), column("knee", "OTHER", &[], None));
        let rows = |width: usize| (0..50_000).map(move |_| Piece::Rows(vec![0.5; 1 + width]));
        let anew = [Piece::Columns(vec![one.clone(), other])];
        let pieces =
            [Piece::Columns(vec![one])].into_iter().chain(rows(1)).chain(anew).chain(rows(2).take(500));
        let bytes = written(pieces, &facts);
        let messages: Vec<_> = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap).collect();
        assert_eq!(messages.len(), 500);
        assert!(messages.iter().all(|message| message.data.len() == 4 + 2 * size_of::<f64>()));
        let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
        let attached = summary.attachment_indexes.iter().map(|index| {
            let attachment = mcap::read::attachment(&bytes, index).unwrap();
            (attachment.name, String::from_utf8(attachment.data.into_owned()).unwrap())
        });
        let (settings, scheme) = (facts.settings_toml.clone(), facts.schemes[0].1.clone());
        let expected = [("settings.toml".to_owned(), settings), ("knee.scheme".to_owned(), scheme)];
        assert!(attached.eq(expected));
    }
}
