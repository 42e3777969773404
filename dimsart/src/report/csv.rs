//! Writes recorded signals as CSV during the run: one named column per word, one row per tick.
//!
//! Numbers are written as the shortest text that is parsed to the same number in the original width: an `f32` stored as `f64`
//! is written as `f32` (`0.1`, not `0.10000000149011612`).

use std::fs::{self, File};
use std::io::{self, BufRead as _, BufReader, BufWriter, Seek as _, Write as _};
use std::path::Path;
use std::sync::mpsc::Receiver;

use hil_sim::recording::{Column, RecordingChunk};

/// Name of the first column.
const TIME_HEADER: &str = "time_s (s)";
/// Maximum length of a number and a comma, copied with a constant length.
const NUMBER_BYTES: usize = 32;
/// Size of the number cache, as a power of two: a few rows.
const REMEMBERED_BITS: u32 = 10;
/// Odd multiplier of the hash.
const SPREAD: u64 = 0x9E37_79B9_7F4A_7C15;

/// Largest integer up to which `f64` is exact.
const LARGEST_EXACT_INTEGER: f64 = 9_007_199_254_740_992.0;

/// Writes received rows until the sender is dropped. Removes a row that a full disk took only partly.
pub(super) fn write(pieces: &Receiver<RecordingChunk>, mut file: File, path: &Path) -> io::Result<()> {
    begin(&mut file, &[])?;
    // Columns of a row, including tick and time.
    let (mut width, mut text, mut numbers) = (2, Vec::new(), Numbers::new());
    for piece in pieces {
        match piece {
            RecordingChunk::Columns(columns) => {
                file = widen(file, path, &columns, (2 + columns.len()).saturating_sub(width))?;
                width = 2 + columns.len();
            }
            RecordingChunk::Inputs(_) => {}
            RecordingChunk::Rows(values) => {
                text.clear();
                for row in values.chunks_exact(width) {
                    row.iter().skip(1).for_each(|value| numbers.add(&mut text, *value));
                    if let Some(comma) = text.last_mut() {
                        *comma = b'\n';
                    }
                }
                let whole_bytes = file.stream_position()?;
                file.write_all(&text).inspect_err(|_| drop(file.set_len(whole_bytes)))?;
            }
        }
    }
    Ok(())
}

/// Replaces the file at `path` by a file with the `new` last columns added, empty in existing rows. A killed process leaves
/// one of both files.
fn widen(mut file: File, path: &Path, columns: &[Column], new: usize) -> io::Result<File> {
    let wider_path = path.with_extension("csv.new");
    let wider = File::options().read(true).write(true).create(true).truncate(true).open(&wider_path)?;
    let mut wider = BufWriter::new(wider);
    begin(&mut wider, columns)?;
    let nothing = ",NaN".repeat(new);
    file.rewind()?;
    for row in BufReader::new(file).lines().skip(1) {
        writeln!(wider, "{}{nothing}", row?)?;
    }
    let wider = wider.into_inner().map_err(io::IntoInnerError::into_error)?;
    fs::rename(wider_path, path)?;
    Ok(wider)
}

/// Writes the header.
fn begin(file: &mut impl io::Write, columns: &[Column]) -> io::Result<()> {
    let headers = columns.iter().map(Column::header);
    let mut table = csv::Writer::from_writer(file);
    table.write_record(std::iter::once(TIME_HEADER.to_owned()).chain(headers))?;
    table.flush()
}

/// Formats numbers with a cache: most numbers repeat, in the next row, in another column, or at the other end of a link.
#[derive(Debug)]
struct Numbers(Vec<Known>);

/// A number followed by a comma.
#[derive(Debug, Clone)]
struct Known {
    bits: u64,
    length: usize,
    text: [u8; NUMBER_BYTES],
}

impl Numbers {
    fn new() -> Self {
        let mut zero = Known { bits: 0, length: 0, text: [0; NUMBER_BYTES] };
        zero.add(&mut Vec::new(), "0");
        Self(vec![zero; 1 << REMEMBERED_BITS])
    }

    fn add(&mut self, text: &mut Vec<u8>, value: f64) {
        let bits = value.to_bits();
        let place = bits.wrapping_mul(SPREAD) >> (u64::BITS - REMEMBERED_BITS);
        let Some(known) = usize::try_from(place).ok().and_then(|place| self.0.get_mut(place)) else { return };
        if known.bits == bits {
            // Copy a constant length, then truncate: faster than a variable length.
            let end = text.len() + known.length;
            text.extend_from_slice(&known.text);
            text.truncate(end);
        } else {
            known.bits = bits;
            with_text(value, |number| known.add(text, number));
        }
    }
}

impl Known {
    /// Stores the number and appends it to `text`.
    fn add(&mut self, text: &mut Vec<u8>, number: &str) {
        let number = number.as_bytes();
        text.extend_from_slice(number);
        text.push(b',');
        // Every number fits.
        if let Some((own, [comma, ..])) = self.text.split_at_mut_checked(number.len()) {
            own.copy_from_slice(number);
            *comma = b',';
            self.length = number.len() + 1;
        }
    }
}

/// Formats a number and passes the text to `take`.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    reason = "casts are checked to be exact"
)]
fn with_text(value: f64, take: impl FnOnce(&str)) {
    let (integer, single) = (value as i64, value as f32);
    let (is_integer, is_large) =
        ((integer as f64).to_bits() == value.to_bits(), value.abs() >= LARGEST_EXACT_INTEGER);
    if is_integer && !is_large {
        return take(itoa::Buffer::new().format(integer));
    }
    let mut buffer = zmij::Buffer::new();
    let is_single = f64::from(single).to_bits() == value.to_bits();
    let text = if is_single { buffer.format(single) } else { buffer.format(value) };
    // Other numbers are always formatted.
    let is_whole = is_large || integer == 0;
    take(if is_whole { text.strip_suffix(".0").unwrap_or(text) } else { text });
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::report::{SignalsFile, SignalsFormat};
    use rand_core::{Rng, SeedableRng};

    fn column(signal: &str, unit: &str) -> Column {
        Column {
            source: "master".into(),
            signal: signal.into(),
            indices: vec![0],
            unit: unit.into(),
            format: None,
        }
    }

    fn csv_of(columns: Vec<Column>, rows: impl IntoIterator<Item = (f64, Vec<f64>)>) -> Vec<u8> {
        let folder = tempfile::tempdir().unwrap();
        let (file, pieces) = SignalsFile::create(folder.path(), &[], SignalsFormat::Csv).unwrap();
        pieces.send(RecordingChunk::Columns(columns)).unwrap();
        for (time_s, values) in rows {
            pieces.send(RecordingChunk::Rows([vec![0.0, time_s], values].concat())).unwrap();
        }
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
        for (value, text) in [
            (f64::from(0.1_f32), "0.1"),
            (0.1, "0.1"),
            (1.0 / 3.0, "0.3333333333333333"),
            (f64::from(1.0_f32 / 3.0), "0.33333334"),
            (0.0, "0"),
            (1.0, "1"),
            (9_007_199_254_740_994.0, "9007199254740994"),
            (-0.0, "-0"),
            (f64::from(u32::MAX), "4294967295"),
            (f64::from(i32::MIN), "-2147483648"),
            (f64::from(true), "1"),
            (f64::NAN, "NaN"),
            (f64::NEG_INFINITY, "-inf"),
        ] {
            with_text(value, |number| assert_eq!(number, text));
        }
    }

    #[test]
    fn a_table_that_begins_anew_has_nothing_of_the_one_before() {
        let folder = tempfile::tempdir().unwrap();
        let (file, pieces) = SignalsFile::create(folder.path(), &[], SignalsFormat::Csv).unwrap();
        let (one, other) = (column("ONE", "m"), column("OTHER", "m"));
        let rows = |width: usize| (0..100).map(move |_| RecordingChunk::Rows(vec![0.5; 2 * (2 + width)]));
        let anew = [RecordingChunk::Columns(vec![one.clone(), other])];
        for piece in
            [RecordingChunk::Columns(vec![one])].into_iter().chain(rows(1)).chain(anew).chain(rows(2))
        {
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
