//! What a station tells every browser, and the last of it for one that comes later.

use std::sync::{Arc, Mutex, PoisonError};

use serde::Serialize;
use tokio::sync::broadcast::{Receiver, Sender};

use crate::connect::{TapRow, TapSignal};

/// Pieces that wait for a browser that is slow; it is told how many it has missed.
const ROOM: usize = 1024;

/// A piece of news.
#[derive(Debug, Clone)]
pub(crate) enum News {
    /// JSON.
    Text(Arc<str>),
    /// Signals, tick by tick.
    Rows(Arc<Rows>),
    /// The rows that come do not go on from those that came, and why.
    Cut(Arc<str>),
}

/// Rows of signals, one after the other.
#[derive(Debug)]
pub(crate) struct Rows {
    /// Number of the station.
    pub(crate) station: u8,
    /// Number of the layout, as [`Board::layout`] told it.
    pub(crate) layout: u32,
    /// What a row's values are of.
    pub(crate) signals: Arc<[TapSignal]>,
    /// Number of the first of these rows, among all of the station: who misses some knows how many.
    pub(crate) first: u64,
    /// Samples of the station until now that the line had no room for.
    pub(crate) lost: u64,
    /// At least one.
    pub(crate) rows: Vec<TapRow>,
}

impl Rows {
    /// As the page reads them: station `u8`, 0 `u8`, values of a row `u16`, number of the layout `u32`; then each row, its
    /// tick `u32` and its values `f32`. Little endian. None for more values than that.
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

/// Where news are put up.
#[derive(Debug)]
pub(crate) struct Board {
    /// Number of the station.
    station: u8,
    sender: Sender<News>,
    /// By kind.
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

    /// All that is told from now on, and the last of every kind until now.
    pub(crate) fn read(&self) -> (Vec<Arc<str>>, Receiver<News>) {
        let last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        (texts(&last), self.sender.subscribe())
    }

    /// The last of every kind until now, for who has missed something.
    pub(crate) fn last(&self) -> Vec<Arc<str>> {
        texts(&self.last.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Tells something that has just happened: who comes later is not told.
    pub(super) fn tell_once(&self, kind: &'static str, content: &impl Serialize) {
        if let Some(text) = self.text(kind, content) {
            let _ = self.sender.send(News::Text(text));
        }
    }

    /// Whether anybody hears it.
    pub(super) fn is_heard(&self) -> bool {
        self.sender.receiver_count() > 0
    }

    fn text(&self, kind: &'static str, content: &impl Serialize) -> Option<Arc<str>> {
        // The reports are made of what JSON has.
        let message = Message { kind, station: self.station, content };
        serde_json::to_string(&message).ok().map(Into::into)
    }

    /// Tells something, unless it is what was told last of its kind.
    pub(super) fn tell(&self, kind: &'static str, content: &impl Serialize) {
        let Some(text) = self.text(kind, content) else { return };
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        match last.iter_mut().find(|(known, _)| *known == kind) {
            Some((_, known)) if *known == text => return,
            Some((_, known)) => *known = Arc::clone(&text),
            None => last.push((kind, Arc::clone(&text))),
        }
        // Nobody may be there.
        let _ = self.sender.send(News::Text(text));
    }

    /// Tells what rows are made of from now on, and the names of the signals that are not in them.
    pub(super) fn layout(&self, number: u32, every_ticks: u32, signals: &[TapSignal], unsent: &[String]) {
        #[derive(Serialize)]
        struct Layout<'a> {
            number: u32,
            every_ticks: u32,
            signals: &'a [TapSignal],
            unsent: &'a [String],
        }
        self.tell("layout", &Layout { number, every_ticks, signals, unsent });
    }

    /// Tells rows, if there are any.
    pub(super) fn rows(&self, rows: Rows) {
        if !rows.rows.is_empty() {
            // Nobody may be there, as below.
            let _ = self.sender.send(News::Rows(rows.into()));
        }
    }

    /// Number of the station.
    pub(super) fn station(&self) -> u8 {
        self.station
    }

    /// Tells why rows do not go on.
    pub(super) fn cut(&self, why: &str) {
        let _ = self.sender.send(News::Cut(why.into()));
    }
}
