//! The CSV of a sweep: the keys' values first, then the figures; a row for each point, in the order in which they came.

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
    /// What is wrong, and what to do.
    pub reason: String,
}

/// A file that rows are added to. A row is written whole or not at all, so that a sweep can be ended at any time.
#[derive(Debug)]
pub struct SweepFile {
    path: PathBuf,
    file: File,
    keys: Vec<String>,
    /// Names of the figures; empty before the first row.
    figures: Vec<String>,
    done: HashSet<Vec<String>>,
}

/// The content of a file: header and rows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SweepTable {
    /// Names of the columns.
    pub header: Vec<String>,
    /// Rows, each as long as the header.
    pub rows: Vec<Vec<String>>,
}

impl SweepFile {
    /// Opens the file of a sweep, and finds out what is done already; makes it if it is not there.
    ///
    /// # Errors
    /// [`SweepFileError`] for one that cannot be read or written, or is of other keys.
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
                    let reason =
                        "it is of a sweep over other keys: give another folder with --out, or remove it";
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

    /// Whether a point is in it.
    #[must_use]
    pub fn has(&self, values: &[String]) -> bool {
        self.done.contains(values)
    }

    /// How many points are in it.
    #[must_use]
    pub fn len(&self) -> usize {
        self.done.len()
    }

    /// Whether it has none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.done.is_empty()
    }

    /// Adds a point's row. Figures that the first one did not have are left out, those that this one lacks stay empty.
    ///
    /// # Errors
    /// [`SweepFileError`] when it cannot be written.
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
    /// Reads a file; says whether it is whole: a last row that was cut off is left out.
    ///
    /// # Errors
    /// [`SweepFileError`] when it cannot be read or is no CSV.
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

    /// Adds the rows of another one that are not there yet, by their first `keys` columns.
    ///
    /// # Errors
    /// The names of its columns when they are others.
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

    /// Puts the rows into the order of a grid; those that are none of its points go to the end.
    pub fn sort(&mut self, grid: &Grid) {
        let order: std::collections::HashMap<Vec<String>, usize> =
            (0..grid.points()).map(|point| (grid.values(point), point)).collect();
        let keys = grid.axes().len();
        self.rows.sort_by_key(|row| {
            order.get(&row.iter().take(keys).cloned().collect::<Vec<_>>()).copied().unwrap_or(usize::MAX)
        });
    }

    /// Writes it in the place of the file, whole or not at all.
    ///
    /// # Errors
    /// [`SweepFileError`] when it cannot be written.
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
