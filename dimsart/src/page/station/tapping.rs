//! Receives signals by telemetry: as many as the line carries, or the selected ones.

use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::thread;
use std::time::Duration;

use serde_json::Value;
use tokio::sync::oneshot;

use super::super::news::{Board, Rows};
use super::{Answer, Greet, PAUSE, Waiting};
use crate::connect::{ConnectError, SubscribedSignal, Subscription};
use crate::page::page_device::PageDevice;
use crate::tap_file::OTHER_SIGNALS;
use dimsart_link::protocol::{MAX_TELEMETRY_SIGNALS, MAX_TELEMETRY_WORDS};

/// Publication interval of rows: about one screen frame.
const PICTURE: Duration = Duration::from_millis(20);
/// Polling interval for subscribers.
const LOOK: Duration = Duration::from_millis(100);
/// Share of the line for rows; the rest is for requests, answers and heartbeats.
const SHARE: f64 = 0.2;
/// Overhead of a sample: envelope, numbers, framing.
const SAMPLE_BYTES: f64 = 16.0;
const BITS_PER_BYTE: f64 = 10.0;

/// Selection of signals by a client.
#[derive(Debug)]
pub(super) struct Choice {
    /// Signal names; if empty, all signals or as many as can be sent.
    pub(super) names: Vec<String>,
    pub(super) answer: oneshot::Sender<Answer>,
    pub(super) _place: Waiting,
}

/// The thread.
pub(super) struct Tapping {
    news: Arc<Board>,
    baud: Option<u32>,
    choices: Receiver<Choice>,
    /// Last selection.
    names: Vec<String>,
    /// Layout number.
    number: u32,
    /// Rows and lost samples of earlier subscriptions.
    rows: u64,
    lost: u64,
}

impl Tapping {
    pub(super) fn new(news: Arc<Board>, baud: Option<u32>, choices: Receiver<Choice>) -> Self {
        Self { news, baud, choices, names: Vec::new(), number: 0, rows: 0, lost: 0 }
    }

    /// Runs the thread. Without subscribers no telemetry is requested: other clients may need the streams.
    pub(super) fn run(mut self, greet: &Greet) {
        loop {
            if self.news.is_heard()
                && let Err(error) = greet().and_then(|mut device| self.listen(&mut device))
            {
                // A closed line is opened again.
                self.news.cut(&format!("connection to the device closed: {error}"));
                for Choice { answer, .. } in self.choices.try_iter() {
                    let _ = answer.send(Err(error.to_string()));
                }
                if let ConnectError::InvalidWord(_) = error {
                    // The selection is invalid for another image.
                    self.names.clear();
                }
            }
            thread::sleep(if self.news.is_heard() { PAUSE } else { LOOK });
        }
    }

    /// Receives while there are subscribers.
    fn listen(&mut self, device: &mut PageDevice) -> Result<(), ConnectError> {
        let every_ticks = every_ticks(self.baud, device.identity().sample_period_s.into());
        let mut tap = Subscription::new(every_ticks).with_signals(&self.names);
        let mut told: (Arc<[SubscribedSignal]>, Vec<String>) = (Arc::from([]), Vec::new());
        while self.news.is_heard() {
            if let Ok(Choice { names, answer, .. }) = self.choices.try_recv() {
                let done = self.choose(device, &mut tap, every_ticks, names)?;
                // The client may have disconnected.
                let _ = answer.send(done.map(Value::String));
            }
            let rows = device.receive_rows(&mut tap, PICTURE)?;
            let is_other = *told.0 != *tap.signals();
            if is_other {
                self.news.cut(OTHER_SIGNALS);
                self.number += 1;
            }
            if is_other || told.1 != tap.unsent_signals() {
                told = (tap.signals().into(), tap.unsent_signals().to_vec());
                self.news.layout(self.number, every_ticks, &told.0, &told.1);
            }
            let (station, layout, signals) = (self.news.station(), self.number, Arc::clone(&told.0));
            let (first, lost) = (self.rows, self.lost + tap.lost_samples());
            self.rows += rows.len() as u64;
            self.news.rows(Rows { station, layout, signals, first, lost, rows });
        }
        self.lost += tap.lost_samples();
        device.close_telemetry(&mut tap)
    }

    /// Selects other signals, or returns why it cannot: then the previous ones continue.
    fn choose(
        &mut self,
        device: &mut PageDevice,
        tap: &mut Subscription,
        every_ticks: u32,
        names: Vec<String>,
    ) -> Result<Result<String, String>, ConnectError> {
        match device.require_signals(&names) {
            Err(ConnectError::InvalidWord(reason)) => return Ok(Err(reason)),
            known => known?,
        }
        device.close_telemetry(tap)?;
        self.lost += tap.lost_samples();
        *tap = Subscription::new(every_ticks).with_signals(&names);
        // Other clients may use the streams, so only an attempt shows whether the device can send the signals.
        device.open_telemetry(tap)?;
        if tap.signals().len() < names.len() {
            *tap = Subscription::new(every_ticks).with_signals(&self.names);
            return Ok(Err(format!(
                "the device cannot send {} together: a board sends at most {MAX_TELEMETRY_SIGNALS} signals with \
                 {MAX_TELEMETRY_WORDS} words, and only to one client; remove a signal first",
                names.join(", ")
            )));
        }
        self.names = names;
        // A selection of all signals includes later ones.
        if tap.unsent_signals().is_empty() {
            self.names.clear();
            tap.widen();
        }
        let sent: Vec<&str> = tap.signals().iter().map(|signal| signal.name.as_str()).collect();
        Ok(Ok(format!("the device sends {}", sent.join(", "))))
    }
}

/// Returns the ticks per row for one full stream at this baud rate.
pub(super) fn every_ticks(baud: Option<u32>, sample_period_s: f64) -> u32 {
    let Some(baud) = baud else { return 1 };
    let words = u32::try_from(MAX_TELEMETRY_WORDS).unwrap_or(u32::MAX);
    let row_s = BITS_PER_BYTE * (4.0 * f64::from(words) + SAMPLE_BYTES) / (SHARE * f64::from(baud));
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a cast saturates")]
    let ticks = (row_s / sample_period_s).ceil().max(1.0) as u32;
    ticks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_take_a_fifth_of_a_line_and_every_tick_where_there_is_none() {
        let cases =
            [(None, 1e-3, 1), (Some(921_600), 1e-3, 4), (Some(115_200), 1e-3, 28), (Some(115_200), 1e-2, 3)];
        for (baud, period_s, expected) in cases {
            assert_eq!(every_ticks(baud, period_s), expected, "{baud:?} {period_s}");
        }
    }
}
