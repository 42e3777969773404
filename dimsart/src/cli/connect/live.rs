//! What goes on until Ctrl-C: a look at signals, and the lease that motion needs.

use std::error::Error;
use std::fmt::Write as _;
use std::io::{self, IsTerminal, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::{Device, Json, Look};
use crate::connect::{ConnectError, Live, SignalReport};

/// How soon Ctrl-C is seen.
const A_MOMENT: Duration = Duration::from_millis(20);

pub(super) fn lines(signals: &[SignalReport]) -> String {
    signals.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

/// A second screen of the terminal, left when this goes; none where the output is not a terminal.
struct Screen(bool);

impl Screen {
    fn enter(json: &Json, out: &mut impl Write) -> io::Result<Self> {
        let screen = Self(io::stdout().is_terminal() && !json.json);
        if screen.0 {
            write!(out, "\x1b[?1049h\x1b[?25l")?;
        }
        Ok(screen)
    }

    /// Shows `text` in place of what was there.
    fn show(&self, out: &mut impl Write, text: &str) -> io::Result<()> {
        if self.0 {
            let mut page = String::from("\x1b[H");
            for line in text.lines() {
                // Each line clears what is left of the old one: no flicker.
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

/// Shows signals, as JSON a line for each look; with `is_armed` it holds the lease meanwhile.
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
        device.give_lease_back()?;
    }
    let last = ending?;
    if is_terminal {
        writeln!(out, "{last}")?;
    }
    Ok(())
}

/// Looks again and again until `stop`; gives the last look.
fn refresh(
    device: &mut Device,
    names: &[String],
    period: Duration,
    (screen, json): (&Screen, &Json),
    stop: &AtomicBool,
    out: &mut impl Write,
) -> Result<String, Box<dyn Error>> {
    let (mut next, mut live) = (Instant::now(), Live::new(names, period));
    loop {
        let signals = device.look(&mut live)?;
        let look = Look { live: Some(device.live()?), signals };
        let text = if json.json { serde_json::to_string(&look)? } else { look.to_string() };
        screen.show(out, &text)?;
        next = (next + period).max(Instant::now());
        while Instant::now() < next && !stop.load(Ordering::Relaxed) {
            device.renew_in_time()?;
            device.listen((next - Instant::now().min(next)).min(A_MOMENT)).map_err(ConnectError::from)?;
        }
        if stop.load(Ordering::Relaxed) {
            return Ok(text);
        }
    }
}

/// Raised by Ctrl-C, from now on.
fn on_ctrl_c() -> Result<Arc<AtomicBool>, ctrlc::Error> {
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed))?;
    Ok(stop)
}

/// Holds the lease until Ctrl-C and says how the device is doing: in one line of a terminal, elsewhere in a line for
/// every change.
pub(super) fn arm(device: &mut Device, json: &Json, out: &mut impl Write) -> Result<(), Box<dyn Error>> {
    let stop = on_ctrl_c()?;
    device.hold_lease()?;
    if !json.json {
        writeln!(out, "client {} holds the lease until Ctrl-C", device.client())?;
    }
    let ending = hold(device, json, &stop, out);
    // Also after an error; what cannot be given back ends by itself.
    let given_back = device.give_lease_back();
    ending?;
    given_back?;
    if !json.json {
        writeln!(out, "gave the lease back: the device gets its safe input")?;
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
        device.renew_in_time()?;
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
