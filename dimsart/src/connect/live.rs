//! Signals again and again: pushed by the device where it can, asked for where it cannot.

use std::io::{Read, Write};
use std::time::{Duration, Instant};

use dimsart_link::protocol::Sample;

use super::description::ValueText;
use super::signals::{Followed, SignalReport};
use super::streams::Streams;
use super::{ConnectError, Device};
use hil_sim::clock;

/// Well before the device takes the client for gone.
const KEEP_ALIVE: Duration = Duration::from_secs(1);

/// Signals that are looked at again and again.
#[derive(Debug)]
pub struct Live {
    /// None named: all that are in the Data Base.
    names: Vec<String>,
    period: Duration,
    signals: Vec<Followed>,
    /// None where the device does not send them.
    streams: Option<Streams>,
    /// Samples that the line had no room for.
    lost: u64,
    /// Last time that this client asked for something.
    asked: Instant,
    /// Last time that there was something new.
    changed: Instant,
}

impl Live {
    /// Signals by name, all of the Data Base when none is named.
    #[must_use]
    pub fn new(names: &[String], period: Duration) -> Self {
        let now = clock::now();
        let (names, signals) = (names.to_vec(), Vec::new());
        Self { names, period, signals, streams: None, lost: 0, asked: now, changed: now }
    }

    /// Whether the device sends the signals by itself.
    #[must_use]
    pub fn is_pushed(&self) -> bool {
        self.streams.is_some()
    }

    /// The device has stopped sending: the scheme has other signals, or it was restarted.
    fn is_stale(&self) -> bool {
        clock::since(self.changed) > KEEP_ALIVE.max(3 * self.period)
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
            *value = ValueText::of_word(*word, format);
        }
        self.changed = clock::now();
    }
}

impl<S: Read + Write> Device<S> {
    /// The signals as they are now, or were a period ago.
    ///
    /// # Errors
    /// [`ConnectError::Word`] for a name that no data type has.
    pub fn look(&mut self, live: &mut Live) -> Result<Vec<SignalReport>, ConnectError> {
        self.line_mut().unsolicited_mut().samples().for_each(|sample| live.put(&sample));
        if !live.is_pushed() || live.is_stale() {
            live.signals = self.followed(&live.names)?;
            live.streams = self.follow(live)?;
            (live.asked, live.changed) = (clock::now(), clock::now());
        } else if clock::since(live.asked) > KEEP_ALIVE {
            live.asked = clock::now();
            self.lease_status()?;
        }
        Ok(live.signals.iter().map(|followed| followed.report.clone()).collect())
    }

    /// Has the signals sent; none when the device does not, because they are too many or it has no stream left.
    fn follow(&mut self, live: &Live) -> Result<Option<Streams>, ConnectError> {
        let here = live.signals.iter().filter(|followed| followed.format.is_some());
        let signals: Vec<_> = here.map(|followed| (followed.signal, followed.report.values.len())).collect();
        let ticks = live.period.as_secs_f64() / f64::from(self.identity().sample_period_s);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "held to what fits")]
        let every_ticks = ticks.round().clamp(1.0, f64::from(u32::MAX)) as u32;
        self.subscribe(&signals, every_ticks)
    }
}
