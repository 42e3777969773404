//! Reads the rows of a recorder on the device while it records.
//!
//! Row `n` starts at word `(n mod LENGTH) x words of a row`. A full recorder overwrites its oldest row. The rows are read
//! oldest first; its row counter, read after every block, shows which of them were overwritten meanwhile.

use std::fmt;
use std::io::{self, Read, Write};

use dimsart_core::{CommandError, Direction, Format, ModuleRef, TypeRef, Value, Vocabulary};
use dimsart_link::protocol::{Request, Response};
use serde::Serialize;

use super::description::{Description, DisplayValue, WordText};
use super::device::take;
use super::{ConnectError, Device};
use hil_sim::recording::Column;

/// Module kind of recorders.
const RECORDER: &str = "RECORDER_MOD";
/// Parameter: number of rows in its memory.
const LENGTH: &str = "LENGTH";
/// Words per block, about one answer.
const PIECE_WORDS: usize = dimsart_link::protocol::MAX_SIGNAL_WORDS;

/// Rows of a recorder, oldest first.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RecorderRows {
    /// Name of the recorder.
    pub recorder: String,
    /// Name of the signal.
    pub signal: String,
    /// Name of each column, with the unit of its values.
    pub columns: Vec<String>,
    /// The rows.
    pub rows: Vec<RecorderRow>,
    /// Rows that were overwritten during the read, and are omitted.
    pub overwritten: u32,
    /// Number of the trigger row, from 0; `None` before the trigger fired, or without a trigger.
    pub caught: Option<u32>,
}

/// Values of the signal in one tick.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RecorderRow {
    /// Row number, from 0, since the recorder started.
    pub number: u32,
    /// Values, one per column.
    pub values: Vec<DisplayValue>,
}

impl RecorderRows {
    /// Writes a header line, then one line per row.
    ///
    /// # Errors
    /// An error of `out`; earlier lines may have been written.
    pub fn write_csv(&self, out: impl io::Write) -> io::Result<()> {
        let mut table = csv::Writer::from_writer(out);
        table.write_record(["row"].into_iter().chain(self.columns.iter().map(String::as_str)))?;
        for RecorderRow { number, values } in &self.rows {
            table.write_field(number.to_string())?;
            for value in values {
                // Only numbers, as in the simulator's CSV.
                match value {
                    DisplayValue::Flag(is_on) => table.write_field(if *is_on { "1" } else { "0" })?,
                    value => table.write_field(value.to_string())?,
                }
            }
            table.write_record(None::<&[u8]>)?;
        }
        table.flush()
    }
}

impl fmt::Display for RecorderRows {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { recorder, signal, rows, overwritten, caught, .. } = self;
        match (rows.first(), rows.last()) {
            (Some(first), Some(last)) => {
                let count = rows.len();
                write!(f, "{count} rows of {signal}, numbered {} to {}", first.number, last.number)?;
            }
            _ if *overwritten == 0 => {
                write!(
                    f,
                    "{recorder} has no rows of {signal} yet: it records every EVERY ticks while the scheme runs \
                     (`check`) and its RECORD is ON"
                )?;
            }
            _ => write!(f, "no rows of {signal}")?,
        }
        if let Some(caught) = caught {
            write!(f, "; trigger at row {caught}")?;
        }
        match overwritten {
            0 => Ok(()),
            count => write!(
                f,
                "; {count} rows were overwritten during the read and are omitted: run `set {recorder} RECORD OFF` \
                 before reading, or increase EVERY"
            ),
        }
    }
}

/// Layout of a recorder's memory.
#[derive(PartialEq)]
struct Layout {
    signal: String,
    columns: Vec<String>,
    format: Format,
    /// Counts the rows.
    counter: TypeRef,
    /// Number of the port with the rows, and of the port with the number of the trigger row, from 1.
    port: u8,
    caught: Option<u8>,
    memory_words: usize,
    row_words: usize,
}

/// A recorder that waits for its trigger.
pub(super) struct Watched {
    module: ModuleRef,
    layout: Layout,
}

impl Layout {
    fn of(known: &Description, recorder: ModuleRef) -> Option<Self> {
        let bound = |direction| known.port_texts(recorder).find(|port| port.direction == direction)?.bound;
        let (signal, counter) = (bound(Direction::Read)?, bound(Direction::Write)?);
        let mut memories =
            (0..).zip(known.port_texts(recorder)).filter_map(|(port, found)| match found.direction {
                Direction::Memory(words) => Some((port, words)),
                _ => None,
            });
        let (port, memory_words) = memories.next()?;
        let caught = memories.next().map(|(port, _)| port);
        let found = known.type_of(signal)?;
        let axes = known.axes();
        let signal = known.signal_name(signal).to_string();
        let row_words = found.shape.words(axes.len());
        let column = |WordText { indices, unit }| {
            let (source, signal) = (known.device_name().to_owned(), signal.clone());
            Column { source, signal, indices, unit, format: None }.header()
        };
        let columns = WordText::of_all(found.unit, found.shape, axes).into_iter().map(column).collect();
        Some(Self { columns, signal, format: found.format, counter, port, caught, memory_words, row_words })
    }
}

impl<S: Read + Write> Device<S> {
    /// Reads the rows of a recorder, by default the only one. Does not stop the recorder.
    ///
    /// # Errors
    /// [`ConnectError::InvalidWord`] when there is no such recorder, or it was changed or reset during the read.
    pub fn read_recorder(&mut self, recorder: Option<&str>) -> Result<RecorderRows, ConnectError> {
        let recorder = self.recorder(recorder)?;
        let name = self.module_name(recorder)?;
        let layout = self.layout(recorder)?;
        let length = self.length(recorder, &layout, &name)?;
        let was_changed = || {
            ConnectError::InvalidWord(format!("{name} was changed or reset during the read: repeat the read"))
        };
        let mut taken = self.rows_taken(&layout)?.ok_or_else(was_changed)?;
        let (mut next, end) = (taken.saturating_sub(length), taken);
        let (mut rows, mut overwritten) = (Vec::new(), 0);
        while next < end {
            let most = u32::try_from(PIECE_WORDS / layout.row_words).unwrap_or(1).max(1);
            let count = most.min(end - next).min(length - next % length);
            let words = self.row_words(recorder, &layout, next % length, count)?.ok_or_else(was_changed)?;
            let now = self.rows_taken(&layout)?.filter(|now| *now >= taken).ok_or_else(was_changed)?;
            taken = now;
            for (number, words) in (next..).zip(words.chunks(layout.row_words)) {
                if taken - number > length {
                    overwritten += 1;
                    continue;
                }
                let values = words.iter().map(|word| DisplayValue::of_word(*word, layout.format)).collect();
                rows.push(RecorderRow { number, values });
            }
            // Skip rows that are overwritten by now.
            let oldest = taken.saturating_sub(length).clamp(next + count, end);
            overwritten += oldest - (next + count);
            next = oldest;
        }
        if self.layout(recorder)? != layout {
            return Err(was_changed());
        }
        let caught = self.caught(recorder, &layout)?;
        let Layout { signal, columns, .. } = layout;
        Ok(RecorderRows { recorder: name, signal, columns, rows, overwritten, caught })
    }

    /// Returns the names of the plugged-in recorders.
    ///
    /// # Errors
    /// [`ConnectError`] when the device does not answer, or has no recorder module.
    pub fn recorders(&mut self) -> Result<Vec<String>, ConnectError> {
        let recorder = self.module(RECORDER)?;
        let recorders = self.plugged_in(recorder)?;
        recorders.into_iter().map(|recorder| self.module_name(recorder)).collect()
    }

    /// Returns the plugged-in modules of the same kind.
    fn plugged_in(&mut self, module: ModuleRef) -> Result<Vec<ModuleRef>, ConnectError> {
        let instances = self.instances()?;
        let plugged_in = instances.iter().filter(|found| found.place.is_some()).map(|found| found.module);
        Ok(plugged_in.filter(|found| found.kind == module.kind).collect())
    }

    /// Returns the plugged-in recorder of this name, or the only one.
    fn recorder(&mut self, name: Option<&str>) -> Result<ModuleRef, ConnectError> {
        let recorder = self.module(RECORDER)?;
        let recorders = self.plugged_in(recorder)?;
        let names = self.recorders()?;
        let there = match names.is_empty() {
            true => {
                format!("to plug in a recorder, bind its PORT_SIGNAL_IN with `set`, then run `on {RECORDER}`")
            }
            false => format!("plugged-in recorders: {}", names.join(", ")),
        };
        match (name, recorders.as_slice()) {
            (Some(name), _) => {
                let module = self.module(name)?;
                if module.kind != recorder.kind {
                    return Err(ConnectError::InvalidWord(format!("{name} is not a recorder; {there}")));
                }
                match recorders.contains(&module) {
                    true => Ok(module),
                    false => {
                        Err(ConnectError::InvalidWord(self.refusal_text(CommandError::NotPluggedIn(module))?))
                    }
                }
            }
            (None, [only]) => Ok(*only),
            (None, []) => Err(ConnectError::InvalidWord(format!("no recorder to read; {there}"))),
            (None, _) => Err(ConnectError::InvalidWord(format!("name the recorder to read; {there}"))),
        }
    }

    fn layout(&mut self, recorder: ModuleRef) -> Result<Layout, ConnectError> {
        self.know(|known| Layout::of(known, recorder))?.ok_or(ConnectError::UnexpectedAnswer)
    }

    /// Reads the number of rows in its memory.
    fn length(&mut self, module: ModuleRef, layout: &Layout, name: &str) -> Result<u32, ConnectError> {
        let parameter =
            self.know(|known| known.find_parameter(module.kind, LENGTH).map(|(number, _)| number))?;
        let parameter = parameter.ok_or(ConnectError::UnexpectedAnswer)?;
        let rows = self.ask(&Request::Get { module, parameter, entry: 0 }, take!(Value))?;
        let Some(Value::Count(rows)) = rows else { return Err(ConnectError::UnexpectedAnswer) };
        let expected = usize::try_from(rows).ok().and_then(|rows| rows.checked_mul(layout.row_words));
        if expected != Some(layout.memory_words) || layout.memory_words == 0 {
            let Layout { signal, row_words, memory_words, .. } = layout;
            return Err(ConnectError::InvalidWord(format!(
                "{name} has {memory_words} words of memory, not {rows} rows of {row_words} words of {signal}: bind \
                 the recorder to a signal that it can record"
            )));
        }
        Ok(rows)
    }

    /// Reads the number of recorded rows; `None` where its counter is no longer in the Data Base.
    fn rows_taken(&mut self, layout: &Layout) -> Result<Option<u32>, ConnectError> {
        let request = Request::Signal { signal: layout.counter, from: 0 };
        let words: Option<Vec<u32>> = self.ask(&request, words_of)?;
        Ok(words.and_then(|words| words.first().copied()))
    }

    /// Reads the number of the trigger row, from 0; `None` before the trigger fired, or without a trigger.
    fn caught(&mut self, module: ModuleRef, layout: &Layout) -> Result<Option<u32>, ConnectError> {
        let Some(port) = layout.caught else { return Ok(None) };
        let words: Option<Vec<u32>> = self.ask(&Request::Memory { module, port, from: 0 }, words_of)?;
        Ok(words.and_then(|words| words.first()?.checked_sub(1)))
    }

    /// Prepares a recorder for polling: reads its layout once.
    pub(super) fn watched(&mut self, recorder: &str) -> Result<Watched, ConnectError> {
        let module = self.recorder(Some(recorder))?;
        Ok(Watched { module, layout: self.layout(module)? })
    }

    /// Returns whether the trigger fired and the given number of rows after it is recorded.
    pub(super) fn has_caught(&mut self, watched: &Watched, rows_after: u32) -> Result<bool, ConnectError> {
        let Watched { module, layout } = watched;
        let Some(taken) = self.rows_taken(layout)? else {
            let reason = "the recorder was unplugged before its trigger fired";
            return Err(ConnectError::InvalidWord(reason.to_owned()));
        };
        let caught = self.caught(*module, layout)?;
        Ok(caught.is_some_and(|caught| taken.saturating_sub(caught) > rows_after))
    }

    /// Returns name and number of an unused recorder.
    pub(super) fn free_recorder(&mut self) -> Result<(String, u8), ConnectError> {
        let recorder = self.module(RECORDER)?;
        let instances = self.instances()?;
        let is_free = |number: &u8| {
            !instances.iter().any(|found| found.module == ModuleRef { number: *number, ..recorder })
        };
        let number = (1..=u8::MAX).find(is_free).unwrap_or(u8::MAX);
        Ok((self.module_name(ModuleRef { number, ..recorder })?, number))
    }

    /// Reads the words of consecutive rows in the memory; `None` where they no longer exist.
    fn row_words(
        &mut self,
        module: ModuleRef,
        layout: &Layout,
        place: u32,
        count: u32,
    ) -> Result<Option<Vec<u32>>, ConnectError> {
        let [place, count] = [place, count].map(|rows| usize::try_from(rows).unwrap_or(usize::MAX));
        let wanted = count.saturating_mul(layout.row_words);
        let mut words = Vec::new();
        while words.len() < wanted {
            let from = place.saturating_mul(layout.row_words).saturating_add(words.len());
            let Ok(from) = u16::try_from(from) else { return Ok(None) };
            let request = Request::Memory { module, port: layout.port, from };
            match self.ask(&request, words_of)? {
                Some(more) if !more.is_empty() => words.extend(more),
                _ => return Ok(None),
            }
        }
        words.truncate(wanted);
        Ok(Some(words))
    }
}

fn words_of(response: Response<'_>) -> Option<Vec<u32>> {
    match response {
        Response::Signal(text) => Some(text.words.to_vec()),
        _ => None,
    }
}
