//! Every recorded signal as text, while it is recorded: one named column each, one row per tick.
//!
//! Numbers are the shortest text that reads back as the same number, in the width it was computed in: an `f32` kept
//! as `f64` is written as the `f32` it is (`0.1`, not `0.10000000149011612`).

use std::fs::{self, File};
use std::io::{self, Seek as _};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;

use super::{BUS_STEM, PAGE_FILE, ReportError, SIGNALS_FILE, TIMELINE_STEM, make_folder, picture_files};
use crate::recording::{Column, Piece};

/// Name of the first column.
const TIME_HEADER: &str = "time_s (s)";
/// Rows that may wait for a slow disk before the run waits for it, too.
const MOST_WAITING: usize = 4096;
/// Rows that are written at once when they come fast.
const ROWS_AT_ONCE: usize = 64;
/// A number and a comma take no more.
const NUMBER_BYTES: usize = 26;

/// Integers up to here are exact in `f64`.
const LARGEST_EXACT_INTEGER: f64 = 9_007_199_254_740_992.0;

/// The file with the signals of a run. It grows while the run goes on, by whole rows: a run that is killed leaves what
/// it recorded.
#[derive(Debug)]
pub struct SignalsFile {
    path: PathBuf,
    thread: JoinHandle<io::Result<()>>,
}

impl SignalsFile {
    /// Begins the file in `folder`, made if missing, in place of the report that is there, with pictures of these
    /// `stems`. What it is to hold goes into the sender, which waits when the disk is 4096 rows behind.
    ///
    /// # Errors
    /// [`ReportError`] names the folder or file and what to do.
    pub fn create(folder: &Path, stems: &[&str]) -> Result<(Self, SyncSender<Piece>), ReportError> {
        make_folder(folder)?;
        let path = folder.join(SIGNALS_FILE);
        let pictures =
            stems.iter().chain(&[BUS_STEM, TIMELINE_STEM]).flat_map(|stem| picture_files(folder, stem));
        for old in [folder.join(PAGE_FILE)].into_iter().chain(pictures) {
            match fs::remove_file(&old) {
                Err(source) if source.kind() != io::ErrorKind::NotFound => {
                    return Err(ReportError::File { path: old, source });
                }
                _ => {}
            }
        }
        let file = File::create(&path).map_err(|source| ReportError::File { path: path.clone(), source })?;
        let (sender, pieces) = sync_channel(MOST_WAITING);
        let thread = std::thread::spawn(move || write(&pieces, &file));
        Ok((Self { path, thread }, sender))
    }

    /// Waits until all is written that went into the sender, which must be gone.
    ///
    /// # Errors
    /// [`ReportError::File`] when the disk did not take it; the rows before are in the file.
    pub fn finish(self) -> Result<PathBuf, ReportError> {
        let written = self.thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        written.map(|()| self.path.clone()).map_err(|source| ReportError::File { path: self.path, source })
    }
}

/// Writes what comes until the sender is gone. A row that a full disk takes in part is taken out again.
fn write(pieces: &Receiver<Piece>, file: &File) -> io::Result<()> {
    let mut whole_bytes = 0;
    let written = write_rows(pieces, file, &mut whole_bytes);
    if written.is_err() {
        let _ = file.set_len(whole_bytes);
    }
    written
}

fn write_rows(pieces: &Receiver<Piece>, mut file: &File, whole_bytes: &mut u64) -> io::Result<()> {
    let (mut table, mut waiting, mut number) = (begin(file, &[])?, 0, NumberText::default());
    loop {
        let piece = pieces.try_recv();
        if piece.is_err() || waiting == ROWS_AT_ONCE {
            table.flush()?;
            (*whole_bytes, waiting) = (file.stream_position()?, 0);
        }
        let Ok(piece) = piece.or_else(|_| pieces.recv()) else { return Ok(()) };
        match piece {
            Piece::Columns(columns) => {
                table.flush()?;
                table = begin(file, &columns)?;
            }
            Piece::Row(time_s, values) => {
                for value in std::iter::once(time_s).chain(values) {
                    table.write_field(number.text(value))?;
                }
                table.write_record(None::<&[u8]>)?;
                waiting += 1;
            }
        }
    }
}

/// Begins the file anew, with the names of these columns. Its buffer has room for all that is written at once.
fn begin<'a>(mut file: &'a File, columns: &[Column]) -> io::Result<csv::Writer<&'a File>> {
    file.rewind()?;
    file.set_len(0)?;
    let buffer_bytes = (1 + ROWS_AT_ONCE) * NUMBER_BYTES * (1 + columns.len());
    let mut table = csv::WriterBuilder::new().buffer_capacity(buffer_bytes).from_writer(file);
    table.write_field(TIME_HEADER)?;
    for column in columns {
        table.write_field(column.header())?;
    }
    table.write_record(None::<&[u8]>)?;
    table.flush()?;
    Ok(table)
}

/// Turns numbers into text without allocating.
#[derive(Default)]
struct NumberText {
    integer: itoa::Buffer,
    float: zmij::Buffer,
}

impl NumberText {
    #[expect(clippy::cast_possible_truncation, reason = "both casts are checked to be exact")]
    fn text(&mut self, value: f64) -> &str {
        if value.fract() == 0.0 && value.abs() < LARGEST_EXACT_INTEGER {
            return if value == 0.0 && value.is_sign_negative() {
                "-0"
            } else {
                self.integer.format(value as i64)
            };
        }
        let single = value as f32;
        let text = if f64::from(single).to_bits() == value.to_bits() {
            self.float.format(single)
        } else {
            self.float.format(value)
        };
        text.strip_suffix(".0").unwrap_or(text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_core::{Rng, SeedableRng};

    fn column(signal: &str, unit: &str) -> Column {
        Column { source: "master".into(), signal: signal.into(), indices: vec![0], unit: unit.into() }
    }

    fn csv_of(columns: Vec<Column>, rows: impl IntoIterator<Item = (f64, Vec<f64>)>) -> Vec<u8> {
        let folder = tempfile::tempdir().unwrap();
        let (file, pieces) = SignalsFile::create(folder.path(), &[]).unwrap();
        pieces.send(Piece::Columns(columns)).unwrap();
        rows.into_iter().for_each(|(time_s, values)| pieces.send(Piece::Row(time_s, values)).unwrap());
        drop(pieces);
        fs::read(file.finish().unwrap()).unwrap()
    }

    #[test]
    fn every_number_reads_back_with_the_same_bits() {
        let columns = vec![column("SINGLE", "m"), column("DOUBLE", "N"), column("COUNT", "")];
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(7);
        let mut expected = Vec::new();
        for tick in 0..5_000_u32 {
            let single = f32::from_bits(random.next_u32());
            let single = if single.is_nan() { -0.0 } else { single };
            let double = f64::from_bits(random.next_u64());
            let double = if double.is_nan() { 1.0 / 3.0 } else { double };
            let count = random.next_u32();
            expected.push((f64::from(tick) * 1e-3, single, double, count));
        }
        let rows = expected.iter().map(|(time_s, single, double, count)| {
            (*time_s, vec![f64::from(*single), *double, f64::from(*count)])
        });
        let bytes = csv_of(columns, rows);
        let mut table = csv::Reader::from_reader(bytes.as_slice());
        assert_eq!(
            table.headers().unwrap(),
            vec!["time_s (s)", "master.SINGLE[0] (m)", "master.DOUBLE[0] (N)", "master.COUNT[0]"]
        );
        let rows: Vec<csv::StringRecord> = table.records().collect::<Result<_, _>>().unwrap();
        assert_eq!(rows.len(), expected.len());
        for (row, (time_s, single, double, count)) in rows.iter().zip(expected) {
            assert_eq!(row[0].parse::<f64>().unwrap().to_bits(), time_s.to_bits());
            assert_eq!(row[1].parse::<f32>().unwrap().to_bits(), single.to_bits());
            assert_eq!(row[2].parse::<f64>().unwrap().to_bits(), double.to_bits());
            assert_eq!(row[3].parse::<u32>().unwrap(), count);
        }
    }

    #[test]
    fn numbers_are_as_short_as_they_can_be() {
        let mut number = NumberText::default();
        for (value, text) in [
            (f64::from(0.1_f32), "0.1"),
            (0.1, "0.1"),
            (1.0 / 3.0, "0.3333333333333333"),
            (f64::from(1.0_f32 / 3.0), "0.33333334"),
            (1.0, "1"),
            (-0.0, "-0"),
            (f64::from(u32::MAX), "4294967295"),
            (f64::from(i32::MIN), "-2147483648"),
            (f64::from(true), "1"),
            (f64::NAN, "NaN"),
            (f64::NEG_INFINITY, "-inf"),
        ] {
            assert_eq!(number.text(value), text);
        }
    }

    #[test]
    fn a_table_that_begins_anew_has_nothing_of_the_one_before() {
        let folder = tempfile::tempdir().unwrap();
        let (file, pieces) = SignalsFile::create(folder.path(), &[]).unwrap();
        let (one, other) = (column("ONE", "m"), column("OTHER", "m"));
        let rows = |width| (0..200).map(move |row| Piece::Row(row.into(), vec![0.5; width]));
        let anew = [Piece::Columns(vec![one.clone(), other])];
        for piece in [Piece::Columns(vec![one])].into_iter().chain(rows(1)).chain(anew).chain(rows(2)) {
            pieces.send(piece).unwrap();
        }
        drop(pieces);
        let mut table = csv::Reader::from_path(file.finish().unwrap()).unwrap();
        assert_eq!(table.headers().unwrap().len(), 3);
        assert_eq!(table.records().map(Result::unwrap).filter(|row| &row[2] == "0.5").count(), 200);
    }

    #[test]
    fn a_name_with_a_comma_stays_one_column() {
        let bytes = csv_of(vec![column("odd, \"name\"", "m")], []);
        let mut table = csv::Reader::from_reader(bytes.as_slice());
        assert_eq!(&table.headers().unwrap()[1], "master.odd, \"name\"[0] (m)");
    }
}
