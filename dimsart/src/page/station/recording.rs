//! Records all rows of a station to a file, independently of the browsers that start, end or watch it.
//!
//! Its thread receives the news as a browser does, so that its disk delays no other thread; missed rows count as lost.

use std::fs;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use serde::Serialize;
use serde_json::Value;
use tokio::sync::broadcast::Receiver;
use tokio::sync::broadcast::error::{RecvError, TryRecvError};
use tokio::sync::oneshot;

use super::super::news::{Board, News, Rows};
use super::Answer;
use super::tapping::every_ticks;
use crate::page::page_device::PageDevice;
use crate::report::SignalsKind;
use crate::tap_file::{self, Next, OTHER_SIGNALS, TapFile};

/// Interval of progress news.
const PROGRESS: Duration = Duration::from_millis(250);

/// Records a station.
#[derive(Debug)]
pub(super) struct Recorder {
    news: Arc<Board>,
    /// Name, port and baud rate of the station.
    name: String,
    port: String,
    baud: Option<u32>,
    /// Folder for the folders of recordings; `None` disables recordings.
    folder: Option<PathBuf>,
    running: Mutex<Option<Running>>,
}

/// Requests to a running recording.
#[derive(Debug, Default)]
struct Running {
    /// Receivers of its summary.
    ending: Vec<oneshot::Sender<Answer>>,
    why: &'static str,
}

/// A file and its missing samples.
struct Recording {
    file: TapFile,
    /// Layout, number and lost samples expected with the next rows.
    next: Option<(u32, u64, u64)>,
    /// Samples lost on the line, and rows missed while waiting for the disk.
    lost: u64,
}

/// Progress or summary of a recording.
#[derive(Serialize)]
struct Progress<'a> {
    is_running: bool,
    path: &'a Path,
    rows: u64,
    lost: u64,
    /// Summary.
    text: Option<&'a str>,
}

impl Recorder {
    pub(super) fn new(
        news: Arc<Board>,
        name: &str,
        port: String,
        baud: Option<u32>,
        folder: Option<PathBuf>,
    ) -> Self {
        Self { news, name: name.to_owned(), port, baud, folder, running: Mutex::default() }
    }

    fn running(&self) -> MutexGuard<'_, Option<Running>> {
        self.running.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn is_running(&self) -> bool {
        self.running().is_some()
    }

    /// Starts a recording with the present configuration; returns its path. Only one thread calls it.
    pub(super) fn begin(self: &Arc<Self>, device: &mut PageDevice) -> Answer {
        let Some(folder) = &self.folder else {
            return Err(
                "this server does not record: use the page of `dimsart serve`, or `dimsart record PORT`"
                    .to_owned(),
            );
        };
        if self.is_running() {
            return Err("a recording is already running: end it first".to_owned());
        }
        let every_ticks = every_ticks(self.baud, device.identity().sample_period_s.into());
        let format = tap_file::format(device, &self.port, every_ticks, SignalsKind::Mcap)
            .map_err(|error| error.to_string())?;
        let folder = new_folder(folder, &self.name)
            .map_err(|error| format!("cannot create a recording folder in {}: {error}", folder.display()))?;
        let file = TapFile::create(&folder, device.identity(), every_ticks, format)
            .map_err(|error| error.to_string())?;
        let path = file.path().display().to_string();
        let (_, news) = self.news.read();
        *self.running() = Some(Running::default());
        let (recorder, recording) = (Arc::clone(self), Recording { file, next: None, lost: 0 });
        let thread = thread::Builder::new().name(format!("{} recording", self.name));
        if let Err(error) = thread.spawn(move || recorder.run(recording, news)) {
            *self.running() = None;
            return Err(error.to_string());
        }
        Ok(Value::String(path))
    }

    /// Ends the recording and sends its summary.
    pub(super) fn end(&self, why: &'static str, answer: oneshot::Sender<Answer>) {
        match &mut *self.running() {
            Some(running) => {
                running.ending.push(answer);
                running.why = why;
            }
            None => {
                let _ = answer.send(Err("no recording is running".to_owned()));
                return;
            }
        }
        // Wakes the recording when no rows arrive.
        self.news.cut(why);
    }

    /// Runs the thread of a recording.
    fn run(&self, mut recording: Recording, mut news: Receiver<News>) {
        let mut told = Instant::now();
        self.tell(&recording);
        let cut = loop {
            if told.elapsed() > PROGRESS {
                told = Instant::now();
                self.tell(&recording);
            }
            let is_ending = self.running().as_ref().is_some_and(|running| !running.ending.is_empty());
            // An ending recording takes the rows received so far.
            let piece = match is_ending {
                true => news.try_recv(),
                false => news.blocking_recv().map_err(|error| match error {
                    RecvError::Closed => TryRecvError::Closed,
                    RecvError::Lagged(missed) => TryRecvError::Lagged(missed),
                }),
            };
            match piece {
                Ok(News::Rows(rows)) => match recording.take(&rows) {
                    Next::GoesOn => {}
                    Next::Ends(why) => break Some(why.into()),
                    Next::WriteFailed => break None,
                },
                // Before the first row there is nothing to continue.
                Ok(News::Discontinuity(why)) if !is_ending && recording.next.is_some() => break Some(why),
                // The number of the next rows shows how many are missing.
                Ok(News::Discontinuity(_) | News::Text(_)) | Err(TryRecvError::Lagged(_)) => {}
                Err(TryRecvError::Empty | TryRecvError::Closed) => break None,
            }
        };
        drop(news);
        self.finish(recording, cut.as_deref());
    }

    fn tell(&self, recording: &Recording) {
        let Recording { file, lost, .. } = recording;
        let (path, rows) = (file.path(), file.rows());
        self.news.tell("recording", &Progress { is_running: true, path, rows, lost: *lost, text: None });
    }

    fn finish(&self, recording: Recording, cut: Option<&str>) {
        let Recording { file, lost, .. } = recording;
        let (path, rows) = (file.path().to_owned(), file.rows());
        let asked = self.running().as_ref().map_or("", |running| running.why);
        let done = file.finish(lost, cut.unwrap_or(asked)).map_err(|error| error.to_string());
        let text = done.as_ref().unwrap_or_else(|reason| reason);
        // The lock prevents a new recording before this summary is published.
        let mut running = self.running();
        self.news
            .tell("recording", &Progress { is_running: false, path: &path, rows, lost, text: Some(text) });
        for answer in running.take().into_iter().flat_map(|running| running.ending) {
            // The browser may have disconnected.
            let _ = answer.send(done.clone().map(Value::String));
        }
    }
}

impl Recording {
    fn take(&mut self, rows: &Rows) -> Next {
        let (layout, next, lost) = *self.next.get_or_insert((rows.layout, rows.first, rows.lost));
        if layout != rows.layout {
            return Next::Ends(OTHER_SIGNALS);
        }
        self.lost += rows.first.saturating_sub(next) + rows.lost.saturating_sub(lost);
        self.next = Some((layout, rows.first + rows.rows.len() as u64, rows.lost));
        self.file.add(&rows.signals, &rows.rows)
    }
}

/// Creates the first unused `NAME-NUMBER` in a folder.
fn new_folder(folder: &Path, name: &str) -> io::Result<PathBuf> {
    fs::create_dir_all(folder)?;
    let is_plain = |letter: &char| letter.is_ascii_alphanumeric() || *letter == '_';
    let plain: String = name.chars().map(|letter| if is_plain(&letter) { letter } else { '-' }).collect();
    let mut number = 1_u32;
    loop {
        let path = folder.join(format!("{}-{number}", plain.trim_matches('-')));
        match fs::create_dir(&path) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => number += 1,
            made => return made.map(|()| path),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::connect::{Identity, SubscriptionRow};
    use crate::report::SignalsFormat;
    use crate::tap_file::BEGUN_ANEW;

    #[test]
    fn what_the_disk_or_the_line_was_too_slow_for_is_counted() {
        let folder = tempfile::tempdir().unwrap();
        let path = new_folder(folder.path(), "/dev/ttyACM0").unwrap();
        assert_eq!(path, folder.path().join("dev-ttyACM0-1"));
        let identity = Identity {
            protocol_version: 0,
            device: "joint".to_owned(),
            image: String::new(),
            axes: Vec::new(),
            sample_period_s: 1e-3,
        };
        let file = TapFile::create(&path, &identity, 1, SignalsFormat::Csv).unwrap();
        let mut recording = Recording { file, next: None, lost: 0 };
        let rows = |layout, first, lost| Rows {
            station: 0,
            layout,
            signals: [].into(),
            first,
            lost,
            rows: (first..first + 10)
                .map(|tick| SubscriptionRow { tick: u32::try_from(tick).unwrap(), values: Vec::new() })
                .collect(),
        };
        // Earlier losses do not count.
        assert_eq!(recording.take(&rows(1, 500, 7)), Next::GoesOn);
        assert_eq!(recording.lost, 0);
        assert_eq!(recording.take(&rows(1, 510, 9)), Next::GoesOn);
        assert_eq!(recording.take(&rows(1, 1520, 9)), Next::GoesOn);
        assert_eq!((recording.lost, recording.file.rows()), (2 + 1000, 30));
        assert_eq!(recording.take(&rows(2, 1530, 9)), Next::Ends(OTHER_SIGNALS));
        assert_eq!(recording.file.rows(), 30);
        // The device was restarted with the same signals.
        let restarted = Rows { first: 1530, ..rows(1, 3, 9) };
        assert_eq!(recording.take(&restarted), Next::Ends(BEGUN_ANEW));
        assert_eq!(recording.file.rows(), 30);
        let text = recording.file.finish(0, "").unwrap();
        assert!(text.ends_with("30 rows of 0 signals, 0 samples lost, 1000 rows missing"), "{text}");
    }
}
