//! Records one row per tick: signals of each Data Base, simulator signals, channel energy.
//!
//! `record.signals` selects the signals; signals added to a Data Base during the run are recorded from then on.

mod selection;

pub use selection::UnknownSignal;

use std::sync::mpsc::SyncSender;

use dimsart_core::{DataType, Format, Scalar, TypeRef, Word, types};

use crate::plant::MAX_QUANTITIES;
use crate::recording::{Column, Recording, RecordingChunk, TickInputs, indices};
use crate::rig::{Rig, Station};
use crate::rig_file::RecordSection;
use selection::Selection;

/// Maximum ticks per message to a listener; messages cost more than recording.
const TOLD_TICKS: u64 = 64;
/// Maximum time of rows in a message, `s`.
const TOLD_S: f64 = 0.1;
/// Maximum rows for pictures, far above their width in pixels.
const PICTURE_ROWS: usize = 65_536;

/// Records a rig.
#[derive(Debug)]
pub struct Recorder {
    recording: Recording,
    selection: Selection,
    /// Sources of the columns, in order.
    sources: Vec<Source>,
    /// Data Base revisions of the stations for which the sources are valid.
    revisions: Vec<u32>,
    every_ticks: u64,
    period_s: f64,
    /// Listener.
    told_ticks: u64,
    listener: Option<SyncSender<RecordingChunk>>,
    /// Whether to wait for a full listener.
    is_in_a_hurry: bool,
    /// Rows of the next message.
    untold: Vec<f64>,
    untold_inputs: Vec<TickInputs>,
}

/// Source of one or more columns.
#[derive(Debug)]
enum Source {
    /// Channel energy: of all axes together or of one axis.
    Energy(Option<usize>),
    /// Signal of a station's Data Base.
    Signal { station: usize, signal: TypeRef, slot: Option<u8>, words: usize, format: Format },
    /// Selected [quantities](crate::plant::Plant::quantities); `None` selects all.
    Truth { station: usize, axis: usize, columns: usize, kept: Option<[bool; MAX_QUANTITIES]> },
}

/// Name of the channel energy columns.
pub const CHANNEL_ENERGY: &str = "channel_energy";

impl Recorder {
    /// Creates a recorder for the selected signals.
    ///
    /// # Errors
    /// [`UnknownSignal`] for a name without a present signal.
    pub fn new(rig: &Rig, settings: &RecordSection) -> Result<Self, UnknownSignal> {
        let all = sources(rig, &Selection::all());
        let names = all.iter().flat_map(|(_, columns)| columns).map(Column::name);
        let selection = Selection::new(&settings.signals, names)?;
        let wanted = sources(rig, &selection);
        let mut recorder = Self {
            recording: Recording::default(),
            selection,
            sources: Vec::new(),
            revisions: revisions(rig),
            every_ticks: u64::from(settings.every_ticks.max(1)),
            period_s: rig.period_s(),
            told_ticks: told_ticks(rig.period_s()),
            listener: None,
            is_in_a_hurry: false,
            untold: Vec::new(),
            untold_inputs: Vec::new(),
        };
        recorder.add_new(wanted);
        Ok(recorder)
    }

    /// Reserves memory for the first 20 000 of `ticks` ticks; longer runs allocate later.
    pub fn reserve(&mut self, ticks: f64) {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
        let ticks = ticks.clamp(0.0, 20_000.0) as u64;
        let rows = ticks / self.every_ticks + 1;
        self.recording.reserve(usize::try_from(rows).unwrap_or_default());
    }

    /// Keeps only the rows needed for pictures; a [listener](Self::add_listener) receives all rows.
    pub fn record_for_figures(&mut self) {
        self.recording.limit_rows(PICTURE_ROWS);
    }

    /// Real-time mode: keeps no rows and never waits for a listener. A listener that is some thousand rows behind is
    /// dropped.
    #[must_use]
    pub fn in_real_time(mut self) -> Self {
        self.recording.limit_rows(0);
        Self { is_in_a_hurry: true, ..self }
    }

    /// Whether it has no listener: none, disconnected, or dropped as too slow.
    #[must_use]
    pub fn has_no_listener(&self) -> bool {
        self.listener.is_none()
    }

    /// Sends the recorded rows and all further rows to `listener`, at most 64 ticks late, with the
    /// [inputs](crate::rig::Station::record_inputs) of these ticks. Waits for a full listener; ignores a disconnected
    /// one.
    pub fn add_listener(&mut self, listener: SyncSender<RecordingChunk>) {
        self.listener = Some(listener);
        self.say(RecordingChunk::Columns(self.recording.columns().to_vec()));
        self.untold.clear();
        for (time_s, row) in self.recording.time_s().iter().zip(self.recording.rows()) {
            self.untold.push((time_s / self.period_s).round());
            self.untold.push(*time_s);
            self.untold.extend_from_slice(row);
        }
        self.tell_rows();
    }

    fn tell_rows(&mut self) {
        if !self.untold_inputs.is_empty() {
            let inputs = std::mem::take(&mut self.untold_inputs);
            self.say(RecordingChunk::Inputs(inputs));
        }
        if !self.untold.is_empty() {
            let room = Vec::with_capacity(self.untold.len());
            let rows = std::mem::replace(&mut self.untold, room);
            self.say(RecordingChunk::Rows(rows));
        }
    }

    fn say(&mut self, piece: RecordingChunk) {
        let Some(listener) = &self.listener else { return };
        let is_told = match self.is_in_a_hurry {
            true => listener.try_send(piece).is_ok(),
            false => listener.send(piece).is_ok(),
        };
        if !is_told {
            self.listener = None;
        }
    }

    /// Records the present tick if due. `channel_energy_j` is by axis.
    pub fn record(&mut self, rig: &Rig, channel_energy_j: &[f64]) {
        if rig.ticks().is_multiple_of(self.told_ticks) {
            self.tell_rows();
        }
        if self.listener.is_some() {
            self.take_inputs(rig);
        }
        if !rig.ticks().is_multiple_of(self.every_ticks) {
            return;
        }
        if !self.revisions.iter().copied().eq(rig.stations().iter().map(revision)) {
            self.find_again(rig);
        }
        let row = self.recording.add_row(rig.time_s());
        let mut rest = &mut *row;
        for source in &self.sources {
            rest = source.fill(rig, channel_energy_j, rest);
        }
        if self.listener.is_some() {
            #[expect(clippy::cast_precision_loss, reason = "exact for 285 000 years of ticks")]
            let tick = rig.ticks() as f64;
            self.untold.extend([tick, rig.time_s()]);
            self.untold.extend_from_slice(row);
        }
    }

    fn take_inputs(&mut self, rig: &Rig) {
        let due = rig.stations().iter().enumerate().filter(|(_, station)| station.is_due(rig.ticks()));
        let inputs = due.filter_map(|(station, of)| {
            let (tick, time_s) = (rig.ticks(), rig.time_s());
            of.inputs().map(|inputs| TickInputs { tick, time_s, station, inputs: inputs.clone() })
        });
        self.untold_inputs.extend(inputs);
    }

    /// Returns the recording.
    #[must_use]
    pub fn finish(mut self) -> Recording {
        self.tell_rows();
        self.recording
    }

    /// Handles plugged modules: signals have been added, removed or moved.
    fn find_again(&mut self, rig: &Rig) {
        self.revisions = revisions(rig);
        for source in &mut self.sources {
            if let Source::Signal { station, signal, slot, .. } = source {
                let station = rig.stations().get(*station);
                *slot = station.and_then(|station| station.dimsart.engine().data_base().slot(*signal));
            }
        }
        self.add_new(sources(rig, &self.selection));
    }

    /// Adds missing sources.
    fn add_new(&mut self, wanted: Vec<(Source, Vec<Column>)>) {
        let known = self.recording.columns();
        let is_new = |(_, columns): &(Source, Vec<Column>)| {
            columns.first().is_some_and(|first| !known.contains(first))
        };
        let (sources, columns): (Vec<_>, Vec<_>) = wanted.into_iter().filter(is_new).unzip();
        if !sources.is_empty() {
            // Rows so far have the columns so far.
            self.tell_rows();
            self.sources.extend(sources);
            self.recording.add_columns(columns.into_iter().flatten().collect());
            self.say(RecordingChunk::Columns(self.recording.columns().to_vec()));
        }
    }
}

impl Source {
    /// Fills the first columns of `row`, NaN for missing signals; returns the rest.
    fn fill<'a>(&self, rig: &Rig, channel_energy_j: &[f64], row: &'a mut [f64]) -> &'a mut [f64] {
        match *self {
            Self::Energy(axis) => {
                let energy_j = match axis {
                    None => channel_energy_j.iter().copied().reduce(|sum, axis| sum + axis),
                    Some(axis) => channel_energy_j.get(axis).copied(),
                };
                fill(row, 1, energy_j)
            }
            Self::Signal { station, slot, words: columns, format, .. } => {
                let station = rig.stations().get(station).zip(slot);
                let words = station.map(|(station, slot)| station.dimsart.engine().data_base().words(slot));
                let words = words.unwrap_or_default().iter().map(|word| Word(*word));
                match format {
                    Format::F32 => fill(row, columns, words.map(number::<f32>)),
                    Format::I32 => fill(row, columns, words.map(number::<i32>)),
                    Format::U32 => fill(row, columns, words.map(number::<u32>)),
                    Format::Bool => fill(row, columns, words.map(number::<bool>)),
                }
            }
            Self::Truth { station, axis, columns, ref kept } => {
                let (own, rest) = row.split_at_mut_checked(columns).unwrap_or_default();
                let Some(station) = rig.stations().get(station) else { return rest };
                match kept {
                    None => station.plant.read_quantities(axis, own),
                    Some(kept) => {
                        let mut values = [f64::NAN; MAX_QUANTITIES];
                        station.plant.read_quantities(axis, &mut values);
                        let kept = values.iter().zip(kept).filter(|(_, is_kept)| **is_kept);
                        own.iter_mut().zip(kept).for_each(|(cell, (value, _))| *cell = *value);
                    }
                }
                rest
            }
        }
    }
}

/// Returns the ticks per message to a listener.
fn told_ticks(period_s: f64) -> u64 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a cast saturates")]
    let ticks = (TOLD_S / period_s) as u64;
    ticks.clamp(1, TOLD_TICKS)
}

/// Converts a word to `f64`; switches are 0 or 1.
fn number<T: Scalar + Into<f64>>(word: Word) -> f64 {
    T::from_word(word).into()
}

/// Writes `values` to the first `columns` of a row; returns the rest.
fn fill(row: &mut [f64], columns: usize, values: impl IntoIterator<Item = f64>) -> &mut [f64] {
    let (own, rest) = row.split_at_mut_checked(columns).unwrap_or_default();
    for (cell, value) in own.iter_mut().zip(values) {
        *cell = value;
    }
    rest
}

/// Returns all selected sources of the present rig.
fn sources(rig: &Rig, selection: &Selection) -> Vec<(Source, Vec<Column>)> {
    let mut sources = energies(rig);
    for (number, station) in rig.stations().iter().enumerate() {
        sources.extend(signals(number, station));
    }
    // All columns of a source share one name.
    sources.retain(|(_, columns)| columns.first().is_some_and(|first| selection.holds(&first.name())));
    for (number, station) in rig.stations().iter().enumerate() {
        sources.extend((0..station.plant.dof()).map(|axis| truth(number, station, axis, selection)));
    }
    sources
}

/// Selected simulator signals of a station on one axis.
fn truth(number: usize, station: &Station, axis: usize, selection: &Selection) -> (Source, Vec<Column>) {
    let quantities = station.plant.quantities(axis).iter();
    let mut columns: Vec<Column> = quantities
        .map(|(name, unit)| column("world", &format!("{}.{name}", station.name), vec![axis], unit))
        .collect();
    let mut kept = [false; MAX_QUANTITIES];
    for (is_kept, column) in kept.iter_mut().zip(&columns) {
        *is_kept = selection.holds(&column.name());
    }
    let all = columns.len();
    columns.retain(|column| selection.holds(&column.name()));
    let kept = (columns.len() < all).then_some(kept);
    (Source::Truth { station: number, axis, columns: columns.len(), kept }, columns)
}

/// Channel energy, if the channel has waves.
fn energies(rig: &Rig) -> Vec<(Source, Vec<Column>)> {
    let axes = |station: &Station| {
        let data_base = station.dimsart.engine().data_base();
        data_base.slot(types::CH1_WAVES.first()).map_or(0, |slot| data_base.words(slot).len())
    };
    let axes = rig.stations().iter().map(axes).max().unwrap_or_default();
    let total = (axes > 0).then_some(None);
    let energy =
        |axis| (Source::Energy(axis), vec![column("world", CHANNEL_ENERGY, axis.into_iter().collect(), "J")]);
    total.into_iter().chain((0..axes).map(Some)).map(energy).collect()
}

/// Signals of a station's Data Base.
fn signals(number: usize, station: &Station) -> Vec<(Source, Vec<Column>)> {
    let engine = station.dimsart.engine();
    let (device, data_base) = (engine.device(), engine.data_base());
    let signal = |(slot, entry): (u8, dimsart_core::Entry)| {
        let words = data_base.words(slot).len();
        let name = device.signal_name(entry.signal).to_string();
        let format = entry.data_type.format;
        let of_word = |word: usize| {
            let DataType { unit, shape, .. } = *entry.data_type;
            let indices = indices(shape, word, device.dof());
            let unit = unit.for_word(shape, word, device.axes());
            Column { format: Some(format), ..column(&station.name, &name, indices, unit) }
        };
        let columns = (0..words).map(of_word).collect();
        (Source::Signal { station: number, signal: entry.signal, slot: Some(slot), words, format }, columns)
    };
    data_base.signals().map(signal).collect()
}

fn revision(station: &Station) -> u32 {
    station.dimsart.engine().data_base().revision()
}

fn revisions(rig: &Rig) -> Vec<u32> {
    rig.stations().iter().map(revision).collect()
}

fn column(source: &str, signal: &str, indices: Vec<usize>, unit: impl ToString) -> Column {
    let (source, signal, unit) = (source.to_owned(), signal.to_owned(), unit.to_string());
    Column { source, signal, indices, unit, format: None }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_is_the_number_that_its_format_makes_of_it() {
        let numbers = [
            (number::<i32>(Word(u32::MAX)), -1.0),
            (number::<u32>(Word(u32::MAX)), 4_294_967_295.0),
            (number::<bool>(Word(u32::MAX)), 1.0),
            (number::<bool>(Word(0)), 0.0),
            (number::<i32>(Word(0x7FC0_0000)), 2_143_289_344.0),
            (number::<f32>(Word(0x3FC0_0000)), 1.5),
        ];
        for (found, expected) in numbers {
            assert_eq!(found.to_bits(), f64::to_bits(expected), "{found} for {expected}");
        }
    }
}
