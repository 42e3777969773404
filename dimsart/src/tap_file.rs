//! Writes streamed rows of a controller to a file, with its scheme: `dimsart record`, and recordings of the page.

use std::io::{Read, Write};
use std::path::Path;
use std::sync::mpsc::SyncSender;

use crate::connect::{ConnectError, Device, Identity, SubscribedSignal, SubscriptionRow, WordText};
use crate::report::{
    ControllerMetadata, ReportError, RunMetadata, SignalsFile, SignalsFormat, SignalsKind, TimeBase,
};
use hil_sim::bus::time::tick_time_s;
use hil_sim::recording::{Column, RecordingChunk};

/// End of a recording: the signals changed.
pub(crate) const OTHER_SIGNALS: &str =
    "the signals of the scheme changed: recording ended, start another recording";

/// End of a recording: the tick counter restarted.
pub(crate) const BEGUN_ANEW: &str = "the device restarted: recording ended, start another recording";

/// A file for the rows of one set of signals.
#[derive(Debug)]
pub(crate) struct TapFile {
    file: SignalsFile,
    pieces: SyncSender<RecordingChunk>,
    /// Name of the controller.
    source: String,
    period_s: f64,
    signals: Vec<SubscribedSignal>,
    rows: u64,
    every_ticks: u32,
    /// Unwrapped.
    last_tick: Option<u64>,
    /// Number of missing rows.
    missing: u64,
}

/// State of the file after rows were added.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Next {
    GoesOn,
    /// The signals changed or the device restarted: the rows were not added. With the reason.
    Ends(&'static str),
    /// Writing failed: [`TapFile::finish`] returns the error.
    WriteFailed,
}

/// Returns the format of a file for rows from a port, with the current identity and scheme of the controller.
///
/// # Errors
/// [`ConnectError`] if the scheme cannot be read.
pub(crate) fn format(
    device: &mut Device<impl Read + Write>,
    port: &str,
    every_ticks: u32,
    kind: SignalsKind,
) -> Result<SignalsFormat, ConnectError> {
    Ok(match kind {
        SignalsKind::Csv => SignalsFormat::Csv,
        SignalsKind::Mcap => {
            let Identity { device: name, image, protocol_version, sample_period_s, .. } =
                device.identity().clone();
            let settings_toml = format!(
                "# Source of the recording, not a scenario.\nport = {port:?}\ndevice = {name:?}\nimage = {image:?}\n\
                 protocol = {protocol_version}\nsample_period_s = {sample_period_s}\nevery_ticks = {every_ticks}\n"
            );
            let scheme = device.scheme_rows(None)?;
            let controllers = vec![ControllerMetadata { name, scheme, device_json: None }];
            SignalsFormat::Mcap(RunMetadata { settings_toml, controllers, time_base: TimeBase::RealTime })
        }
    })
}

impl TapFile {
    /// Creates the file in `folder`, created if missing, with a row every `every_ticks` ticks.
    ///
    /// # Errors
    /// As [`SignalsFile::create`].
    pub(crate) fn create(
        folder: &Path,
        identity: &Identity,
        every_ticks: u32,
        format: SignalsFormat,
    ) -> Result<Self, ReportError> {
        let (file, pieces) = SignalsFile::create(folder, &[], format)?;
        // The decimal value, 0.001, not the nearest `f32`.
        let period_s = identity.sample_period_s.to_string().parse().unwrap_or(f64::NAN);
        let source = identity.device.clone();
        Ok(Self {
            file,
            pieces,
            source,
            period_s,
            signals: Vec::new(),
            rows: 0,
            every_ticks,
            last_tick: None,
            missing: 0,
        })
    }

    pub(crate) fn path(&self) -> &Path {
        self.file.path()
    }

    /// Number of rows.
    pub(crate) fn rows(&self) -> u64 {
        self.rows
    }

    /// Adds rows; their signals must equal the first rows' signals. Blocks while the disk is slow.
    pub(crate) fn add(&mut self, signals: &[SubscribedSignal], rows: &[SubscriptionRow]) -> Next {
        if self.signals.is_empty() {
            signals.clone_into(&mut self.signals);
            // An error is returned by `finish`.
            let _ = self.pieces.send(RecordingChunk::Columns(columns_of(&self.source, signals)));
        } else if self.signals != signals {
            return Next::Ends(OTHER_SIGNALS);
        }
        let mut values = Vec::new();
        for row in rows {
            let tick = match self.last_tick {
                None => u64::from(row.tick),
                Some(last) => {
                    #[expect(clippy::cast_possible_truncation, reason = "as the device counts")]
                    let gap = row.tick.wrapping_sub(last as u32);
                    if gap == 0 || gap.cast_signed() < 0 {
                        return Next::Ends(BEGUN_ANEW);
                    }
                    self.missing += u64::from((gap / self.every_ticks.max(1)).saturating_sub(1));
                    last + u64::from(gap)
                }
            };
            self.last_tick = Some(tick);
            #[expect(clippy::cast_precision_loss, reason = "exact for 285 000 years of ticks")]
            values.extend([tick as f64, tick_time_s(tick, self.period_s)]);
            values.extend(&row.values);
        }
        if self.pieces.send(RecordingChunk::Rows(values)).is_err() {
            return Next::WriteFailed;
        }
        self.rows += rows.len() as u64;
        Next::GoesOn
    }

    /// Waits until all rows are written. Returns a summary with lost samples and the reason of the end.
    ///
    /// # Errors
    /// As [`SignalsFile::finish`].
    pub(crate) fn finish(self, lost: u64, why: &str) -> Result<String, ReportError> {
        let Self { file, pieces, signals, rows, missing, .. } = self;
        drop(pieces);
        let path = file.finish()?;
        let missing = if missing > 0 { format!(", {missing} rows missing") } else { String::new() };
        let why = if why.is_empty() { String::new() } else { format!("; {why}") };
        let (path, count) = (path.display(), signals.len());
        Ok(format!("{path}: {rows} rows of {count} signals, {lost} samples lost{missing}{why}"))
    }
}

fn columns_of(source: &str, signals: &[SubscribedSignal]) -> Vec<Column> {
    let of_signal = |signal: &SubscribedSignal| {
        let column = |place: &WordText| Column {
            source: source.to_owned(),
            signal: signal.name.clone(),
            indices: place.indices.clone(),
            unit: place.unit.clone(),
            format: Some(signal.format()),
        };
        signal.places().iter().map(column).collect::<Vec<_>>()
    };
    signals.iter().flat_map(of_signal).collect()
}
