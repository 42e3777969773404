//! Channel of the signals of one source; its schema contains their names and units.

use std::collections::{BTreeMap, BTreeSet};

use dimsart_core::Format;
use mcap::McapError;

use super::McapFile;
use crate::cdr;
use hil_sim::recording::Column;

/// Tick and time at the start of each message: lines of the definition, and their bytes.
pub(crate) const STAMP_DEFINITION: &str = "uint64 tick # number of the tick\nfloat64 time_s # its time\n";
pub(crate) const STAMP_BYTES: usize = size_of::<u64>() + size_of::<f64>();

/// Adds tick and time.
pub(super) fn add_stamp(message: &mut Vec<u8>, tick: f64, time_s: f64) {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a whole number")]
    let tick = tick as u64;
    message.extend(tick.to_le_bytes());
    message.extend(time_s.to_le_bytes());
}

/// A signal, or its recorded part.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Field {
    /// Columns of its words in a row.
    pub(crate) columns: Vec<usize>,
    /// Whether they are `f32` instead of `f64`.
    pub(crate) is_single: bool,
}

/// A source of signals.
#[derive(Debug)]
pub(super) struct Source {
    name: String,
    /// Number of its previous channels, one per set of signals.
    number: usize,
    channel: u16,
    /// Fields of its schema.
    columns: Vec<Column>,
    pub(super) fields: Vec<Field>,
}

impl Field {
    /// Returns the size of a word.
    pub(crate) const fn word_bytes(&self) -> usize {
        if self.is_single { size_of::<f32>() } else { size_of::<f64>() }
    }

    /// Appends its words to a CDR message, aligned to their size.
    pub(crate) fn add(&self, message: &mut Vec<u8>, row: &[f64]) {
        let values = self.columns.iter().map(|column| row.get(*column).copied().unwrap_or(f64::NAN));
        let size = self.word_bytes();
        let body = message.len() - cdr::MARK.len();
        message.resize(cdr::MARK.len() + body.next_multiple_of(size), 0);
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

impl Source {
    pub(super) const fn channel(&self) -> u16 {
        self.channel
    }

    /// Creates channels for the sources of these columns; a source with unchanged columns keeps its channel from `before`.
    pub(super) fn of_all(
        mcap: &mut McapFile<'_>,
        columns: &[Column],
        before: Vec<Self>,
    ) -> Result<Vec<Self>, McapError> {
        let mut by_source: BTreeMap<&str, Vec<(usize, &Column)>> = BTreeMap::new();
        for (place, column) in columns.iter().enumerate() {
            by_source.entry(&column.source).or_default().push((place, column));
        }
        by_source
            .into_iter()
            .map(|(name, columns)| {
                let last = before.iter().find(|source| source.name == name);
                Self::new(mcap, name, &columns, last)
            })
            .collect()
    }

    fn new(
        mcap: &mut McapFile<'_>,
        name: &str,
        columns: &[(usize, &Column)],
        last: Option<&Self>,
    ) -> Result<Self, McapError> {
        let mut fields: Vec<(Field, &Column)> = Vec::new();
        for (place, column) in columns {
            // Channel energy is recorded as sum and per axis.
            let is_same =
                |first: &Column| first.signal == column.signal && first.indices.len() == column.indices.len();
            match fields.iter_mut().find(|(_, first)| is_same(first)) {
                Some((field, _)) => field.columns.push(*place),
                None => {
                    let is_single = column.format == Some(Format::F32);
                    fields.push((Field { columns: vec![*place], is_single }, column));
                }
            }
        }
        let mut names = BTreeSet::from(["tick", "time_s"].map(str::to_owned));
        let lines = fields.iter().map(|(field, first)| field_definition(field, first, &mut names));
        let definition = lines.fold(STAMP_DEFINITION.to_owned(), |definition, line| definition + &line);
        let fields = fields.into_iter().map(|(field, _)| field).collect();
        let columns: Vec<Column> = columns.iter().map(|(_, column)| (*column).clone()).collect();
        if let Some(last) = last.filter(|last| last.columns == columns) {
            return Ok(Self { name: name.to_owned(), columns, fields, ..*last });
        }
        let number = last.map_or(1, |last| last.number + 1);
        // Viewers need one schema per topic.
        let (schema_name, topic) = match number {
            1 => (format!("dimsart/msg/{}", camel_case(name)), format!("/{name}")),
            _ => (format!("dimsart/msg/{}V{number}", camel_case(name)), format!("/{name}/{number}")),
        };
        let schema = mcap.add_schema(&schema_name, "ros2msg", definition.as_bytes())?;
        let channel = mcap.add_channel(schema, &topic, "cdr", &BTreeMap::new())?;
        Ok(Self { name: name.to_owned(), number, channel, columns, fields })
    }
}

/// Returns a line of a message definition: `float32[3] position # POSITION (m)`; `names` are the names of earlier lines.
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

/// Converts to a ROS 2 field name.
fn snake_case(name: &str) -> String {
    let letter =
        |letter: char| if letter.is_ascii_alphanumeric() { letter.to_ascii_lowercase() } else { '_' };
    let name: String = name.chars().map(letter).collect();
    if name.starts_with(|first: char| first.is_ascii_lowercase()) { name } else { format!("signal_{name}") }
}

/// Converts to a ROS 2 message name.
fn camel_case(name: &str) -> String {
    let words = name.split(|letter: char| !letter.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    let word = |word: &str| {
        let (first, rest) = word.split_at(1);
        first.to_ascii_uppercase() + rest
    };
    let name: String = words.map(word).collect();
    if name.starts_with(|first: char| first.is_ascii_alphabetic()) { name } else { format!("Device{name}") }
}
