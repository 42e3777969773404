//! Layout of a message of signals, read from its schema.

use std::cell::OnceCell;

use dimsart_core::TypeRef;
use hil_sim::rig::SimulatedDimsart;

use crate::cdr;
use crate::connect::value_of;
use crate::report::{STAMP_BYTES, STAMP_DEFINITION, SignalField as Field};

/// More words than any signal has.
const MAX_WORDS: usize = 1 << 16;

/// The signals of a controller's messages, in order.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Layout {
    fields: Vec<LayoutField>,
    words: usize,
}

/// A signal of a message.
#[derive(Debug, Clone, PartialEq)]
struct LayoutField {
    name: String,
    unit: String,
    /// Id on its device, after the first lookup.
    signal: OnceCell<Option<TypeRef>>,
    field: Field,
}

/// A word of a message whose replayed value differs.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Other {
    pub(super) signal: String,
    /// Index in the signal.
    pub(super) word: usize,
    pub(super) recorded: f64,
    pub(super) replayed: f64,
}

impl Layout {
    /// Parses lines such as `float32[3] position # POSITION (m)`; `None` without leading tick and time.
    pub(super) fn of_schema(definition: &str) -> Option<Self> {
        let mut layout = Self::default();
        let definition = definition.strip_prefix(STAMP_DEFINITION)?;
        for (format, rest) in definition.lines().filter_map(|line| line.split_once(' ')) {
            let Some((_, signal)) = rest.split_once(" # ") else { continue };
            let (signal, unit) = signal.split_once(" (").unwrap_or((signal, ""));
            let unit = unit.strip_suffix(')').unwrap_or(unit).to_owned();
            let (format, count) = match format.split_once('[') {
                Some((format, count)) => {
                    let count = count.trim_end_matches(']').parse().ok();
                    (format, count.filter(|count| *count <= MAX_WORDS).unwrap_or(1))
                }
                None => (format, 1),
            };
            let columns = (layout.words..layout.words + count).collect();
            let field = Field { columns, is_single: format == "float32" };
            layout.fields.push(LayoutField { name: signal.to_owned(), unit, signal: OnceCell::new(), field });
            layout.words += count;
        }
        Some(layout)
    }

    /// Returns its signals in order: name, unit and number of words.
    pub(super) fn signals(&self) -> impl Iterator<Item = (&str, &str, usize)> {
        self.fields.iter().map(|field| (field.name.as_str(), field.unit.as_str(), field.field.columns.len()))
    }

    /// Reads the words of a message; NaN for missing words.
    pub(super) fn read(&self, message: &[u8]) -> Vec<f64> {
        let mut place = cdr::MARK.len() + STAMP_BYTES;
        let mut row = Vec::with_capacity(self.words);
        for LayoutField { field, .. } in &self.fields {
            let size = field.word_bytes();
            place = cdr::MARK.len() + (place - cdr::MARK.len()).next_multiple_of(size);
            for _ in &field.columns {
                row.push(message.get(place..place + size).map_or(f64::NAN, number));
                place += size;
            }
        }
        row
    }

    pub(super) fn words(&self) -> usize {
        self.words
    }

    /// Writes the controller's values of these signals to `row`, and their message to `message`, with tick and time of the
    /// `recorded` message.
    pub(super) fn fill(
        &self,
        dimsart: &SimulatedDimsart,
        recorded: &[u8],
        row: &mut Vec<f64>,
        message: &mut Vec<u8>,
    ) {
        row.clear();
        message.clear();
        message.extend(head(recorded));
        let data_base = dimsart.engine().data_base();
        for LayoutField { name, signal, field, .. } in &self.fields {
            let signal = *signal.get_or_init(|| dimsart.engine().device().signal(name));
            let found = data_base.signals().find(|(_, entry)| Some(entry.signal) == signal);
            let start = row.len();
            if let Some((slot, entry)) = found {
                let format = entry.data_type.format;
                row.extend(data_base.words(slot).iter().map(|word| value_of(*word, format)));
            }
            // As in a recording without this signal.
            row.resize(start + field.columns.len(), f64::NAN);
            field.add(message, row);
        }
    }

    /// Returns the words of a recorded message that differ from `row`.
    pub(super) fn others(&self, recorded: &[u8], row: &[f64]) -> Vec<Other> {
        let (mut others, mut expected) = (Vec::new(), head(recorded).to_vec());
        for LayoutField { name, field, .. } in &self.fields {
            field.add(&mut expected, row);
            let size = field.word_bytes();
            let place = expected.len() - size * field.columns.len();
            for (word, column) in field.columns.iter().enumerate() {
                let at = place + size * word;
                let [there, here] = [recorded, &expected].map(|message| message.get(at..at + size));
                if there != here {
                    let recorded = there.map_or(f64::NAN, number);
                    let replayed = row.get(*column).copied().unwrap_or(f64::NAN);
                    others.push(Other { signal: name.clone(), word, recorded, replayed });
                }
            }
        }
        others
    }
}

/// Start of a message.
fn head(message: &[u8]) -> &[u8] {
    message.get(..cdr::MARK.len() + STAMP_BYTES).unwrap_or(&cdr::MARK)
}

fn number(bytes: &[u8]) -> f64 {
    if let Ok(single) = bytes.try_into() {
        return f32::from_le_bytes(single).into();
    }
    bytes.try_into().map_or(f64::NAN, f64::from_le_bytes)
}
