//! News of a station for all browsers; a new browser receives the latest of each kind.

use std::sync::{Arc, Mutex, PoisonError};

use serde::Serialize;
use tokio::sync::broadcast::{Receiver, Sender};

use crate::connect::{SubscribedSignal, SubscriptionRow};

/// Queue length for a slow browser, which receives the number of missed news.
const ROOM: usize = 1024;

/// A piece of news.
#[derive(Debug, Clone)]
pub(crate) enum News {
    /// JSON.
    Text(Arc<str>),
    /// Rows of signals.
    Rows(Arc<Rows>),
    /// The following rows do not continue the previous ones; with the reason.
    Discontinuity(Arc<str>),
}

/// Consecutive rows of signals.
#[derive(Debug)]
pub(crate) struct Rows {
    /// Number of the station.
    pub(crate) station: u8,
    /// Layout number of [`Board::layout`].
    pub(crate) layout: u32,
    /// Signals of a row.
    pub(crate) signals: Arc<[SubscribedSignal]>,
    /// Number of the first row among all rows of the station, to count missed rows.
    pub(crate) first: u64,
    /// Total number of lost samples of the station.
    pub(crate) lost: u64,
    /// Rows, at least one.
    pub(crate) rows: Vec<SubscriptionRow>,
}

impl Rows {
    /// Encodes rows for the page: station `u8`, 0 `u8`, values per row `u16`, layout number `u32`; then for each row tick
    /// `u32` and values `f32`. Little endian. `None` for too many values.
    pub(super) fn bytes(&self) -> Option<Vec<u8>> {
        let width = u16::try_from(self.rows.first()?.values.len()).ok()?;
        let mut bytes = vec![self.station, 0];
        bytes.extend(width.to_le_bytes());
        bytes.extend(self.layout.to_le_bytes());
        for row in &self.rows {
            bytes.extend(row.tick.to_le_bytes());
            #[expect(clippy::cast_possible_truncation, reason = "to be drawn")]
            row.values.iter().for_each(|value| bytes.extend((*value as f32).to_le_bytes()));
        }
        Some(bytes)
    }
}

/// Publishes news.
#[derive(Debug)]
pub(crate) struct Board {
    /// Number of the station.
    station: u8,
    sender: Sender<News>,
    /// Latest news by kind.
    last: Mutex<Vec<(&'static str, Arc<str>)>>,
}

#[derive(Serialize)]
struct Message<'a, T> {
    kind: &'static str,
    station: u8,
    content: &'a T,
}

fn texts(last: &[(&'static str, Arc<str>)]) -> Vec<Arc<str>> {
    last.iter().map(|(_, text)| Arc::clone(text)).collect()
}

impl Board {
    pub(super) fn new(station: u8) -> Self {
        Self { station, sender: Sender::new(ROOM), last: Mutex::default() }
    }

    /// Subscribes to news, and returns the latest of each kind.
    pub(crate) fn read(&self) -> (Vec<Arc<str>>, Receiver<News>) {
        let last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        (texts(&last), self.sender.subscribe())
    }

    /// Returns the latest news of each kind.
    pub(crate) fn last(&self) -> Vec<Arc<str>> {
        texts(&self.last.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Publishes an event, which later subscribers do not receive.
    pub(super) fn tell_once(&self, kind: &'static str, content: &impl Serialize) {
        if let Some(text) = self.text(kind, content) {
            let _ = self.sender.send(News::Text(text));
        }
    }

    /// Returns whether there is a subscriber.
    pub(super) fn is_heard(&self) -> bool {
        self.sender.receiver_count() > 0
    }

    fn text(&self, kind: &'static str, content: &impl Serialize) -> Option<Arc<str>> {
        // Reports are always representable in JSON.
        let message = Message { kind, station: self.station, content };
        serde_json::to_string(&message).ok().map(Into::into)
    }

    /// Publishes news if it differs from the latest of its kind.
    pub(super) fn tell(&self, kind: &'static str, content: &impl Serialize) {
        let Some(text) = self.text(kind, content) else { return };
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        match last.iter_mut().find(|(known, _)| *known == kind) {
            Some((_, known)) if *known == text => return,
            Some((_, known)) => *known = Arc::clone(&text),
            None => last.push((kind, Arc::clone(&text))),
        }
        // There may be no subscriber.
        let _ = self.sender.send(News::Text(text));
    }

    /// Publishes the layout of the following rows, and the names of the signals that are not sent.
    pub(super) fn layout(
        &self,
        number: u32,
        every_ticks: u32,
        signals: &[SubscribedSignal],
        unsent: &[String],
    ) {
        #[derive(Serialize)]
        struct Layout<'a> {
            number: u32,
            every_ticks: u32,
            signals: &'a [SubscribedSignal],
            unsent: &'a [String],
        }
        self.tell("layout", &Layout { number, every_ticks, signals, unsent });
    }

    /// Publishes rows, if any.
    pub(super) fn rows(&self, rows: Rows) {
        if !rows.rows.is_empty() {
            // There may be no subscriber.
            let _ = self.sender.send(News::Rows(rows.into()));
        }
    }

    /// Returns the number of the station.
    pub(super) fn station(&self) -> u8 {
        self.station
    }

    /// Publishes a break between rows and its reason.
    pub(super) fn cut(&self, why: &str) {
        let _ = self.sender.send(News::Discontinuity(why.into()));
    }
}
