//! Signals again and again: pushed by the device where it can, asked for where it cannot.

use std::io::{Read, Write};
use std::time::{Duration, Instant};

use dimsart_core::protocol::{MAX_TELEMETRY_SIGNALS, Request, Response, Sample};
use dimsart_core::{Format, TypeRef};

use super::description::ValueText;
use super::{ConnectError, Device, SignalReport};

/// Well before the device takes the client for gone.
const KEEP_ALIVE: Duration = Duration::from_secs(1);

/// Signals that are looked at again and again.
#[derive(Debug)]
pub struct Live {
    /// None named: all that are in the Data Base.
    names: Vec<String>,
    period: Duration,
    signals: Vec<Followed>,
    is_pushed: bool,
    /// Last time that this client asked for something.
    asked: Instant,
    /// Last time that there was something new.
    changed: Instant,
}

#[derive(Debug)]
pub(super) struct Followed {
    pub(super) signal: TypeRef,
    /// None while it is not in the Data Base.
    pub(super) format: Option<Format>,
    pub(super) report: SignalReport,
}

impl Live {
    /// Signals by name, all of the Data Base when none is named.
    #[must_use]
    pub fn new(names: &[String], period: Duration) -> Self {
        let now = Instant::now();
        let (names, signals) = (names.to_vec(), Vec::new());
        Self { names, period, signals, is_pushed: false, asked: now, changed: now }
    }

    /// Whether the device sends the signals by itself.
    #[must_use]
    pub fn is_pushed(&self) -> bool {
        self.is_pushed
    }

    /// The device has stopped sending: the scheme has other signals, or it was restarted.
    fn is_stale(&self) -> bool {
        self.changed.elapsed() > KEEP_ALIVE.max(3 * self.period)
    }

    fn put(&mut self, sample: &Sample) {
        let mut words = sample.words.iter();
        for Followed { format, report, .. } in &mut self.signals {
            let Some(format) = *format else { continue };
            for value in &mut report.values {
                if let Some(word) = words.next() {
                    *value = ValueText::of_word(*word, format);
                }
            }
        }
    }
}

impl<S: Read + Write> Device<S> {
    /// The signals as they are now, or were a period ago.
    ///
    /// # Errors
    /// [`ConnectError::Word`] for a name that no data type has.
    pub fn look(&mut self, live: &mut Live) -> Result<Vec<SignalReport>, ConnectError> {
        if let Some(sample) = self.line_mut().unsolicited_mut().sample() {
            live.put(&sample);
            live.changed = Instant::now();
        }
        if !live.is_pushed || live.is_stale() {
            live.signals = self.followed(&live.names)?;
            live.is_pushed = self.follow(live)?;
            (live.asked, live.changed) = (Instant::now(), Instant::now());
        } else if live.asked.elapsed() > KEEP_ALIVE {
            live.asked = Instant::now();
            self.lease_status()?;
        }
        Ok(live.signals.iter().map(|followed| followed.report.clone()).collect())
    }

    /// Has the signals sent; false when the device does not, because they are too many or somebody else has them.
    fn follow(&mut self, live: &Live) -> Result<bool, ConnectError> {
        self.line_mut().unsolicited_mut().telemetry = None;
        let here: Vec<_> = live.signals.iter().filter(|followed| followed.format.is_some()).collect();
        if here.is_empty() || here.len() > MAX_TELEMETRY_SIGNALS {
            return Ok(false);
        }
        let ticks = live.period.as_secs_f64() / f64::from(self.identity().sample_period_s);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "held to what fits")]
        let every_ticks = ticks.round().clamp(1.0, f64::from(u32::MAX)) as u32;
        let take = |response: Response<'_>| match response {
            Response::Telemetry { .. } => Some(()),
            _ => None,
        };
        for (place, followed) in (0..).zip(here) {
            let request = Request::Telemetry { place, signal: followed.signal, every_ticks };
            match self.ask(&request, take) {
                Ok(Some(())) => {}
                Ok(None) | Err(ConnectError::Refused(_)) => {
                    return self.unfollow(followed.signal).map(|()| false);
                }
                Err(error) => return Err(error),
            }
        }
        let line = self.line_mut();
        line.unsolicited_mut().telemetry = Some(line.last_id());
        Ok(true)
    }

    /// Ends what was begun; refused where it is another client's.
    fn unfollow(&mut self, signal: TypeRef) -> Result<(), ConnectError> {
        let request = Request::Telemetry { place: 0, signal, every_ticks: 0 };
        match self.ask(&request, |_| Some(())) {
            Ok(_) | Err(ConnectError::Refused(_)) => Ok(()),
            Err(error) => Err(error),
        }
    }
}
