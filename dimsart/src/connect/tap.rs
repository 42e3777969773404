//! Telemetry of every tick, for scopes and recordings.

use std::io::{Read, Write};
use std::time::{Duration, Instant};

use dimsart_core::{Format, TypeRef};
use dimsart_link::protocol::{MAX_TELEMETRY_WORDS, Sample};
use serde::Serialize;

use super::description::WordText;
use super::signals::Followed;
use super::streams::{Streams, without_last_stream};
use super::{ConnectError, Device};
use hil_sim::clock;

/// Timeout of telemetry, after which the signals are subscribed again: the scheme changed, or the device restarted.
const SILENCE: Duration = Duration::from_millis(500);
/// Retry interval while other clients use all streams.
const ANOTHER_TRY: Duration = Duration::from_secs(2);
/// Well below the client timeout of the device.
const KEEP_ALIVE: Duration = Duration::from_secs(1);

/// A signal of a [`Subscription`].
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct SubscribedSignal {
    /// Name.
    pub name: String,
    /// Unit of its values; empty for a pure number.
    pub unit: String,
    /// Number of its values, consecutive in a row.
    pub words: usize,
    #[serde(skip)]
    format: Format,
    places: Vec<WordText>,
}

impl SubscribedSignal {
    #[cfg(all(test, feature = "zenoh"))]
    pub(crate) fn new(name: &str, unit: &str, words: usize, format: Format) -> Self {
        Self { name: name.to_owned(), unit: unit.to_owned(), words, format, places: Vec::new() }
    }

    /// Returns indices and unit of each word.
    pub(crate) fn places(&self) -> &[WordText] {
        &self.places
    }

    /// Returns the format of its words in the Data Base.
    #[must_use]
    pub fn format(&self) -> Format {
        self.format
    }
}

/// All signals in one tick.
#[derive(Debug, Clone, PartialEq)]
pub struct SubscriptionRow {
    /// Number of the tick; it wraps.
    pub tick: u32,
    /// Values of every signal; NaN for lost samples.
    pub values: Vec<f64>,
}

/// Subscription to signals every N ticks.
#[derive(Debug)]
pub struct Subscription {
    every_ticks: u32,
    /// Requested signals; all if empty.
    names: Vec<String>,
    signals: Vec<SubscribedSignal>,
    /// Names of the other signals in the Data Base.
    unsent: Vec<String>,
    streams: Option<Streams>,
    lost: u64,
    /// The row being received, and its number of received streams.
    row: Option<(SubscriptionRow, usize)>,
    /// Whether the signals were requested; the device may have refused.
    is_open: bool,
    /// Whether a complete row was received: before that, some streams have not started.
    has_begun: bool,
    asked: Instant,
    heard: Instant,
    /// Signals in the Data Base at the last request, and the event count then.
    entries: Vec<TypeRef>,
    events: u32,
}

impl Subscription {
    /// Samples every `every_ticks` ticks.
    #[must_use]
    pub fn new(every_ticks: u32) -> Self {
        let now = clock::now();
        Self {
            entries: Vec::new(),
            events: 0,
            every_ticks,
            names: Vec::new(),
            signals: Vec::new(),
            unsent: Vec::new(),
            streams: None,
            lost: 0,
            row: None,
            is_open: false,
            has_begun: false,
            asked: now,
            heard: now,
        }
    }

    /// Restricts the subscription to these signals, as `POSITION`: a board can send only a few. All if empty.
    #[must_use]
    pub fn with_signals(self, names: &[String]) -> Self {
        Self { names: names.to_vec(), ..self }
    }

    /// Subscribes to all signals from the next change of the Data Base on.
    pub(crate) fn widen(&mut self) {
        self.names.clear();
    }

    /// Returns the subscribed signals in the order of a row's values; empty while the device does not send them.
    #[must_use]
    pub fn signals(&self) -> &[SubscribedSignal] {
        &self.signals
    }

    /// Returns the names of the signals in the Data Base that are not sent.
    #[must_use]
    pub fn unsent_signals(&self) -> &[String] {
        &self.unsent
    }

    /// Returns the number of lost samples.
    #[must_use]
    pub fn lost_samples(&self) -> u64 {
        self.lost
    }

    fn put(&mut self, sample: &Sample, rows: &mut Vec<SubscriptionRow>) {
        let Some(streams) = &mut self.streams else { return };
        let Some(first) = streams.place(sample, &mut self.lost) else { return };
        let count = streams.len();
        self.heard = clock::now();
        if self.row.as_ref().is_some_and(|(row, _)| row.tick != sample.tick) {
            rows.extend(self.row.take().map(|(row, _)| row).filter(|_| self.has_begun));
        }
        let width = self.signals.iter().map(|signal| signal.words).sum();
        let (row, streams) = self
            .row
            .get_or_insert_with(|| (SubscriptionRow { tick: sample.tick, values: vec![f64::NAN; width] }, 0));
        let formats = self.signals.iter().flat_map(|signal| std::iter::repeat_n(signal.format, signal.words));
        for ((value, format), word) in row.values.iter_mut().zip(formats).skip(first).zip(&sample.words) {
            *value = value_of(*word, format);
        }
        *streams += 1;
        if *streams == count {
            self.has_begun = true;
            rows.extend(self.row.take().map(|(row, _)| row));
        }
    }
}

/// Converts a word to a number, exactly for every format.
pub(crate) fn value_of(word: u32, format: Format) -> f64 {
    match format {
        Format::F32 => f32::from_bits(word).into(),
        Format::I32 => word.cast_signed().into(),
        Format::U32 => word.into(),
        Format::Bool => f64::from(u8::from(word != 0)),
    }
}

impl<S: Read + Write> Device<S> {
    /// Receives for some time and returns the received rows. If the device has too few streams for all signals, only the
    /// first signals are subscribed.
    ///
    /// # Errors
    /// [`ConnectError`] when the line is closed.
    pub fn receive_rows(
        &mut self,
        tap: &mut Subscription,
        time: Duration,
    ) -> Result<Vec<SubscriptionRow>, ConnectError> {
        // After an event the scheme may have additional signals.
        let events = self.line().unsolicited().heartbeat().map_or(0, |heartbeat| heartbeat.events);
        let is_other = events != tap.events && {
            tap.events = events;
            self.entries()? != tap.entries
        };
        let patience = if tap.streams.is_some() { SILENCE } else { ANOTHER_TRY };
        let is_silent = clock::elapsed_since(tap.heard) > patience;
        if is_other || is_silent || !tap.is_open {
            self.open_telemetry(tap)?;
        } else if clock::elapsed_since(tap.asked) > KEEP_ALIVE {
            tap.asked = clock::now();
            self.lease_status()?;
        }
        self.listen(time)?;
        let mut rows = Vec::new();
        let samples: Vec<Sample> = self.line_mut().unsolicited_mut().samples().collect();
        samples.iter().for_each(|sample| tap.put(sample, &mut rows));
        Ok(rows)
    }

    /// Ends the subscription and frees its streams for other clients.
    ///
    /// # Errors
    /// [`ConnectError`] when the device does not answer.
    pub fn close_telemetry(&mut self, tap: &mut Subscription) -> Result<(), ConnectError> {
        match (tap.streams.take(), tap.entries.first()) {
            (Some(streams), Some(signal)) => self.unsubscribe(&streams, *signal),
            _ => Ok(()),
        }
    }

    /// Subscribes again; [`Subscription::signals`] returns the signals that the device sends.
    pub(crate) fn open_telemetry(&mut self, tap: &mut Subscription) -> Result<(), ConnectError> {
        tap.is_open = true;
        tap.entries = self.entries()?;
        let mut signals = self.followed(&tap.names)?;
        signals.retain(|Followed { format, report, .. }| {
            format.is_some() && report.values.len() <= MAX_TELEMETRY_WORDS
        });
        let mut wanted: Vec<(TypeRef, usize)> =
            signals.iter().map(|Followed { signal, report, .. }| (*signal, report.values.len())).collect();
        (tap.streams, tap.row, tap.has_begun) = (None, None, false);
        while tap.streams.is_none() && !wanted.is_empty() {
            tap.streams = self.subscribe(&wanted, tap.every_ticks)?;
            if tap.streams.is_none() {
                without_last_stream(&mut wanted);
            }
        }
        let signals = signals.into_iter().take(wanted.len()).filter_map(
            |Followed { format, report, words: places, .. }| {
                let words = report.values.len();
                Some(SubscribedSignal {
                    name: report.name,
                    unit: report.unit,
                    words,
                    format: format?,
                    places,
                })
            },
        );
        tap.signals = signals.collect();
        let is_unsent = |signal: &&TypeRef| !wanted.iter().any(|(sent, _)| sent == *signal);
        let unsent = tap.entries.iter().filter(is_unsent).map(|signal| self.signal_name(*signal));
        tap.unsent = unsent.collect::<Result<_, _>>()?;
        (tap.asked, tap.heard) = (clock::now(), clock::now());
        Ok(())
    }
}
