//! Stations, state and faults.

use ratatui::style::{Color, Style};
use ratatui::text::{Line, Span};

use super::paint;
use crate::top::messages::{Live, Status};
use crate::top::screen::Screen;
use crate::top::seen::Seen;
use crate::top::text::wrapped;

/// Maximum number of lines of a sentence.
const MAX: usize = 3;

/// Returns the top lines.
pub(super) fn lines(screen: &Screen, width: usize) -> Vec<Line<'static>> {
    let mut lines = vec![tabs(screen)];
    let Some(seen) = screen.seen() else { return lines };
    let paragraph = |text: &str, style: Style| {
        wrapped(text, width, MAX).into_iter().map(move |line| Line::styled(line, style))
    };
    let bad = paint(screen, Color::Red).bold();
    match (&seen.gone, &seen.status) {
        (Some(reason), _) => {
            lines.extend(paragraph(&format!("NO CONNECTION to the device: {reason}"), bad));
            return lines;
        }
        (None, None) => lines.push("waiting for the device …".into()),
        (None, Some(Status { live, .. })) => {
            let colour = if live.is_commanded { Color::Green } else { Color::Yellow };
            lines.extend(paragraph(&live.state, paint(screen, colour).bold()));
            lines.extend(paragraph(&facts(seen, live), Style::new()));
        }
    }
    // Do not repeat a fault that the state contains.
    let state = seen.status.as_ref().map_or("", |status| status.live.state.as_str());
    let fault = seen.first_fault();
    let fault = fault.filter(|fault| !state.contains(fault.trim_start_matches("fault: ")));
    lines.extend(fault.iter().flat_map(|fault| paragraph(fault, bad)));
    lines
}

/// Returns a tab per station: its number is its key; `*` marks an armed station, `!` a closed line.
fn tabs(screen: &Screen) -> Line<'static> {
    let tab = |(place, seen): (usize, &Seen)| {
        let mark = match seen.is_held_here() {
            true => "*",
            false if seen.gone.is_some() => "!",
            false => "",
        };
        let text = format!(" {} {}{mark} ", place + 1, seen.name);
        if place == screen.at { Span::styled(text, Style::new().reversed()) } else { Span::raw(text) }
    };
    screen.stations.iter().enumerate().map(tab).collect()
}

fn facts(seen: &Seen, live: &Live) -> String {
    let lease = match (seen.is_held_here(), live.holder) {
        (true, _) => "ARMED by this terminal".to_owned(),
        (false, Some(holder)) => format!("client {holder} holds the lease"),
        (false, None) => "no client holds the lease".to_owned(),
    };
    let drive = seen.faults.as_ref().map_or(String::new(), |faults| format!("drive: {}; ", faults.drive));
    let silence =
        live.silence_s.map_or(String::new(), |silence_s| format!("; NO HEARTBEAT for {silence_s:.1} s"));
    format!("{drive}{lease}; tick {}{silence}", live.ticks)
}
