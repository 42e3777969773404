//! What a recorder on the device has kept, read while it goes on.
//!
//! Row `n` lies at word `(n mod LENGTH) x words of a row`. A recorder that is full writes over its oldest row. So the
//! rows are read oldest first, and its counter after every piece of them: it says which of them were still there.

use std::fmt;
use std::io::{self, Read, Write};

use dimsart_core::{CommandError, Direction, Format, ModuleRef, TypeRef, Value, Vocabulary};
use dimsart_link::protocol::{Request, Response};
use serde::Serialize;

use super::description::{Description, ValueText, WordText};
use super::device::take;
use super::{ConnectError, Device};
use hil_sim::recording::Column;

/// The kind of module that records.
const RECORDER: &str = "RECORDER_MOD";
/// Its parameter that says how many rows it keeps.
const LENGTH: &str = "LENGTH";
/// About as many words as one answer has.
const PIECE_WORDS: usize = dimsart_link::protocol::MAX_SIGNAL_WORDS;

/// What a recorder has kept, oldest first.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Recorded {
    /// Name of the recorder.
    pub recorder: String,
    /// Name of the signal.
    pub signal: String,
    /// Name of each column, with the unit of its values.
    pub columns: Vec<String>,
    /// The rows.
    pub rows: Vec<RecordedRow>,
    /// Rows that the recorder wrote over while they were read: they are left out.
    pub overwritten: u32,
    /// Number of the row that its trigger has caught, from 0; none before, or without a trigger.
    pub caught: Option<u32>,
}

/// The signal as it was in one tick.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RecordedRow {
    /// Its number, from 0, since the recorder began.
    pub number: u32,
    /// Its values, one for each column.
    pub values: Vec<ValueText>,
}

impl Recorded {
    /// Writes a line of names, then a line for each row.
    ///
    /// # Errors
    /// Whatever `out` reports; the lines before may have been written.
    pub fn write_csv(&self, out: impl io::Write) -> io::Result<()> {
        let mut table = csv::Writer::from_writer(out);
        table.write_record(["row"].into_iter().chain(self.columns.iter().map(String::as_str)))?;
        for RecordedRow { number, values } in &self.rows {
            table.write_field(number.to_string())?;
            for value in values {
                // Numbers throughout, as in the simulator's CSV.
                match value {
                    ValueText::Flag(is_on) => table.write_field(if *is_on { "1" } else { "0" })?,
                    value => table.write_field(value.to_string())?,
                }
            }
            table.write_record(None::<&[u8]>)?;
        }
        table.flush()
    }
}

impl fmt::Display for Recorded {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { recorder, signal, rows, overwritten, caught, .. } = self;
        match (rows.first(), rows.last()) {
            (Some(first), Some(last)) => {
                let count = rows.len();
                write!(f, "{count} rows of {signal}, number {} to {}", first.number, last.number)?;
            }
            _ if *overwritten == 0 => {
                write!(
                    f,
                    "{recorder} has no rows of {signal} yet: it takes one every EVERY ticks, while the scheme runs \
                     (`check`) and its RECORD is ON"
                )?;
            }
            _ => write!(f, "no rows of {signal}")?,
        }
        if let Some(caught) = caught {
            write!(f, "; row {caught} is the one that the trigger has caught")?;
        }
        match overwritten {
            0 => Ok(()),
            count => write!(
                f,
                "; {count} rows were overwritten while they were read and are left out: `set {recorder} RECORD OFF` \
                 before you read, or a greater EVERY, keeps them"
            ),
        }
    }
}

/// Where a recorder keeps what.
#[derive(PartialEq)]
struct Layout {
    signal: String,
    columns: Vec<String>,
    format: Format,
    /// Counts the rows.
    counter: TypeRef,
    /// Number of the port that declares the memory, and of the one with the number of the row that was caught, from 1.
    port: u8,
    caught: Option<u8>,
    memory_words: usize,
    row_words: usize,
}

/// A recorder whose trigger is waited for.
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
        let signal = known.name_of_signal(signal).to_string();
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
    /// What a recorder has kept until now; the only one that there is when none is named. Stops nothing.
    ///
    /// # Errors
    /// [`ConnectError::Word`] when there is no such recorder, or it was changed or reset while it was read.
    pub fn recorded(&mut self, recorder: Option<&str>) -> Result<Recorded, ConnectError> {
        let recorder = self.recorder(recorder)?;
        let name = self.module_name(recorder)?;
        let layout = self.layout(recorder)?;
        let length = self.length(recorder, &layout, &name)?;
        let was_changed =
            || ConnectError::Word(format!("{name} was changed or reset while it was read: read it again"));
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
                let values = words.iter().map(|word| ValueText::of_word(*word, layout.format)).collect();
                rows.push(RecordedRow { number, values });
            }
            // What is gone by now need not be read.
            let oldest = taken.saturating_sub(length).clamp(next + count, end);
            overwritten += oldest - (next + count);
            next = oldest;
        }
        if self.layout(recorder)? != layout {
            return Err(was_changed());
        }
        let caught = self.caught(recorder, &layout)?;
        let Layout { signal, columns, .. } = layout;
        Ok(Recorded { recorder: name, signal, columns, rows, overwritten, caught })
    }

    /// Names of the recorders that are plugged in.
    ///
    /// # Errors
    /// [`ConnectError`] when the device does not answer, or knows no recorders.
    pub fn recorders(&mut self) -> Result<Vec<String>, ConnectError> {
        let recorder = self.module(RECORDER)?;
        let recorders = self.plugged_in(recorder)?;
        recorders.into_iter().map(|recorder| self.module_name(recorder)).collect()
    }

    /// The modules of the same kind that are plugged in.
    fn plugged_in(&mut self, module: ModuleRef) -> Result<Vec<ModuleRef>, ConnectError> {
        let instances = self.instances()?;
        let plugged_in = instances.iter().filter(|found| found.place.is_some()).map(|found| found.module);
        Ok(plugged_in.filter(|found| found.kind == module.kind).collect())
    }

    /// The recorder of this name, or the only one; it is plugged in.
    fn recorder(&mut self, name: Option<&str>) -> Result<ModuleRef, ConnectError> {
        let recorder = self.module(RECORDER)?;
        let recorders = self.plugged_in(recorder)?;
        let names = self.recorders()?;
        let there = match names.is_empty() {
            true => {
                format!(
                    "none is plugged in: give its PORT_SIGNAL_IN a signal with `set`, then `on {RECORDER}`"
                )
            }
            false => format!("there is {}", names.join(", ")),
        };
        match (name, recorders.as_slice()) {
            (Some(name), _) => {
                let module = self.module(name)?;
                if module.kind != recorder.kind {
                    return Err(ConnectError::Word(format!("{name} is no recorder; {there}")));
                }
                match recorders.contains(&module) {
                    true => Ok(module),
                    false => Err(ConnectError::Word(self.refusal_text(CommandError::NotPluggedIn(module))?)),
                }
            }
            (None, [only]) => Ok(*only),
            (None, []) => Err(ConnectError::Word(format!("no recorder to read; {there}"))),
            (None, _) => Err(ConnectError::Word(format!("name the recorder to read; {there}"))),
        }
    }

    fn layout(&mut self, recorder: ModuleRef) -> Result<Layout, ConnectError> {
        self.know(|known| Layout::of(known, recorder))?.ok_or(ConnectError::OtherAnswer)
    }

    /// How many rows it keeps.
    fn length(&mut self, module: ModuleRef, layout: &Layout, name: &str) -> Result<u32, ConnectError> {
        let parameter =
            self.know(|known| known.parameter_named(module.kind, LENGTH).map(|(number, _)| number))?;
        let parameter = parameter.ok_or(ConnectError::OtherAnswer)?;
        let rows = self.ask(&Request::Get { module, parameter, entry: 0 }, take!(Value))?;
        let Some(Value::Count(rows)) = rows else { return Err(ConnectError::OtherAnswer) };
        let expected = usize::try_from(rows).ok().and_then(|rows| rows.checked_mul(layout.row_words));
        if expected != Some(layout.memory_words) || layout.memory_words == 0 {
            let Layout { signal, row_words, memory_words, .. } = layout;
            return Err(ConnectError::Word(format!(
                "{name} keeps {memory_words} words, which are not {rows} rows of {row_words} words of {signal}: bind it \
                 to a signal that it can record"
            )));
        }
        Ok(rows)
    }

    /// How many rows it has taken; none where its counter is not in the Data Base any more.
    fn rows_taken(&mut self, layout: &Layout) -> Result<Option<u32>, ConnectError> {
        let request = Request::Signal { signal: layout.counter, from: 0 };
        let words: Option<Vec<u32>> = self.ask(&request, words_of)?;
        Ok(words.and_then(|words| words.first().copied()))
    }

    /// Number of the row that its trigger has caught, from 0; none before, and on a device whose recorders have no trigger.
    fn caught(&mut self, module: ModuleRef, layout: &Layout) -> Result<Option<u32>, ConnectError> {
        let Some(port) = layout.caught else { return Ok(None) };
        let words: Option<Vec<u32>> = self.ask(&Request::Memory { module, port, from: 0 }, words_of)?;
        Ok(words.and_then(|words| words.first()?.checked_sub(1)))
    }

    /// A recorder to look at again and again: what is to be known of it is asked once.
    pub(super) fn watched(&mut self, recorder: &str) -> Result<Watched, ConnectError> {
        let module = self.recorder(Some(recorder))?;
        Ok(Watched { module, layout: self.layout(module)? })
    }

    /// Whether it has caught an edge, and all rows behind it, of which there are so many.
    pub(super) fn has_caught(&mut self, watched: &Watched, rows_after: u32) -> Result<bool, ConnectError> {
        let Watched { module, layout } = watched;
        let Some(taken) = self.rows_taken(layout)? else {
            let reason = "the recorder was plugged out while its edge was waited for";
            return Err(ConnectError::Word(reason.to_owned()));
        };
        let caught = self.caught(*module, layout)?;
        Ok(caught.is_some_and(|caught| taken.saturating_sub(caught) > rows_after))
    }

    /// A recorder that is not there yet: its name, and its number.
    pub(super) fn free_recorder(&mut self) -> Result<(String, u8), ConnectError> {
        let recorder = self.module(RECORDER)?;
        let instances = self.instances()?;
        let is_free = |number: &u8| {
            !instances.iter().any(|found| found.module == ModuleRef { number: *number, ..recorder })
        };
        let number = (1..=u8::MAX).find(is_free).unwrap_or(u8::MAX);
        Ok((self.module_name(ModuleRef { number, ..recorder })?, number))
    }

    /// The words of so many rows one behind the other in the memory; none where they are not there any more.
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
