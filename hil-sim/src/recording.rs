//! Recordings: named columns with units, one row per tick.

use dimsart_core::{Format, Shape};

use crate::rig::Inputs;

/// One column of a [`Recording`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Column {
    /// Source: a controller (`master`, `slave`) or `world` for signals of the simulator.
    pub source: String,
    /// Signal name: a Data Base type (`POSITION`) or a simulator signal (`hand_force`).
    pub signal: String,
    /// Indices from 0: axis, or row and column of a matrix; empty for a scalar.
    pub indices: Vec<usize>,
    /// SI unit (`m`, `N`, `sqrt(W)`); empty if dimensionless.
    pub unit: String,
    /// Number format in the Data Base; `None` for simulator signals, which are `f64`.
    pub format: Option<Format>,
}

impl Column {
    /// Returns source and signal: `master.POSITION`.
    #[must_use]
    pub fn name(&self) -> String {
        format!("{}.{}", self.source, self.signal)
    }

    /// Returns the column header: `master.POSITION[0] (m)`.
    #[must_use]
    pub fn header(&self) -> String {
        let indices = format_indices(&self.indices);
        let unit = if self.unit.is_empty() { String::new() } else { format!(" ({})", self.unit) };
        format!("{}.{}{indices}{unit}", self.source, self.signal)
    }
}

/// Returns the indices of a word in a signal of this shape, from 0: axis, or row and column; empty for a scalar.
#[must_use]
pub fn indices(shape: Shape, word: usize, dof: usize) -> Vec<usize> {
    let (row, column) = shape.place(word, dof);
    match shape {
        Shape::Scalar => Vec::new(),
        Shape::Vector => vec![row],
        Shape::Matrix(..) | Shape::Square => vec![row, column],
    }
}

/// Formats indices: `[0][1]`.
#[must_use]
pub fn format_indices(indices: &[usize]) -> String {
    indices.iter().map(|index| format!("[{index}]")).collect()
}

/// Parts of a [`Recording`], sent to a listener during the run.
#[derive(Debug, Clone)]
pub enum RecordingChunk {
    /// Columns of the following rows: at the start and when columns are appended.
    Columns(Vec<Column>),
    /// Inputs of controllers, sent before the rows of the same ticks.
    Inputs(Vec<TickInputs>),
    /// Consecutive rows: tick number, time in `s`, and one value per column.
    Rows(Vec<f64>),
}

/// Inputs of a controller in one tick.
#[derive(Debug, Clone)]
pub struct TickInputs {
    /// Tick number.
    pub tick: u64,
    /// Time of the tick, `s`.
    pub time_s: f64,
    /// Index of the controller in the rig.
    pub station: usize,
    /// Inputs.
    pub inputs: Inputs,
}

/// Columns and rows of a run, row-major. `f64` represents all Data Base formats exactly.
#[derive(Debug, Clone, Default)]
pub struct Recording {
    columns: Vec<Column>,
    time_s: Vec<f64>,
    values: Vec<f64>,
    /// Maximum rows before thinning.
    max_rows: Option<usize>,
    /// Number of original rows per two kept rows, and the number in the last two so far.
    every: usize,
    merged: usize,
}

/// Number of rows thinned to two: minimum and maximum values.
const THINNED: usize = 4;

impl Recording {
    /// Creates an empty recording.
    #[must_use]
    pub fn new(columns: Vec<Column>) -> Self {
        Self { columns, time_s: Vec::new(), values: Vec::new(), max_rows: None, every: 1, merged: 0 }
    }

    /// Limits the number of rows, for pictures of runs of any length: when full, every four rows become two, with the
    /// minimum and maximum of each column, and so do later rows. Peaks are preserved, their exact times are not.
    pub fn limit_rows(&mut self, rows: usize) {
        self.max_rows = Some(rows.max(THINNED));
    }

    /// Whether rows represent several ticks.
    #[must_use]
    pub fn is_decimated(&self) -> bool {
        self.every > 1
    }

    /// Makes room for one more row.
    fn thin_out(&mut self) {
        let Some(max_rows) = self.max_rows else { return };
        if self.every > 1 {
            self.merge_last();
        }
        if self.time_s.len() >= max_rows && self.merged == 0 {
            self.thin();
            self.every = THINNED.max(2 * self.every);
        }
    }

    /// Thins every four rows to two.
    fn thin(&mut self) {
        let width = self.columns.len();
        let (mut time_s, mut values) = (Vec::new(), Vec::new());
        for (times, rows) in self.time_s.chunks(THINNED).zip(self.values.chunks(THINNED * width.max(1))) {
            time_s.extend(times.first().into_iter().chain(times.get(times.len() / 2)));
            for pick in [f64::min, f64::max] {
                let column =
                    |column: usize| rows.iter().skip(column).step_by(width).copied().fold(f64::NAN, pick);
                values.extend((0..width).map(column));
            }
        }
        (self.time_s, self.values) = (time_s, values);
    }

    /// Merges the last row into the two rows before it, or starts two new rows.
    fn merge_last(&mut self) {
        let width = self.columns.len();
        let Some(time_s) = self.time_s.pop() else { return };
        let row = self.values.split_off(self.values.len().saturating_sub(width));
        if self.merged == 0 {
            for _ in 0..2 {
                self.time_s.push(time_s);
                self.values.extend_from_slice(&row);
            }
        } else {
            let start = self.values.len().saturating_sub(2 * width);
            let (least, greatest) = self.values.get_mut(start..).unwrap_or_default().split_at_mut(width);
            for ((least, greatest), value) in least.iter_mut().zip(greatest).zip(row) {
                (*least, *greatest) = (least.min(value), greatest.max(value));
            }
        }
        self.merged += 1;
        if let Some(later_s) = self.time_s.last_mut().filter(|_| 2 * self.merged <= self.every) {
            *later_s = time_s;
        }
        if self.merged >= self.every {
            self.merged = 0;
        }
    }

    /// Appends columns; existing rows contain NaN there.
    pub fn add_columns(&mut self, columns: Vec<Column>) {
        if columns.is_empty() {
            return;
        }
        let missing = columns.len();
        let mut values = Vec::new();
        for row in self.rows() {
            values.extend_from_slice(row);
            values.extend(std::iter::repeat_n(f64::NAN, missing));
        }
        self.values = values;
        self.columns.extend(columns);
    }

    /// Reserves and touches memory for `rows` more rows, to avoid page faults during the run.
    pub fn reserve(&mut self, rows: usize) {
        touch(&mut self.time_s, rows);
        touch(&mut self.values, rows.saturating_mul(self.columns.len()));
    }

    /// Adds a row of NaN and returns it for writing, one value per column.
    pub fn add_row(&mut self, time_s: f64) -> &mut [f64] {
        self.thin_out();
        let start = self.values.len();
        self.time_s.push(time_s);
        self.values.resize(start + self.columns.len(), f64::NAN);
        self.values.get_mut(start..).unwrap_or_default()
    }

    /// Returns the columns in row order.
    #[must_use]
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// Returns the time of each row, `s`.
    #[must_use]
    pub fn time_s(&self) -> &[f64] {
        &self.time_s
    }

    /// Returns the rows, each as long as [`columns`](Self::columns).
    pub fn rows(&self) -> impl Iterator<Item = &[f64]> {
        self.values.chunks_exact(self.columns.len().max(1))
    }

    /// Returns the index of the column `source.signal[axis]`, or `source.signal` for a scalar.
    #[must_use]
    pub fn find(&self, source: &str, signal: &str, axis: Option<usize>) -> Option<usize> {
        self.columns
            .iter()
            .position(|c| c.source == source && c.signal == signal && c.indices == axis.as_slice())
    }

    /// Returns the values of a column, oldest first; empty if the index does not exist.
    pub fn column(&self, index: usize) -> impl Iterator<Item = f64> + '_ {
        self.rows().filter_map(move |row| row.get(index).copied())
    }
}

/// Reserved memory is mapped by the system at its first use, page by page.
fn touch(values: &mut Vec<f64>, more: usize) {
    let length = values.len();
    values.resize(length.saturating_add(more), f64::NAN);
    values.truncate(length);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recorded(max_rows: Option<usize>, rows: u32) -> Recording {
        let column = |signal: &str| Column {
            source: "world".to_owned(),
            signal: signal.to_owned(),
            indices: Vec::new(),
            unit: String::new(),
            format: None,
        };
        let mut recording = Recording::new(vec![column("sine"), column("peak")]);
        if let Some(max_rows) = max_rows {
            recording.limit_rows(max_rows);
        }
        for tick in 0..rows {
            let time_s = f64::from(tick) * 1e-3;
            let row = recording.add_row(time_s);
            row.copy_from_slice(&[libm::sin(time_s), if tick == 12_345 { 7.0 } else { f64::NAN }]);
        }
        recording
    }

    #[test]
    fn a_long_recording_keeps_its_peaks_in_bounded_memory() {
        let thin = recorded(Some(1000), 100_000);
        assert!((500..=1000).contains(&thin.rows().count()));
        assert!(thin.time_s().is_sorted() && thin.time_s().len() == thin.rows().count());
        let peak = thin.time_s().iter().zip(thin.column(1)).find(|(_, value)| *value > 0.0);
        assert!(peak.is_some_and(|(time_s, value)| (time_s - 12.345).abs() < 0.5 && value > 6.9), "{peak:?}");
        for (time_s, sine) in thin.time_s().iter().zip(thin.column(0)) {
            assert!((sine - libm::sin(*time_s)).abs() < 0.5, "{sine} at {time_s}");
        }
        let steps = thin.time_s().windows(2).filter_map(|pair| Some(pair.get(1)? - pair.first()?));
        let longest_s = steps.fold(0.0, f64::max);
        assert!(longest_s < 0.45, "two rows are {longest_s} s apart: 100 s are in 500 rows or more");
        let highest = thin.column(0).fold(f64::MIN, f64::max);
        assert!((highest - 1.0).abs() < 1e-6, "{highest}");
    }

    #[test]
    fn a_short_recording_is_as_it_was_taken() {
        let (thin, whole) = (recorded(Some(1000), 1000), recorded(None, 1000));
        assert!(thin.column(0).eq(whole.column(0)) && thin.time_s() == whole.time_s());
    }
}
