//! Every recorded signal as text: one named column each, one row per tick.
//!
//! Numbers are the shortest text that reads back as the same number, in the width it was computed in: an `f32` kept
//! as `f64` is written as the `f32` it is (`0.1`, not `0.10000000149011612`).

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::recording::Recording;

/// Name of the first column.
const TIME_HEADER: &str = "time_s (s)";

/// Integers up to here are exact in `f64`.
const LARGEST_EXACT_INTEGER: f64 = 9_007_199_254_740_992.0;

/// Writes header and rows of `recording` to `out`, until `stop` is set.
///
/// # Errors
/// Whatever `out` reports, or that it was stopped; the rows before it may have been written.
pub(super) fn write(recording: &Recording, stop: &AtomicBool, out: impl io::Write) -> io::Result<()> {
    let mut table = csv::WriterBuilder::new().buffer_capacity(1 << 20).from_writer(out);
    table.write_field(TIME_HEADER)?;
    for column in recording.columns() {
        table.write_field(column.header())?;
    }
    table.write_record(None::<&[u8]>)?;
    let mut number = NumberText::default();
    for (time_s, row) in recording.time_s().iter().zip(recording.rows()) {
        if stop.load(Ordering::Relaxed) {
            return Err(io::Error::other("stopped"));
        }
        table.write_field(number.text(*time_s))?;
        for value in row {
            table.write_field(number.text(*value))?;
        }
        table.write_record(None::<&[u8]>)?;
    }
    table.flush()
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
    use crate::recording::Column;
    use rand_core::{Rng, SeedableRng};

    fn column(signal: &str, unit: &str) -> Column {
        Column { source: "master".into(), signal: signal.into(), indices: vec![0], unit: unit.into() }
    }

    fn csv_of(recording: &Recording) -> Vec<u8> {
        let mut bytes = Vec::new();
        write(recording, &AtomicBool::new(false), &mut bytes).unwrap();
        bytes
    }

    #[test]
    fn every_number_reads_back_with_the_same_bits() {
        let mut recording =
            Recording::new(vec![column("SINGLE", "m"), column("DOUBLE", "N"), column("COUNT", "")]);
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(7);
        let mut expected = Vec::new();
        for tick in 0..5_000_u32 {
            let single = f32::from_bits(random.next_u32());
            let single = if single.is_nan() { -0.0 } else { single };
            let double = f64::from_bits(random.next_u64());
            let double = if double.is_nan() { 1.0 / 3.0 } else { double };
            let count = random.next_u32();
            expected.push((f64::from(tick) * 1e-3, single, double, count));
            let row = recording.add_row(f64::from(tick) * 1e-3);
            row.copy_from_slice(&[f64::from(single), double, f64::from(count)]);
        }
        let bytes = csv_of(&recording);
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
    fn a_name_with_a_comma_stays_one_column() {
        let recording = Recording::new(vec![column("odd, \"name\"", "m")]);
        let bytes = csv_of(&recording);
        let mut table = csv::Reader::from_reader(bytes.as_slice());
        assert_eq!(&table.headers().unwrap()[1], "master.odd, \"name\"[0] (m)");
    }
}
