//! Commands that run until Ctrl-C: `watch` and `arm`.

use std::error::Error;
use std::fmt::Write as _;
use std::io::{self, IsTerminal, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::{Device, Json, Look};
use crate::connect::{ConnectError, SignalPoll, SignalReport};

/// Interval at which Ctrl-C is checked.
const A_MOMENT: Duration = Duration::from_millis(20);

pub(super) fn lines(signals: &[SignalReport]) -> String {
    signals.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

/// The alternate screen of the terminal; inactive if the output is not a terminal.
struct Screen(bool);

impl Screen {
    fn enter(json: &Json, out: &mut impl Write) -> io::Result<Self> {
        let screen = Self(io::stdout().is_terminal() && !json.json);
        if screen.0 {
            write!(out, "\x1b[?1049h\x1b[?25l")?;
        }
        Ok(screen)
    }

    /// Replaces the screen's content by `text`.
    fn show(&self, out: &mut impl Write, text: &str) -> io::Result<()> {
        if self.0 {
            let mut page = String::from("\x1b[H");
            for line in text.lines() {
                // Clearing line by line avoids flicker.
                let _ = write!(page, "{line}\x1b[K\r\n");
            }
            write!(out, "{page}\x1b[J")?;
        } else {
            writeln!(out, "{text}")?;
        }
        out.flush()
    }

    fn leave(self, out: &mut impl Write) -> io::Result<()> {
        if self.0 { write!(out, "\x1b[?25h\x1b[?1049l") } else { Ok(()) }
    }
}

/// Shows signals until Ctrl-C, as JSON with a line for each update; with `is_armed`, holds the lease meanwhile.
pub(super) fn watch(
    device: &mut Device,
    names: &[String],
    period: Duration,
    is_armed: bool,
    json: &Json,
    out: &mut impl Write,
) -> Result<(), Box<dyn Error>> {
    let stop = on_ctrl_c()?;
    if is_armed {
        device.hold_lease()?;
    }
    let screen = Screen::enter(json, out)?;
    let ending = refresh(device, names, period, (&screen, json), &stop, out);
    let is_terminal = screen.0;
    screen.leave(out)?;
    if is_armed {
        device.release_lease()?;
    }
    let last = ending?;
    if is_terminal {
        writeln!(out, "{last}")?;
    }
    Ok(())
}

/// Updates periodically until `stop`; returns the last text.
fn refresh(
    device: &mut Device,
    names: &[String],
    period: Duration,
    (screen, json): (&Screen, &Json),
    stop: &AtomicBool,
    out: &mut impl Write,
) -> Result<String, Box<dyn Error>> {
    let (mut next, mut live) = (Instant::now(), SignalPoll::new(names, period));
    loop {
        let signals = device.read_signals(&mut live)?;
        let look = Look { live: Some(device.live()?), signals };
        let text = if json.json { serde_json::to_string(&look)? } else { look.to_string() };
        screen.show(out, &text)?;
        next = (next + period).max(Instant::now());
        while Instant::now() < next && !stop.load(Ordering::Relaxed) {
            device.renew_if_due()?;
            device.listen((next - Instant::now().min(next)).min(A_MOMENT)).map_err(ConnectError::from)?;
        }
        if stop.load(Ordering::Relaxed) {
            return Ok(text);
        }
    }
}

/// Installs a handler for Ctrl-C; returns the flag that it sets.
fn on_ctrl_c() -> Result<Arc<AtomicBool>, ctrlc::Error> {
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed))?;
    Ok(stop)
}

/// Holds the lease until Ctrl-C and reports the device's state: in one line of a terminal, else in a line per change.
pub(super) fn arm(device: &mut Device, json: &Json, out: &mut impl Write) -> Result<(), Box<dyn Error>> {
    let stop = on_ctrl_c()?;
    device.hold_lease()?;
    if !json.json {
        writeln!(out, "armed: client {} holds the lease until Ctrl-C", device.client())?;
    }
    let ending = hold(device, json, &stop, out);
    // Also after an error; a lease that cannot be released expires.
    let given_back = device.release_lease();
    ending?;
    given_back?;
    if !json.json {
        writeln!(out, "disarmed: lease released, outputs at their safe value")?;
    }
    Ok(())
}

fn hold(
    device: &mut Device,
    json: &Json,
    stop: &AtomicBool,
    out: &mut impl Write,
) -> Result<(), Box<dyn Error>> {
    let is_live = io::stdout().is_terminal() && !json.json;
    let mut last = None;
    while !stop.load(Ordering::Relaxed) {
        device.renew_if_due()?;
        let live = device.live()?;
        let news = Some((live.is_commanded, live.holder, live.state.clone()));
        if is_live {
            write!(out, "\r{live}\x1b[K")?;
        } else if news != last {
            json.print(out, &live)?;
            last = news;
        }
        out.flush()?;
        device.listen(A_MOMENT).map_err(ConnectError::from)?;
    }
    if is_live { writeln!(out) } else { Ok(()) }.map_err(Into::into)
}
