//! CSV file of a sweep: values of the keys, then figures; one row per point, in order of completion.

use std::collections::HashSet;
use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use super::{Figures, Grid};

/// A file that cannot be used for a sweep.
#[derive(Debug, thiserror::Error)]
#[error("{}: {reason}", path.display())]
pub struct SweepFileError {
    /// The file.
    pub path: PathBuf,
    /// Error and remedy.
    pub reason: String,
}

/// A file to which rows are added. Each row is written atomically, so that a sweep can be ended at any time.
#[derive(Debug)]
pub struct SweepFile {
    path: PathBuf,
    file: File,
    keys: Vec<String>,
    /// Names of the figures; empty before the first row.
    figures: Vec<String>,
    done: HashSet<Vec<String>>,
}

/// Content of a file: header and rows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SweepTable {
    /// Names of the columns.
    pub header: Vec<String>,
    /// Rows, each as long as the header.
    pub rows: Vec<Vec<String>>,
}

impl SweepFile {
    /// Opens or creates the file of a sweep, and reads its finished points.
    ///
    /// # Errors
    /// [`SweepFileError`] for a file that cannot be read or written, or has other keys.
    pub fn open(path: &Path, grid: &Grid) -> Result<Self, SweepFileError> {
        let refuse = |reason: String| SweepFileError { path: path.to_owned(), reason };
        let keys: Vec<String> = grid.axes().iter().map(|axis| axis.key.clone()).collect();
        let mut figures = Vec::new();
        let mut done = HashSet::new();
        if path.exists() {
            let (table, whole) = SweepTable::read(path)?;
            let is_cut = !whole;
            if !table.header.is_empty() {
                if table.header.get(..keys.len()) != Some(keys.as_slice()) {
                    let reason = "the file is from a sweep over other keys: choose another folder with --out, or \
                                  remove the file";
                    return Err(refuse(reason.to_owned()));
                }
                figures = table.header.get(keys.len()..).unwrap_or_default().to_vec();
            }
            done.extend(table.rows.iter().filter_map(|row| Some(row.get(..keys.len())?.to_vec())));
            if is_cut {
                table.write(path)?;
            }
        }
        let file = OpenOptions::new().create(true).append(true).open(path);
        let file = file.map_err(|error| refuse(error.to_string()))?;
        Ok(Self { path: path.to_owned(), file, keys, figures, done })
    }

    /// Returns whether the file contains a point.
    #[must_use]
    pub fn has(&self, values: &[String]) -> bool {
        self.done.contains(values)
    }

    /// Returns the number of points.
    #[must_use]
    pub fn len(&self) -> usize {
        self.done.len()
    }

    /// Returns whether the file has no points.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.done.is_empty()
    }

    /// Adds the row of a point. The first row defines the columns: other figures are omitted, missing ones stay empty.
    ///
    /// # Errors
    /// [`SweepFileError`] on a write error.
    pub fn add(&mut self, values: &[String], figures: &Figures) -> Result<(), SweepFileError> {
        let refuse = |error: String| SweepFileError { path: self.path.clone(), reason: error };
        let mut writer = csv::Writer::from_writer(Vec::new());
        if self.figures.is_empty() {
            self.figures = figures.iter().map(|(name, _)| name.clone()).collect();
            let header = self.keys.iter().chain(&self.figures);
            writer.write_record(header).map_err(|error| refuse(error.to_string()))?;
        }
        let of =
            |name: &String| figures.iter().find(|(known, _)| known == name).map_or("", |(_, value)| value);
        let row = values.iter().map(String::as_str).chain(self.figures.iter().map(of));
        writer.write_record(row).map_err(|error| refuse(error.to_string()))?;
        let bytes = writer.into_inner().map_err(|error| refuse(error.to_string()))?;
        self.file
            .write_all(&bytes)
            .and_then(|()| self.file.flush())
            .map_err(|error| refuse(error.to_string()))?;
        self.done.insert(values.to_vec());
        Ok(())
    }
}

impl SweepTable {
    /// Reads a file and returns whether it is complete: omits an incomplete last row.
    ///
    /// # Errors
    /// [`SweepFileError`] when it cannot be read or is invalid CSV.
    pub fn read(path: &Path) -> Result<(Self, bool), SweepFileError> {
        let refuse = |reason: String| SweepFileError { path: path.to_owned(), reason };
        let mut text = String::new();
        File::open(path)
            .and_then(|mut file| file.read_to_string(&mut text))
            .map_err(|error| refuse(error.to_string()))?;
        let whole = text.rfind('\n').map_or(0, |end| end + 1);
        let is_whole = whole == text.len();
        text.truncate(whole);
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let header = reader.headers().map_err(|error| refuse(error.to_string()))?;
        let header = header.iter().map(str::to_owned).collect();
        let rows = reader.records().map(|row| Ok(row?.iter().map(str::to_owned).collect()));
        let rows = rows.collect::<Result<_, csv::Error>>().map_err(|error| refuse(error.to_string()))?;
        Ok((Self { header, rows }, is_whole))
    }

    /// Adds new rows of another table, identified by their first `keys` columns.
    ///
    /// # Errors
    /// The column names of the other table if they differ.
    pub fn merge(&mut self, other: Self, keys: usize) -> Result<(), Vec<String>> {
        if self.header != other.header {
            return Err(other.header);
        }
        let known: HashSet<Vec<String>> =
            self.rows.iter().map(|row| row.iter().take(keys).cloned().collect()).collect();
        let is_new = |row: &Vec<String>| !known.contains(&row.iter().take(keys).cloned().collect::<Vec<_>>());
        self.rows.extend(other.rows.into_iter().filter(is_new));
        Ok(())
    }

    /// Sorts the rows in the order of a grid; rows of other points follow at the end.
    pub fn sort(&mut self, grid: &Grid) {
        let order: std::collections::HashMap<Vec<String>, usize> =
            (0..grid.points()).map(|point| (grid.values(point), point)).collect();
        let keys = grid.axes().len();
        self.rows.sort_by_key(|row| {
            order.get(&row.iter().take(keys).cloned().collect::<Vec<_>>()).copied().unwrap_or(usize::MAX)
        });
    }

    /// Replaces the file atomically.
    ///
    /// # Errors
    /// [`SweepFileError`] on a write error.
    pub fn write(&self, path: &Path) -> Result<(), SweepFileError> {
        let refuse = |reason: String| SweepFileError { path: path.to_owned(), reason };
        let beside = path.with_extension("csv.part");
        let mut writer = csv::Writer::from_path(&beside).map_err(|error| refuse(error.to_string()))?;
        let rows = std::iter::once(&self.header).filter(|header| !header.is_empty()).chain(&self.rows);
        for row in rows {
            writer.write_record(row).map_err(|error| refuse(error.to_string()))?;
        }
        writer.flush().map_err(|error| refuse(error.to_string()))?;
        std::fs::rename(&beside, path).map_err(|error| refuse(error.to_string()))
    }
}
