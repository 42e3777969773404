//! Reads the signals of a recording, for the scope.

use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;

use serde::Serialize;

use super::records::{Record, Records};
use super::{Meaning, ReplayError, meaning, stamp};
use hil_sim::untrusted_text::escape_lines;

/// Maximum number of values per source; beyond it, every second row is kept.
const MAX_VALUES: usize = 1 << 25;

/// Recorded signals of a source, such as a controller.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RecordedSignals {
    /// Name of the source.
    pub name: String,
    /// Signals in order.
    pub signals: Vec<RecordedSignal>,
    /// Tick of each row.
    pub ticks: Vec<u64>,
    /// Time of each row, `s`.
    pub times_s: Vec<f64>,
    /// Values of each column, all words of the first signal first; NaN for missing values.
    pub columns: Vec<Vec<f32>>,
    /// Number of recorded rows per row here.
    pub stride: u64,
    /// Number of recorded rows.
    rows: u64,
}

/// A signal of a source.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct RecordedSignal {
    /// Name.
    pub name: String,
    /// Unit; empty for a pure number.
    pub unit: String,
    /// Number of words.
    pub words: usize,
}

impl RecordedSignals {
    /// Returns the first column of a signal; appends the signal if it is new.
    fn place(&mut self, name: &str, unit: &str, words: usize) -> usize {
        let mut place = 0;
        for known in &self.signals {
            if known.name == name && known.words == words {
                return place;
            }
            place += known.words;
        }
        self.signals.push(RecordedSignal { name: name.to_owned(), unit: unit.to_owned(), words });
        let empty = vec![f32::NAN; self.ticks.len()];
        self.columns.extend(std::iter::repeat_n(empty, words));
        place
    }

    fn add(&mut self, tick: u64, time_s: f64, places: &[usize], values: &[f64]) {
        let is_kept = self.rows.is_multiple_of(self.stride);
        self.rows += 1;
        if !is_kept {
            return;
        }
        self.ticks.push(tick);
        self.times_s.push(time_s);
        self.columns.iter_mut().for_each(|column| column.push(f32::NAN));
        for (place, value) in places.iter().zip(values) {
            #[expect(clippy::cast_possible_truncation, reason = "to be drawn")]
            if let Some(last) = self.columns.get_mut(*place).and_then(|column| column.last_mut()) {
                *last = *value as f32;
            }
        }
        if self.ticks.len() * self.columns.len() > MAX_VALUES {
            self.stride *= 2;
            halve(&mut self.ticks);
            halve(&mut self.times_s);
            self.columns.iter_mut().for_each(halve);
        }
    }

    /// Returns the sample period of its ticks, `s`; 1 ms if it cannot be determined.
    #[must_use]
    pub fn tick_s(&self) -> f64 {
        // A restart begins with tick 0 again.
        let (mut ticks, mut time_s) = (0, 0.0);
        for pair in self.ticks.windows(2).zip(self.times_s.windows(2)) {
            if let (&[one, next], &[start_s, end_s]) = pair
                && next > one
                && end_s > start_s
            {
                ticks += next - one;
                time_s += end_s - start_s;
            }
        }
        #[expect(clippy::cast_precision_loss, reason = "below 2^53")]
        let tick_s = time_s / ticks as f64;
        if tick_s.is_finite() && tick_s > 0.0 { tick_s } else { 1e-3 }
    }

    /// Returns the minimum number of ticks between two rows.
    #[must_use]
    pub fn every_ticks(&self) -> u64 {
        let distances = self.ticks.windows(2).filter_map(|pair| match pair {
            [one, next] => next.checked_sub(*one).filter(|ticks| *ticks > 0),
            _ => None,
        });
        distances.min().unwrap_or(1)
    }
}

fn halve<T: Copy>(values: &mut Vec<T>) {
    *values = values.iter().step_by(2).copied().collect();
}

/// Reads the signals of all sources of an MCAP file that this program has written; `path` appears in errors.
///
/// # Errors
/// [`ReplayError`] for a file that cannot be read, or that has no signals.
pub fn read_signals(file: File, path: &Path) -> Result<Vec<RecordedSignals>, ReplayError> {
    let mut records = Records::new(file).map_err(|error| error.of(path))?;
    let (mut schemas, mut channels) = (BTreeMap::new(), BTreeMap::new());
    let mut sources: BTreeMap<String, RecordedSignals> = BTreeMap::new();
    while let Some(record) = records.next().map_err(|error| error.of(path))? {
        match record {
            Record::Schema { id, data } => {
                schemas.insert(id, escape_lines(&String::from_utf8_lossy(&data)));
            }
            Record::Channel { id, schema, topic } => {
                let Some(Meaning::Signals(name, layout)) = meaning(&topic, schemas.get(&schema))? else {
                    continue;
                };
                let source = sources.entry(name.clone()).or_insert_with(|| RecordedSignals {
                    name: name.clone(),
                    stride: 1,
                    ..RecordedSignals::default()
                });
                let mut places = Vec::new();
                for (signal, unit, words) in layout.signals() {
                    let place = source.place(signal, unit, words);
                    places.extend(place..place + words);
                }
                channels.insert(id, (name, layout, places));
            }
            Record::Message { channel, data } => {
                let Some((name, layout, places)) = channels.get(&channel) else { continue };
                if let (Some(source), Some((tick, time_s))) = (sources.get_mut(name), stamp(&data)) {
                    source.add(tick, time_s, places, &layout.read(&data));
                }
            }
            Record::Attachment { .. } => {}
        }
    }
    let sources: Vec<_> = sources.into_values().filter(|source| !source.ticks.is_empty()).collect();
    if sources.is_empty() { Err(ReplayError::NoSignals { path: path.to_owned() }) } else { Ok(sources) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_recording_is_thinned_evenly() {
        let mut source = RecordedSignals { stride: 1, ..RecordedSignals::default() };
        let place = source.place("POSITION", "rad", 1);
        let wide = source.place("GRID", "", 1 << 15);
        assert_eq!((place, wide), (0, 1));
        for tick in 0..2_000 {
            source.add(tick, tick as f64 * 1e-3, &[0], &[tick as f64]);
        }
        assert_eq!((source.stride, source.every_ticks()), (2, 2));
        let expected: Vec<f32> = source.ticks.iter().map(|tick| *tick as f32).collect();
        assert_eq!(source.columns[0], expected);
        assert!((source.tick_s() - 1e-3).abs() < 1e-12);
    }
}
