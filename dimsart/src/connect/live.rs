//! Signals read repeatedly: by telemetry if the device supports it, otherwise by polling.

use std::io::{Read, Write};
use std::time::{Duration, Instant};

use dimsart_link::protocol::Sample;

use super::description::DisplayValue;
use super::signals::{Followed, SignalReport};
use super::streams::Streams;
use super::{ConnectError, Device};
use hil_sim::clock;

/// Well below the client timeout of the device.
const KEEP_ALIVE: Duration = Duration::from_secs(1);

/// Signals that are read repeatedly.
#[derive(Debug)]
pub struct SignalPoll {
    /// If empty, all signals in the Data Base.
    names: Vec<String>,
    period: Duration,
    signals: Vec<Followed>,
    /// `None` where the device does not send them.
    streams: Option<Streams>,
    /// Lost samples.
    lost: u64,
    /// Time of the last request.
    asked: Instant,
    /// Time of the last new value.
    changed: Instant,
}

impl SignalPoll {
    /// Selects signals by name; all in the Data Base if `names` is empty.
    #[must_use]
    pub fn new(names: &[String], period: Duration) -> Self {
        let now = clock::now();
        let (names, signals) = (names.to_vec(), Vec::new());
        Self { names, period, signals, streams: None, lost: 0, asked: now, changed: now }
    }

    /// Returns whether the device sends the signals by telemetry.
    #[must_use]
    pub fn uses_telemetry(&self) -> bool {
        self.streams.is_some()
    }

    /// Returns whether the device has stopped sending: the signals changed, or the device was restarted.
    fn is_stale(&self) -> bool {
        clock::elapsed_since(self.changed) > KEEP_ALIVE.max(3 * self.period)
    }

    fn put(&mut self, sample: &Sample) {
        let Some(first) = self.streams.as_mut().and_then(|streams| streams.place(sample, &mut self.lost))
        else {
            return;
        };
        let here =
            self.signals.iter_mut().filter_map(|followed| Some((followed.format?, &mut followed.report)));
        let values =
            here.flat_map(|(format, report)| report.values.iter_mut().map(move |value| (format, value)));
        for ((format, value), word) in values.skip(first).zip(&sample.words) {
            *value = DisplayValue::of_word(*word, format);
        }
        self.changed = clock::now();
    }
}

impl<S: Read + Write> Device<S> {
    /// Returns the signals, at most one period old.
    ///
    /// # Errors
    /// [`ConnectError::InvalidWord`] for an unknown name.
    pub fn read_signals(&mut self, live: &mut SignalPoll) -> Result<Vec<SignalReport>, ConnectError> {
        self.line_mut().unsolicited_mut().samples().for_each(|sample| live.put(&sample));
        if !live.uses_telemetry() || live.is_stale() {
            live.signals = self.followed(&live.names)?;
            live.streams = self.follow(live)?;
            (live.asked, live.changed) = (clock::now(), clock::now());
        } else if clock::elapsed_since(live.asked) > KEEP_ALIVE {
            live.asked = clock::now();
            self.lease_status()?;
        }
        Ok(live.signals.iter().map(|followed| followed.report.clone()).collect())
    }

    /// Subscribes to the signals; `None` when there are too many, or the device has no free stream.
    fn follow(&mut self, live: &SignalPoll) -> Result<Option<Streams>, ConnectError> {
        let here = live.signals.iter().filter(|followed| followed.format.is_some());
        let signals: Vec<_> = here.map(|followed| (followed.signal, followed.report.values.len())).collect();
        let ticks = live.period.as_secs_f64() / f64::from(self.identity().sample_period_s);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
        let every_ticks = ticks.round().clamp(1.0, f64::from(u32::MAX)) as u32;
        self.subscribe(&signals, every_ticks)
    }
}
