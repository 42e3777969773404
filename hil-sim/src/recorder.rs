//! Takes a row of every signal per tick: each Data Base, the world's truth, the channel's energy.

use dimsart_core::{Format, Scalar, TypeRef, Word};

use crate::recording::{Column, Recording};
use crate::rig::{Rig, Station};
use crate::scenario::RecordSection;

/// Records a rig.
#[derive(Debug)]
pub struct Recorder {
    recording: Recording,
    stations: Vec<StationSignals>,
    every_ticks: u64,
}

#[derive(Debug)]
struct StationSignals {
    signals: Vec<Recorded>,
    /// Revision of the Data Base that the slots are of.
    revision: u32,
    dof: usize,
}

#[derive(Debug)]
struct Recorded {
    signal: TypeRef,
    slot: Option<u8>,
    words: usize,
    format: Format,
}

/// Truth signals of a station, with their units.
const TRUTH: [(&str, &str); 5] = [
    ("position", "m"),
    ("velocity", "m/s"),
    ("actuator_force", "N"),
    ("hand_force", "N"),
    ("wall_force", "N"),
];

/// Name of the column with the energy in the channel.
pub const CHANNEL_ENERGY: &str = "channel_energy";

impl Recorder {
    /// A recorder for what the settings name of the signals that the stations' Data Bases hold now.
    #[must_use]
    pub fn new(rig: &Rig, settings: &RecordSection) -> Self {
        let mut columns = vec![column("world", CHANNEL_ENERGY, None, "J")];
        let stations = rig
            .stations()
            .iter()
            .map(|station| StationSignals::new(station, settings.data_base, &mut columns))
            .collect();
        Self {
            recording: Recording::new(columns),
            stations,
            every_ticks: u64::from(settings.every_ticks.max(1)),
        }
    }

    /// Makes room for the first 20 000 of `ticks` ticks; a longer run takes its memory as it goes.
    pub fn reserve(&mut self, ticks: f64) {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
        let ticks = ticks.clamp(0.0, 20_000.0) as u64;
        let rows = ticks / self.every_ticks + 1;
        self.recording.reserve(usize::try_from(rows).unwrap_or_default());
    }

    /// Takes a row of the present tick, if it is one of those wanted.
    pub fn record(&mut self, rig: &Rig, channel_energy_j: f64) {
        if !rig.ticks().is_multiple_of(self.every_ticks) {
            return;
        }
        let stations = &mut self.stations;
        self.recording.push_row(rig.time_s(), |row| {
            row.push(channel_energy_j);
            for (signals, station) in stations.iter_mut().zip(rig.stations()) {
                signals.push(station, row);
            }
        });
    }

    /// What was recorded.
    #[must_use]
    pub fn finish(self) -> Recording {
        self.recording
    }
}

impl StationSignals {
    fn new(station: &Station, with_data_base: bool, columns: &mut Vec<Column>) -> Self {
        let engine = station.dimsart.engine();
        let device = engine.device();
        let axes = device.axes();
        let mut signals = Vec::new();
        for (slot, entry) in engine.data_base().signals().filter(|_| with_data_base) {
            let words = engine.data_base().words(slot).len();
            let name = device.signal_name(entry.signal).to_string();
            for word in 0..words {
                let kind = axes.get(word).copied().unwrap_or_default();
                let axis = (words > 1).then_some(word);
                columns.push(column(&station.name, &name, axis, entry.data_type.unit.symbol(kind)));
            }
            signals.push(Recorded {
                signal: entry.signal,
                slot: Some(slot),
                words,
                format: entry.data_type.format,
            });
        }
        for axis in 0..axes.len() {
            for (name, unit) in TRUTH {
                columns.push(column("world", &format!("{}.{name}", station.name), Some(axis), unit));
            }
        }
        Self { signals, revision: engine.data_base().revision(), dof: axes.len() }
    }

    fn push(&mut self, station: &Station, row: &mut Vec<f64>) {
        let data_base = station.dimsart.engine().data_base();
        if self.revision != data_base.revision() {
            self.revision = data_base.revision();
            for recorded in &mut self.signals {
                recorded.slot = data_base.slot(recorded.signal);
            }
        }
        for recorded in &self.signals {
            let Some(slot) = recorded.slot else {
                row.extend(std::iter::repeat_n(f64::NAN, recorded.words));
                continue;
            };
            let words = data_base.words(slot).iter();
            match recorded.format {
                Format::F32 => row.extend(words.map(|word| f64::from(f32::from_bits(*word)))),
                Format::I32 => row.extend(words.map(|word| f64::from(i32::from_word(Word(*word))))),
                Format::U32 | Format::Bool => row.extend(words.map(|word| f64::from(*word))),
            }
        }
        for axis in 0..self.dof {
            match station.plant.truth(axis) {
                Some(truth) => row.extend([
                    truth.position_m,
                    truth.velocity_m_per_s,
                    truth.actuator_force_n,
                    truth.hand_force_n,
                    truth.wall_force_n,
                ]),
                None => row.extend([f64::NAN; TRUTH.len()]),
            }
        }
    }
}

fn column(source: &str, signal: &str, axis: Option<usize>, unit: &str) -> Column {
    Column { source: source.to_owned(), signal: signal.to_owned(), axis, unit: unit.to_owned() }
}
