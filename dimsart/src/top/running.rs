//! Runs the terminal page until the user quits.

use std::env;
use std::io;
use std::process;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{self, Event};
use tokio::sync::broadcast::Receiver;
use tokio::sync::broadcast::error::TryRecvError;
use tokio::sync::oneshot;

use super::draw::draw;
use super::screen::{Screen, Wish};
use crate::page::Station;
use crate::page::action::{Action, Edit};
use crate::page::news::News;
use crate::page::station::Answer;

/// The only client of these stations.
const CLIENT: u64 = 0;
/// Interval of redraws and of presence reports.
const PICTURE: Duration = Duration::from_millis(100);
/// Maximum wait for answers on exit; the lease expires after 0.5 s anyway.
const PARTING: Duration = Duration::from_secs(1);

/// Shows stations in the terminal and carries out the user's actions until the user quits or `stop` is set. Then it always
/// releases the lease and restores the terminal.
///
/// # Errors
/// An error of the terminal.
pub(crate) fn run(stations: Vec<Station>, stop: &Arc<AtomicBool>) -> io::Result<()> {
    exit_after(Arc::clone(stop));
    let has_colours = env::var_os("NO_COLOR").is_none_or(|said| said.is_empty());
    let names: Vec<&str> = stations.iter().map(Station::name).collect();
    let screen = Screen::new(&names, has_colours);
    let mut running = Running { screen, news: Vec::new(), awaited: Vec::new(), stations: &stations };
    let ended = ratatui::try_init().and_then(|mut terminal| running.show(&mut terminal, stop));
    // Release the lease first: the terminal may be closed.
    running.let_go();
    ended.and(ratatui::try_restore())
}

/// Ends the process soon after `stop` is set: crossterm's `poll` never returns once the terminal is closed.
fn exit_after(stop: Arc<AtomicBool>) {
    thread::spawn(move || {
        while !stop.load(Ordering::Relaxed) {
            thread::sleep(PICTURE);
        }
        thread::sleep(2 * PARTING);
        process::exit(1);
    });
}

struct Running<'a> {
    screen: Screen,
    stations: &'a [Station],
    news: Vec<Receiver<News>>,
    /// Requests and the receivers of their answers.
    awaited: Vec<(String, oneshot::Receiver<Answer>)>,
}

impl Running<'_> {
    fn show(&mut self, terminal: &mut DefaultTerminal, stop: &AtomicBool) -> io::Result<()> {
        for (number, station) in self.stations.iter().enumerate() {
            let (last, news) = station.board().read();
            last.iter().for_each(|text| self.screen.hear(number, text));
            self.news.push(news);
        }
        while !stop.load(Ordering::Relaxed) {
            self.stations.iter().for_each(|station| station.hear(CLIENT, true));
            self.read_news();
            self.take_answers();
            terminal.draw(|frame| draw(frame, &self.screen))?;
            let next = Instant::now() + PICTURE;
            // Handle a key immediately, and all pending keys.
            let mut wait = PICTURE;
            while event::poll(wait)? {
                if let Event::Key(key) = event::read()? {
                    match self.screen.key(key) {
                        Some(Wish::Quit) => return Ok(()),
                        Some(wish) => self.grant(wish),
                        None => {}
                    }
                    wait = Duration::ZERO;
                } else {
                    wait = next.saturating_duration_since(Instant::now());
                }
                if Instant::now() > next {
                    break;
                }
            }
        }
        Ok(())
    }

    fn read_news(&mut self) {
        for ((number, news), station) in self.news.iter_mut().enumerate().zip(self.stations) {
            loop {
                match news.try_recv() {
                    Ok(News::Text(text)) => self.screen.hear(number, &text),
                    Ok(News::Rows(rows)) => {
                        if let Some(seen) = self.screen.stations.get_mut(number) {
                            seen.live.hear(&rows);
                        }
                    }
                    Ok(News::Discontinuity(_)) => {}
                    // Missed news: read the latest of each kind again.
                    Err(TryRecvError::Lagged(_)) => {
                        station.board().last().iter().for_each(|text| self.screen.hear(number, text));
                    }
                    Err(TryRecvError::Empty | TryRecvError::Closed) => break,
                }
            }
        }
    }

    fn take_answers(&mut self) {
        let Self { awaited, screen, .. } = self;
        awaited.retain_mut(|(what, answer)| match answer.try_recv() {
            Ok(Ok(done)) => {
                // A check is reported by its state.
                let done = done.get("state").unwrap_or(&done).as_str().unwrap_or_default();
                screen.tell(format!("{what}: {done}"), false);
                false
            }
            Ok(Err(reason)) => {
                screen.tell(format!("{what}: {reason}"), true);
                false
            }
            Err(oneshot::error::TryRecvError::Empty) => true,
            Err(oneshot::error::TryRecvError::Closed) => {
                screen.tell(format!("{what}: no connection to the device"), true);
                false
            }
        });
    }

    fn grant(&mut self, wish: Wish) {
        match wish {
            Wish::Stop => {
                // Send all STOPs before waiting for an answer.
                for station in self.stations {
                    self.awaited.push((format!("{} STOP", station.name()), station.stop()));
                }
            }
            Wish::Arm { station } => self.ask(station, "arm", Action::Arm),
            Wish::Disarm { station } => self.ask(station, "disarm", Action::Disarm),
            Wish::Check { station } => self.ask(station, "check", Action::Check),
            Wish::Reset { station } => self.ask(station, "reset", Action::Reset),
            Wish::Set { station, module, parameter, value } => {
                self.ask(station, "set", Action::Edit(Edit::Set { module, parameter, value }));
            }
            Wish::Quit => {}
        }
    }

    fn ask(&mut self, station: usize, what: &str, action: Action) {
        if let Some(station) = self.stations.get(station) {
            self.awaited.push((format!("{} {what}", station.name()), station.ask(CLIENT, action)));
        }
    }

    /// Ends the motion of all stations.
    fn let_go(&mut self) {
        for station in self.stations {
            station.hear(CLIENT, false);
            // The answer confirms that the release was handled.
            self.awaited.push((String::new(), station.ask(CLIENT, Action::Events)));
        }
        let deadline = Instant::now() + PARTING;
        while !self.awaited.is_empty() && Instant::now() < deadline {
            self.take_answers();
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}
