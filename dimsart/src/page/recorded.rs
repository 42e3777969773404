//! Recordings for the scope: loaded files, and exports.

use std::fs::File;
use std::io::{self, Read as _, Seek as _};
use std::path::{Path, PathBuf};
use std::sync::mpsc::sync_channel;
use std::sync::{Arc, OnceLock};
use std::thread;

use dimsart_core::ModuleKinds;
use hil_sim::recording::{Column, RecordingChunk};
use serde::{Deserialize, Serialize};

use crate::replay::{self, RecordedSignal, RecordedSignals, ReplayError};
use crate::report::{RunMetadata, write_mcap};

/// A recording that the page shows.
#[derive(Debug, Clone)]
pub struct Recording {
    /// File name.
    pub(super) name: String,
    /// Signals, as the page reads them.
    pub(super) bytes: Arc<[u8]>,
    /// Result of its replay, when finished.
    pub(super) replayed: Arc<OnceLock<Replayed>>,
}

/// Result of a replay.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Replayed {
    text: String,
    differences: Vec<Difference>,
}

/// First difference of a controller.
#[derive(Debug, Clone, Serialize)]
struct Difference {
    time_s: f64,
    text: String,
}

impl Recording {
    /// Reads a file, and replays its controllers in the background.
    ///
    /// # Errors
    /// [`ReplayError`] for a file that cannot be read, or that has no signals.
    pub fn open(path: &Path, kinds: ModuleKinds) -> Result<Self, ReplayError> {
        let file = File::open(path).map_err(|source| ReplayError::File { path: path.to_owned(), source })?;
        let bytes = encode(&replay::read_signals(file, path)?).into();
        let replayed = Arc::<OnceLock<Replayed>>::default();
        let (result, file) = (Arc::clone(&replayed), path.to_owned());
        thread::spawn(move || result.set(replay_file(&file, kinds)));
        Ok(Self { name: path.display().to_string(), bytes, replayed })
    }
}

fn replay_file(path: &Path, kinds: ModuleKinds) -> Replayed {
    let replay = match replay::replay(path, kinds, |_| ()) {
        Ok(replay) => replay,
        Err(error) => return Replayed { text: error.to_string(), differences: Vec::new() },
    };
    let (mut texts, mut differences) = (Vec::new(), Vec::new());
    for controller in replay.controllers {
        let name = controller.name;
        match controller.divergence {
            None => texts.push(format!("{name}: replay identical over {} ticks", controller.ticks)),
            Some(found) => {
                texts.push(format!("{name}: replay differs; first difference: {found}"));
                let module = found.module.map(|module| format!(" of {module}")).unwrap_or_default();
                let text = format!("{name}: {}[{}]{module} differs", found.signal, found.word);
                differences.push(Difference { time_s: found.time_s, text });
            }
        }
    }
    Replayed { text: texts.join("; "), differences }
}

#[derive(Serialize)]
struct Header<'a> {
    sources: Vec<SourceHeader<'a>>,
}

#[derive(Serialize)]
struct SourceHeader<'a> {
    name: &'a str,
    layout: LayoutHeader<'a>,
    period_s: f64,
    start_s: f64,
    rows: usize,
}

#[derive(Serialize)]
struct LayoutHeader<'a> {
    number: u32,
    every_ticks: u64,
    signals: &'a [RecordedSignal],
}

/// Encodes signals for the page: length of the header `u32`, header (JSON), 0 to 3 zero bytes; then for each source the ticks
/// `u32` and the columns `f32`. Little endian.
pub(super) fn encode(sources: &[RecordedSignals]) -> Vec<u8> {
    let headers = sources.iter().map(|source| SourceHeader {
        name: &source.name,
        layout: LayoutHeader { number: 0, every_ticks: source.every_ticks(), signals: &source.signals },
        period_s: source.tick_s(),
        start_s: source.times_s.first().copied().unwrap_or_default(),
        rows: source.ticks.len(),
    });
    // Finite numbers and texts are always representable in JSON.
    let json = serde_json::to_vec(&Header { sources: headers.collect() }).unwrap_or_default();
    let mut bytes = u32::try_from(json.len()).unwrap_or_default().to_le_bytes().to_vec();
    bytes.extend(json);
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    for source in sources {
        #[expect(clippy::cast_possible_truncation, reason = "tick numbers wrap, as on a device")]
        source.ticks.iter().for_each(|tick| bytes.extend((*tick as u32).to_le_bytes()));
        source.columns.iter().flatten().for_each(|value| bytes.extend(value.to_le_bytes()));
    }
    bytes
}

/// Reads an uploaded recording; returns it as [encoded](encode) signals.
pub(super) fn load(content: &[u8]) -> Result<Vec<u8>, String> {
    let mut file =
        tempfile::tempfile().map_err(|error| format!("cannot create a temporary file: {error}"))?;
    io::Write::write_all(&mut file, content)
        .and_then(|()| file.rewind())
        .map_err(|error| error.to_string())?;
    let path = PathBuf::from("the file");
    replay::read_signals(file, &path).map(|sources| encode(&sources)).map_err(|error| error.to_string())
}

/// Signals to write to a file.
#[derive(Debug, Deserialize)]
pub(super) struct Export {
    source: String,
    columns: Vec<ExportColumn>,
    /// Tick, time in `s`, and a value per column; null for NaN.
    rows: Vec<Vec<Option<f64>>>,
}

#[derive(Debug, Deserialize)]
struct ExportColumn {
    /// Name with indices: `POSITION[0]`.
    name: String,
    unit: String,
}

impl Export {
    /// Returns the MCAP file.
    pub(super) fn mcap(self) -> io::Result<Vec<u8>> {
        let columns: Vec<Column> = self.columns.into_iter().map(|column| column.of(&self.source)).collect();
        let width = 2 + columns.len();
        let values = self.rows.iter().filter(|row| row.len() == width).flatten();
        let rows = values.map(|value| value.unwrap_or(f64::NAN)).collect();
        let (sender, pieces) = sync_channel(2);
        // The queue has space for both.
        let _ = sender.send(RecordingChunk::Columns(columns));
        let _ = sender.send(RecordingChunk::Rows(rows));
        drop(sender);
        let mut file = tempfile::tempfile()?;
        write_mcap(&pieces, &file, &RunMetadata::default())?;
        file.rewind()?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes)?;
        Ok(bytes)
    }
}

impl ExportColumn {
    fn of(self, source: &str) -> Column {
        let (signal, rest) = self.name.split_once('[').unwrap_or((&self.name, ""));
        let indices = rest.split(['[', ']']).filter_map(|index| index.parse().ok()).collect();
        Column {
            source: source.to_owned(),
            signal: signal.to_owned(),
            indices,
            unit: self.unit,
            format: None,
        }
    }
}
