//! Signals of the last seconds.

use std::collections::VecDeque;

use dimsart_core::Format;
use dimsart_core::scheme::switch;

use super::text::moving;
use crate::page::news::Rows;

/// Length of history and chart, s.
pub(super) const SHOWN_S: f64 = 10.0;

/// Column of a row.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Column {
    pub(super) signal: String,
    /// Index of the value in the signal.
    pub(super) place: usize,
    pub(super) format: Format,
}

/// Rows, newest last.
#[derive(Debug)]
pub(super) struct Live {
    columns: Vec<Column>,
    rows: VecDeque<(u32, Vec<f64>)>,
    /// Sample period, s.
    pub(super) period_s: f64,
}

impl Default for Live {
    fn default() -> Self {
        Self { columns: Vec::new(), rows: VecDeque::new(), period_s: 1e-3 }
    }
}

impl Live {
    pub(super) fn hear(&mut self, rows: &Rows) {
        let columns = rows.signals.iter().flat_map(|signal| {
            let (name, format) = (signal.name.clone(), signal.format());
            (0..signal.words).map(move |place| Column { signal: name.clone(), place, format })
        });
        self.take(columns.collect(), rows.rows.iter().map(|row| (row.tick, row.values.clone())));
    }

    /// Adds rows. Other columns or a restart of the device clear the history.
    pub(super) fn take(&mut self, columns: Vec<Column>, rows: impl Iterator<Item = (u32, Vec<f64>)>) {
        if self.columns != columns {
            self.rows.clear();
            self.columns = columns;
        }
        for (tick, values) in rows {
            if self.rows.back().is_some_and(|(last, _)| tick.wrapping_sub(*last) > u32::MAX / 2) {
                self.rows.clear();
            }
            self.rows.push_back((tick, values));
        }
        let newest = self.rows.back().map_or(0, |(tick, _)| *tick);
        let (period_s, is_old) =
            (self.period_s, |age: u32, period_s: f64| f64::from(age) * period_s > SHOWN_S);
        while self.rows.front().is_some_and(|(tick, _)| is_old(newest.wrapping_sub(*tick), period_s)) {
            self.rows.pop_front();
        }
    }

    /// Returns the newest value; `None` for a signal without rows.
    pub(super) fn newest(&self, signal: &str, place: usize) -> Option<String> {
        let column = self.column(signal, place)?;
        let value = *self.rows.back()?.1.get(column)?;
        Some(match self.columns.get(column)?.format {
            Format::F32 => moving(value),
            Format::Bool => switch(value.abs() > 0.0).to_owned(),
            Format::I32 | Format::U32 => format!("{value:.0}"),
        })
    }

    /// Returns points of the last seconds: time relative to now in s, and value.
    pub(super) fn points(&self, signal: &str, place: usize) -> Vec<(f64, f64)> {
        let (Some(column), Some((newest, _))) = (self.column(signal, place), self.rows.back()) else {
            return Vec::new();
        };
        let point = |(tick, values): &(u32, Vec<f64>)| {
            Some((-f64::from(newest.wrapping_sub(*tick)) * self.period_s, *values.get(column)?))
        };
        self.rows.iter().filter_map(point).collect()
    }

    fn column(&self, signal: &str, place: usize) -> Option<usize> {
        self.columns.iter().position(|column| column.signal == signal && column.place == place)
    }
}
